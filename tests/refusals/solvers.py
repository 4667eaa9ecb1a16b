"""Names of the refused expressions of `solvers`."""

# ruff: noqa: F401 -- the approved text uses the names

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import torch

from benchmarks.verification.cases import calculix
from benchmarks.verification.hyperelastic import Hyperelastic
from pinnray.geometry.cache import finger_mesh
from pinnray.geometry.mesh.settings import MeshSettings
from pinnray.geometry.mesh.triangle_mesh import TriangleMesh
from pinnray.solvers.elasticity import (
    energy_density_of,
    lame_constants,
    lame_derivatives,
    piola_stress,
    piola_stress_and_tangent,
    strain_of,
    stress_of,
)
from pinnray.solvers.fem.adaptive_refinement import adapted
from pinnray.solvers.finger_figures import figures_of
from pinnray.solvers.lagrange import LagrangeSpace
from pinnray.solvers.load import Physics
from pinnray.solvers.materials import TensileTest, fitted, preset, read_tensile_test
from pinnray.solvers.problem import Load, Material, Problem
from pinnray.solvers.registry import make_solver
from pinnray.solvers.solver import solved
from tests.meshes import permuted
from tests.solvers.conftest import SHORT, observed_at
from tests.solvers.test_solver import Beam, Field, ended, spoilt

STRAIN = np.linspace(0.02, 0.8, 40)

FILES = {
    "force.csv": "force,stress_MPa\n1,2\n",
    "text.csv": "strain,stress_MPa\n0.1,1\n0.2,x\n0.3,2\n",
    "short.csv": "strain,stress_MPa\n0,0\n0.2,1\n",
    "empty.csv": "",
    "true.csv": "True strain,stress_MPa\n0.1,1\n",
    "unit.csv": "strain,stress\n0.1,1\n0.2,2\n0.3,3\n",
    "percent.csv": "strain,stress_MPa\n10,1\n20,2\n30,3\n",
    "longer.csv": "strain,stress_MPa\n0.1,1,23\n",
}


@cache
def mesh() -> TriangleMesh:
    """The short finger with elements of 2 mm."""
    return finger_mesh(SHORT, settings=MeshSettings(size=2.0), across=1)


def problem(law: str = "linear", **load: object) -> Problem:
    """The short finger under a load."""
    return Problem(mesh(), Material(law=law), Load(**load), finger=SHORT)


def seen(problem: Problem, *markers: int) -> Problem:
    """The problem with markers at rest, of which some were seen."""
    points = problem.mesh.markers
    visible = np.isin(np.arange(len(points)), markers)
    return replace(problem, observations=observed_at(points, np.zeros_like(points), 0.01, visible))


def torn() -> Problem:
    """Two fingers, of which one is not clamped."""
    one = mesh()
    points = np.concatenate([one.points, one.points - [0.0, 100.0]])
    triangles = np.concatenate([one.triangles, one.triangles + len(one.points)])
    return Problem(replace(one, points=points, triangles=triangles))


def with_a_gap(position: float) -> Problem:
    """A finger whose front has a gap at x = 30 mm, pressed at a position, mm."""
    one = mesh()
    front = one.boundary("front")
    beside = np.abs(one.points[front].mean(axis=1)[:, 0] - 30) > 2
    return Problem(
        replace(one, boundaries={**one.boundaries, "front": front[beside]}), load=Load(position=position)
    )
