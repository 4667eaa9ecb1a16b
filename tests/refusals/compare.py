"""Names of the refused expressions of `compare`."""

# ruff: noqa: F401, because the expressions of approved.txt use the names

from collections.abc import Callable
from dataclasses import replace
from functools import cache, partial
from pathlib import Path
from typing import Any

import numpy as np

from pinnray.comparison.evaluation.plausibility import check_positions, displacement_remarks
from pinnray.comparison.evaluation.truths import TRUTHS, Truth
from pinnray.comparison.evaluation.virtual_experiment import virtual_experiment
from pinnray.geometry.finger.design import Design
from pinnray.geometry.mesh.mesher import build_mesh
from pinnray.geometry.mesh.settings import MeshSettings
from pinnray.geometry.observations import Observations
from pinnray.geometry.picture_frame import HAND_HELD
from pinnray.runtime.arrays import FloatArray
from pinnray.solvers.fem.linear import FemSolver
from pinnray.solvers.problem import Load, Material, Problem
from tests.fingers import beam

FILES = {"empty/notes.txt": "mine", "damaged/metrics.json": "{", "foreign/metrics.json": '{"schema": 99}'}
truth = partial(Truth, name="mine", description="pressed in by {:.4g} mm")
MESH = build_mesh(Design(), MeshSettings(size=2.0), across=1)
PROBLEM = Problem(MESH)


@cache
def markers() -> Observations:
    """The markers of the finger, moved as `fem` says."""
    found = FemSolver(degree=1, estimate=False).solve(PROBLEM).displacement(MESH.markers)
    return Observations(MESH.markers, found, np.zeros_like(found), np.full(9, True), "a test", True, 0.8)


def turned(change: Callable[[FloatArray], FloatArray]) -> Observations:
    return replace(markers(), points=change(MESH.markers))


def moved(change: Callable[[FloatArray], FloatArray]) -> Observations:
    return replace(markers(), displacements=change(markers().displacements))


def pressed(**load: Any) -> Problem:
    return replace(PROBLEM, load=Load(**load))
