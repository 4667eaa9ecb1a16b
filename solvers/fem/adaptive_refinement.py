"""Refinement of the shared mesh until the displacements of the markers by `fem` are within a tolerance.

Solve, estimate, mark, refine. The functional is the sum of the errors of all marker components that are not
within the tolerance; the fewest triangles that hold a given share of its dual-weighted error are marked.

Source: W. Dörfler, A convergent adaptive algorithm for Poisson's equation, SIAM J. Numer. Anal. 33 (1996)
1106-1124, section 4.2 (the share); R. Becker, R. Rannacher, Acta Numerica 10 (2001) 1-102, section 4.
"""

from dataclasses import dataclass, replace
from math import inf, log
from typing import NamedTuple

import numpy as np

from pinnray.geometry.mesh.refinement import refined
from pinnray.geometry.mesh.triangle_mesh import TriangleMesh
from pinnray.geometry.section.section import Section
from pinnray.runtime.arrays import BoolArray, FloatArray
from pinnray.runtime.errors import UserError
from pinnray.solvers.fem.error_estimate import ErrorEstimator
from pinnray.solvers.lagrange import LagrangeSpace
from pinnray.solvers.problem import Load, Problem
from pinnray.solvers.solver import Progress, silent


class RefinementRound(NamedTuple):
    """One mesh of the sequence."""

    triangles: int
    nodes: int
    at_markers: float  # Largest estimated error of u or v at a marker, mm
    energy_norm: float  # Estimated relative error in the energy norm


@dataclass(frozen=True, eq=False)
class Adaptation:
    """A refined mesh and the rounds that led to it."""

    tolerance: float  # Of u and v at the markers, mm
    rounds: tuple[RefinementRound, ...]  # From the first mesh to the refined one
    mesh: TriangleMesh  # The refined mesh

    @property
    def reached(self) -> bool:
        """True if the estimate is within the tolerance."""
        return self.rounds[-1].at_markers <= self.tolerance

    @property
    def message(self) -> str:
        """The outcome, in a sentence without its full stop."""
        first, last = self.rounds[0], self.rounds[-1]
        known, asked = f"the markers are known to {last.at_markers:.2g} mm", f"{self.tolerance:g} mm"
        if self.reached:
            became = f"{first.triangles} triangles became {last.triangles}"
            return f"{known} (asked for: {asked}); {became}"
        end = f"refinement stopped at {last.triangles} triangles; take a larger tolerance"
        return f"{known}, not to the {asked} asked for: {end}"


def check_adaptable(tolerance: float, load: Load) -> None:
    """Raise a `UserError` if the tolerance is no length, mm, or refinement cannot adapt to the load."""
    if not 0 < tolerance < inf:
        raise UserError(f"a tolerance of {tolerance:g} mm at the markers: give a length above 0 mm")
    if load.kind == "point":
        raise UserError("a point load has no limit under refinement to adapt a mesh to; take mean or patch")
    if load.kind not in ("mean", "patch"):
        raise UserError(
            f"the mesh is adapted by the estimate of fem, which has no load {load.kind}; take mean or patch"
        )


def adapted(
    problem: Problem,
    tolerance: float,
    *,
    degree: int = 2,
    section: Section | None = None,
    most_triangles: int = 200_000,
    most_rounds: int = 30,
    progress: Progress = silent,
) -> Adaptation:
    """Refine the mesh of a linear problem until u and v at its markers are within a tolerance, mm.

    The section is for the arcs of refined fillets. The progress is called after every round, which has one
    solution. A `UserError` refuses what `check_adaptable` does.
    """
    check_adaptable(tolerance, problem.load)
    rounds: list[RefinementRound] = []
    while True:
        found, shares = _solve(problem, degree, tolerance)
        mesh = problem.mesh
        rounds.append(found)
        # On a logarithmic scale from the first estimate to the tolerance
        first, now = rounds[0].at_markers, found.at_markers
        done = 1.0 if now <= tolerance else max(0.0, log(first / now) / log(first / tolerance))
        progress(done, f"{found.triangles} triangles, {now:.2g} mm at the markers")
        if now <= tolerance or len(rounds) == most_rounds:
            break
        finer = refined(mesh, largest(shares, 0.6), section)
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
    from pinnray.solvers.fem.equilibrium import DiscreteEquilibrium  # needs DOLFINx

    mesh, space = problem.mesh, LagrangeSpace(problem.mesh, degree)
    equilibrium = DiscreteEquilibrium(problem, space)
    nodal, estimator = equilibrium.linear_guess(1.0).nodal, ErrorEstimator(problem, space)
    error = estimator.estimate(nodal, equilibrium.response)
    functional = np.zeros_like(nodal)
    functional[mesh.marker_nodes] = np.sign(error.markers) * (np.abs(error.markers) > tolerance)
    shares = estimator.shares(nodal, equilibrium.response(functional))
    equilibrium.factors.destroy()
    found = RefinementRound(len(mesh.triangles), len(mesh.points), error.at_markers, error.energy_norm)
    return found, shares
