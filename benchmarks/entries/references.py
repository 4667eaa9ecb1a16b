"""The references of `pinnray benchmark`: finite elements graded to the corners and the contact; an hour.

Their stress is that of the smoothed gradient, nearer to the truth than the elements' own. The difference
between two meshes bounds their error: it falls at least in proportion to the elements.
"""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from rich.table import Table
from scipy.spatial import cKDTree

from pinnray.geometry.cache import finger_mesh
from pinnray.geometry.mesh.boundary import mean_thickness, singular_points
from pinnray.geometry.mesh.quadrature import body_quadrature
from pinnray.geometry.mesh.settings import MeshSettings
from pinnray.runtime.arrays import FloatArray
from pinnray.runtime.atomic import atomic_path
from pinnray.runtime.errors import UserError
from pinnray.runtime.tables import terminal_table
from pinnray.solvers.fem.error_estimate import GradientRecovery, ImprovedField
from pinnray.solvers.problem import contact_nodes, front_points
from pinnray.solvers.registry import make_solver
from pinnray.solvers.solution import Solution
from pinnray.studies.benchmark.problems import BenchmarkProblem, problem_set
from pinnray.studies.benchmark.references import MEASURES, STEPS, Reference, Sampled, unpacked

POINTS = MeshSettings(size=2.0)
"""Of the mesh with one element across each wall whose quadrature points are the fixed points."""
LINEAR = {"size": 0.06, "coarsening": 1.5, "corner_size": 0.0005, "contact_size": 0.001}
FINITE = LINEAR | {"corner_size": 0.002, "contact_size": 0.02}
"""Elements by law, where a problem has no others."""
COARSER = {"size": 1.42, "corner_size": 2.0, "contact_size": 2.0}
"""How many times larger those are that tell the error."""


def main(rows: str = "") -> Table:
    """Make the references of the problems whose names hold a text, and keep them."""
    cells = []
    for problem in (each for each in problem_set("full").problems if rows in each.name):
        made = make_reference(problem)
        save(made, problem.reference_file)
        cells.append((problem.name, *(f"{made.bounds[name]:.1e}" for name in MEASURES)))
    return terminal_table("Bounds of errors", ("problem", *MEASURES), cells, left=["problem"])


def make_reference(problem: BenchmarkProblem) -> Reference:
    """Solve a problem on two graded meshes; their difference bounds the error on the finer one.

    Raises:
        UserError: If a solution does not converge.
    """
    fine, coarse = _solved(problem, {}), _solved(problem, COARSER)
    rule = body_quadrature(finger_mesh(problem.finger, settings=POINTS, across=1))
    points = unpacked(*packed(rule.location.points))
    singular = np.concatenate([singular_points(fine.problem.mesh), _touched(fine)])
    away = cKDTree(singular).query(points)[0] > mean_thickness(fine.problem.mesh)
    reference = Reference(points, rule.weights, away, Sampled.of(fine, points))
    errors = reference.errors(Sampled.of(coarse, points)).items()
    return replace(reference, bounds={name: abs(value) for name, value in errors})


def _solved(problem: BenchmarkProblem, times: Mapping[str, float]) -> Solution:
    """The solution on elements so many times larger than usual, with its smoothed gradient."""
    usual = (LINEAR if problem.linear else FINITE) | problem.elements
    settings = MeshSettings(**{name: times.get(name, 1.0) * value for name, value in usual.items()})
    solver = make_solver("fem", estimate=False) if problem.linear else make_solver("fem-nonlinear")
    solution = solver.solve(problem.made(settings))
    if not solution.status.converged:
        raise UserError(f"the reference of {problem.name}: {solution.status.message}")
    field: Any = solution.field
    gradients = GradientRecovery(field.space).gradient(field.values)
    own = None if problem.linear else field
    return replace(solution, field=ImprovedField(field.space, field.values, gradients, own))


def _touched(solution: Solution) -> FloatArray:
    """Points of the front that the indenter touches before the load, shape (k, 2), mm."""
    mesh, contact = solution.problem.mesh, solution.contact
    drawn = mesh.points[contact_nodes(solution.problem)]
    if solution.problem.load.kind != "cylinder" or contact is None:
        return drawn
    return front_points(mesh, np.linspace(contact.start, contact.end, 100))


def save(reference: Reference, file: Path) -> None:
    """Write it compressed; fields and points in whole steps of their range."""
    exact, arrays = reference.exact, {}
    fields = {"points": reference.points, "u": exact.displacement, "von_mises": exact.von_mises}
    for name, values in fields.items():
        arrays[name], arrays[f"{name}_range"] = packed(values)
    arrays["numbers"] = [exact.force, exact.energy, *(reference.bounds[name] for name in MEASURES)]
    arrays["weights"], arrays["away"] = reference.weights.astype(np.float32), np.packbits(reference.away)
    with atomic_path(file) as partial, partial.open("wb") as stream:
        np.savez_compressed(stream, **arrays)


def packed(values: FloatArray) -> tuple[np.ndarray, FloatArray]:
    """Values as whole steps of their range, and its ends."""
    low, high = float(values.min()), float(values.max())
    return np.round((values - low) / (high - low) * STEPS).astype(np.uint16), np.array([low, high])
