"""A truth and its markers."""

import numpy as np
import pytest

from pinnray.geometry.mesh.triangle_mesh import TriangleMesh
from pinnray.geometry.observations import Observations
from pinnray.solvers.fem.linear import FemSolver
from pinnray.solvers.problem import Load, Problem
from pinnray.solvers.solution import Solution

NOISE = 0.005
"""Standard deviation of the markers' displacements, mm."""


@pytest.fixture(autouse=True)
def quick(few_elements: None) -> None:
    """Meshes of few elements: what is tested is not how accurate they are."""


@pytest.fixture(scope="package")
def truth(coarse_mesh: TriangleMesh) -> Solution:
    """Stands for a richer model: the same finger, pressed by something that sticks."""
    return FemSolver(degree=1).solve(Problem(coarse_mesh, load=Load(kind="patch", displacement=(-1.0, -9.0))))


@pytest.fixture(scope="package")
def observations(coarse_mesh: TriangleMesh, truth: Solution) -> Observations:
    points = coarse_mesh.markers
    deviations, visible = np.full_like(points, NOISE), np.ones(9, dtype=bool)
    return Observations(points, truth.displacement(points), deviations, visible, "a test", True, 0.8)
