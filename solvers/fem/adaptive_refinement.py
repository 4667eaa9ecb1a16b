"""Refinement of the shared mesh until the displacements of the markers by `fem` are within a tolerance.

Solve, estimate, mark, refine. The functional is the sum of the errors of all marker components that are not
within the tolerance; the fewest triangles that hold a given share of its dual-weighted error are marked.

Source: W. Dörfler, A convergent adaptive algorithm for Poisson's equation, SIAM J. Numer. Anal. 33 (1996)
1106-1124, section 4.2 (the share); R. Becker, R. Rannacher, Acta Numerica 10 (2001) 1-102, section 4.
"""

from dataclasses import replace
from math import log

import numpy as np

from geometry.arrays import BoolArray, FloatArray
from geometry.mesh.refinement import refined
from geometry.section.section import Section
from solvers.adaptation import Adaptation, RefinementRound, check_adaptable
from solvers.fem.error_estimate import ErrorEstimator
from solvers.fem.linear_equilibrium import LinearElasticity, LinearEquilibrium
from solvers.lagrange import LagrangeSpace
from solvers.problem import Problem
from solvers.solver import Progress, silent

SHARE = 0.6
"""Share of the error whose triangles are refined in a round."""

MOST_TRIANGLES = 200_000
MOST_ROUNDS = 30


def adapted(
    problem: Problem,
    tolerance: float,
    *,
    degree: int = 2,
    section: Section | None = None,
    most_triangles: int = MOST_TRIANGLES,
    most_rounds: int = MOST_ROUNDS,
    progress: Progress = silent,
) -> Adaptation:
    """Refine the mesh of a linear problem until the estimated error at its markers is within a tolerance.

    Args:
        problem: With the mesh to start from.
        tolerance: Largest estimated error of u or v at a marker, mm.
        degree: Degree of the elements.
        section: The body, for the arcs of refined fillets.
        most_triangles: Largest number of triangles.
        most_rounds: Largest number of solutions.
        progress: Called after every round.

    Raises:
        UserError: As `solvers.adaptation.check_adaptable`.
    """
    check_adaptable(tolerance, problem.load)
    rounds: list[RefinementRound] = []
    while True:
        found, shares = _solve(problem, degree, tolerance)
        mesh = problem.mesh
        rounds.append(found)
        progress(
            _done(rounds, tolerance), f"{found.triangles} triangles, {found.at_markers:.2g} mm at the markers"
        )
        if found.at_markers <= tolerance or len(rounds) == most_rounds:
            break
        finer = refined(mesh, largest(shares, SHARE), section)
        if len(finer.triangles) > most_triangles:
            break
        problem = replace(problem, mesh=finer)
    return Adaptation(tolerance, tuple(rounds), mesh)


def largest(shares: FloatArray, part: float) -> BoolArray:
    """The fewest triangles that hold a part of the sum of the absolute shares, mask of shape (t,)."""
    order = np.argsort(-np.abs(shares), kind="stable")
    behind = np.cumsum(np.abs(shares)[order])
    chosen = np.zeros(len(shares), dtype=bool)
    chosen[order[: np.searchsorted(behind, part * behind[-1]) + 1]] = True
    return chosen


def _solve(problem: Problem, degree: int, tolerance: float) -> tuple[RefinementRound, FloatArray]:
    """One solution: its estimate, and every triangle's contribution to the functional's error, shape (t,)."""
    mesh, space = problem.mesh, LagrangeSpace(problem.mesh, degree)
    equilibrium = LinearEquilibrium.of(LinearElasticity.of(problem, space))
    nodal, estimator = equilibrium.solution(), ErrorEstimator(problem, space)
    error = estimator.estimate(nodal, equilibrium.response)
    functional = np.zeros_like(nodal)
    functional[mesh.marker_nodes] = np.sign(error.markers) * (np.abs(error.markers) > tolerance)
    shares = estimator.shares(nodal, equilibrium.response(functional))
    equilibrium.factors.destroy()
    found = RefinementRound(len(mesh.triangles), len(mesh.points), error.at_markers, error.energy_norm)
    return found, shares


def _done(rounds: list[RefinementRound], tolerance: float) -> float:
    """The fraction of the way from the first estimate to the tolerance, on a logarithmic scale."""
    first, now = rounds[0].at_markers, rounds[-1].at_markers
    return 1.0 if now <= tolerance else max(0.0, log(first / now) / log(first / tolerance))
