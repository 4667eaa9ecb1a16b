"""Marker displacements from a finite-strain simulation, where no camera has measured any.

The indenter is a sliding patch on a neo-Hookean finger: a model that is richer than the linear ones that are
judged by it, and whose distance from them is known to be of the size and pattern of the paper's gap between
simulation and experiment.
"""

from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType

import numpy as np

from compare.evaluation.evaluation import Evaluation
from compare.evaluation.truths import SLIDING, Truth, check_walls
from compare.runtime.provenance import package_versions
from geometry.cache import cache_folder, finger_mesh, kept_if_possible
from geometry.content_hash import content_hash, sources_digest
from geometry.errors import UserError
from geometry.mesh.settings import MeshSettings
from geometry.mesh.triangle_mesh import TriangleMesh
from geometry.observations import Observations
from solvers.problem import Problem
from solvers.registry import MissingLibraryError, make_solver
from solvers.solution import Solution
from solvers.solver import Progress, Solver, silent

SOURCE = "simulated by {} ({}); no camera was involved"
"""Provenance that is shown with the numbers, around solver and description of the truth."""

SOLID_SIZE = 0.75
"""Element size of a section in three dimensions, mm: some 170,000 unknowns for the default finger."""


class UnfinishedExperimentError(UserError):
    """The virtual experiment did not reach its full load."""


def virtual_experiment(
    problem: Problem, marker_radius: float, progress: Progress = silent, truth: Truth = SLIDING
) -> tuple[Observations, Evaluation]:
    """Simulate what a camera would have measured at the mesh's markers; kept in the cache folder.

    Args:
        problem: The finger and its load; the simulation has its own law and kind of load.
        marker_radius: Radius of the design's markers, mm.
        progress: Told how far the simulation is.
        truth: What is simulated; its walls must be as drawn. In three dimensions the section has elements of
            `SOLID_SIZE`, for which the problem must know its finger.

    Returns:
        The observations, and the true fields on the problem's mesh.

    Raises:
        UserError: If the simulation cannot be run.
        UnfinishedExperimentError: If it does not reach the full load.
    """
    found = _truth(problem, progress, truth)
    markers = problem.mesh.markers
    observations = Observations(
        points=markers,
        displacements=found.marker_displacement,
        standard_deviations=np.zeros_like(markers),
        visible=np.ones(len(markers), dtype=bool),
        source=experiment_source(problem, truth),
        simulated=True,
        marker_radius=marker_radius,
    )
    return observations, found


def _truth(problem: Problem, progress: Progress, truth: Truth) -> Evaluation:
    """The true fields, from the cache where they are there."""
    try:
        solver, richer = _richer(_on_own_mesh(problem, truth), truth)
        key = _key(solver, richer, problem.mesh)
        entry = cache_folder() / f"experiment-{key}.npz"
        if (kept := Evaluation.load(entry, key)) is not None:
            progress(1.0, "from the cache")
            return kept
        solution = _solved(solver, richer, progress)
    except UserError as error:
        raise type(error)(f"{error}; or give measurements") from None
    evaluation = Evaluation.of(solution, problem.mesh)
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
    """The solution behind `virtual_experiment`, solved anew.

    Args:
        problem: The finger, with the walls of the truth, and its load.
        progress: Told how far the simulation is.
        truth: Gives law and kind of load.
        settings: Of the solver that simulates it.

    Raises:
        UserError: If it cannot be run.
        UnfinishedExperimentError: If it does not reach the full load.
    """
    return _solved(*_richer(problem, truth, settings), progress)


def experiment_source(problem: Problem, truth: Truth = SLIDING) -> str:
    """Provenance of the simulated numbers, one sentence."""
    return SOURCE.format(truth.solver, truth.description.format(-(problem.load.displacement[1] or 0.0)))


def _solved(solver: Solver, richer: Problem, progress: Progress) -> Solution:
    solution = solver.solve(richer, progress)
    if not solution.status.converged:
        raise UnfinishedExperimentError(f"the virtual experiment {solution.status.message}")
    return solution


def _richer(
    problem: Problem, truth: Truth = SLIDING, settings: Mapping[str, object] = MappingProxyType({})
) -> tuple[Solver, Problem]:
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
        raise UserError(f"the virtual experiment: {error}; or give measurements") from None
    richer = Problem(
        mesh=problem.mesh,
        material=truth.material(problem.material),
        load=truth.load(-normal),
    )
    return solver, richer


def _on_own_mesh(problem: Problem, truth: Truth) -> Problem:
    """The problem on the mesh that a truth is simulated on."""
    check_walls(truth)
    if not truth.solid:
        return problem
    if problem.finger is None:
        raise UserError(f"truth {truth.name}: the problem has to know its finger, which is meshed anew")
    return replace(problem, mesh=finger_mesh(problem.finger, settings=MeshSettings(size=SOLID_SIZE)))


def _key(solver: Solver, problem: Problem, shared: TriangleMesh) -> str:
    """SHA-256 over the mesh of the fields, solver, problem, sources and versions."""
    parts = [
        shared.digest,
        solver.name,
        problem.digest,
        solver.settings(),
        package_versions(),
        sources_digest(__name__, type(solver).__module__),
        SOURCE,
    ]
    return content_hash(parts)
