"""Simulates a truth, and takes the displacements of markers from it where no camera has measured any."""

from dataclasses import replace

import numpy as np

from pinnray.comparison.evaluation.evaluation import Evaluation, evaluated, solution_key
from pinnray.comparison.evaluation.truths import SLIDING, Truth, check_walls
from pinnray.geometry.cache import finger_mesh
from pinnray.geometry.mesh.settings import MeshSettings
from pinnray.geometry.observations import Observations
from pinnray.runtime.cache import cache_folder, kept_if_possible
from pinnray.runtime.errors import UserError
from pinnray.solvers.problem import Problem
from pinnray.solvers.registry import MissingLibraryError, make_solver
from pinnray.solvers.solution import Solution
from pinnray.solvers.solver import Progress, Solver, silent

SOURCE = "simulated by {} ({}); no camera was involved"
"""Provenance that is shown with the numbers, around solver and description of the truth."""

SOLID_SIZE = 0.75
"""Element size of a section in three dimensions, mm: some 170,000 unknowns for the default finger."""


class UnfinishedExperimentError(UserError):
    """The virtual experiment did not reach its full load."""


def virtual_experiment(
    problem: Problem, marker_radius: float, progress: Progress = silent, truth: Truth = SLIDING
) -> tuple[Observations, Evaluation]:
    """Simulate the displacements of the mesh's markers; kept in the cache folder.

    Args:
        problem: The finger and its load; the simulation has its own law and kind of load.
        marker_radius: Radius of the design's markers, mm.
        progress: Called with the fraction of the simulation.
        truth: What is simulated; its walls must be as drawn. In three dimensions the section has elements of
            `SOLID_SIZE`, for which the problem must know its finger.

    Returns:
        The observations, and the true fields on the problem's mesh.

    Raises:
        UserError: If the simulation cannot be run.
        UnfinishedExperimentError: If it does not reach the full load.
    """
    try:
        true = _true_fields(problem, progress, truth)
    except UserError as error:
        raise type(error)(f"{error}; or give measurements") from None
    markers, moved, source = problem.mesh.markers, true.marker_displacement, experiment_source(problem, truth)
    known = Observations(
        markers, moved, source=source, simulated=True, solid=truth.solid, marker_radius=marker_radius
    )
    return known, true


def _true_fields(problem: Problem, progress: Progress, truth: Truth) -> Evaluation:
    """The fields of a truth on the problem's mesh, from the cache if they are there."""
    check_walls(truth)
    own = problem
    if truth.solid:
        if problem.finger is None:
            raise UserError(f"truth {truth.name}: the problem has to know its finger, which is meshed anew")
        own = replace(problem, mesh=finger_mesh(problem.finger, settings=MeshSettings(size=SOLID_SIZE)))
    solver, richer = _richer(own, truth)
    key = solution_key(solver, richer, problem.mesh.digest, SOURCE)
    entry = cache_folder() / f"experiment-{key}.npz"
    if (kept := Evaluation.load(entry, key)) is not None:
        progress(1.0, "from the cache")
        return kept
    evaluation = evaluated(_solved(solver, richer, progress), problem.mesh)
    with kept_if_possible(entry.parent, "the virtual experiment"):
        evaluation.save(entry, key)
    return evaluation


def no_displacements(problem: Problem, marker_radius: float, reason: str) -> Observations:
    """The mesh's markers, none of whose displacements is known, for one reason."""
    markers = problem.mesh.markers
    zeros, hidden = np.zeros_like(markers), np.zeros(len(markers), dtype=bool)
    return Observations(markers, zeros, zeros, hidden, reason, simulated=False, marker_radius=marker_radius)


def simulate(
    problem: Problem, progress: Progress = silent, truth: Truth = SLIDING, **settings: object
) -> Solution:
    """Solve the problem of `virtual_experiment` anew, on a mesh with the walls of the truth.

    Raises:
        UserError: If it cannot be run.
        UnfinishedExperimentError: If it does not reach the full load.
    """
    return _solved(*_richer(problem, truth, **settings), progress)


def experiment_source(problem: Problem, truth: Truth = SLIDING) -> str:
    """Provenance of the simulated numbers, one sentence."""
    return SOURCE.format(truth.solver, truth.description.format(-(problem.load.displacement[1] or 0.0)))


def _solved(solver: Solver, richer: Problem, progress: Progress) -> Solution:
    solution = solver.solve(richer, progress)
    if not solution.status.converged:
        raise UnfinishedExperimentError(f"the virtual experiment {solution.status.message}")
    return solution


def _richer(problem: Problem, truth: Truth, **settings: object) -> tuple[Solver, Problem]:
    """The finite-strain solver and its problem."""
    normal = problem.load.displacement[1]
    if normal is None:
        raise UserError("the virtual experiment presses on the finger: prescribe v")
    if problem.load.position is not None:
        raise UserError(
            "the virtual experiment presses where the mesh has its contact: mesh the finger with its "
            "contact_position there"
        )
    try:
        solver = make_solver(truth.solver, **settings)
    except MissingLibraryError as error:
        raise UserError(f"the virtual experiment: {error}") from None
    material, load = truth.material(problem.material), truth.load(-normal)
    return solver, Problem(problem.mesh, material, load, finger=problem.finger)
