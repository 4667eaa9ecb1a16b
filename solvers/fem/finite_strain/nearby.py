"""Equilibria beside given displacements, on one set of elements, so that their energies can be compared."""

from collections.abc import Sequence
from dataclasses import dataclass

from geometry.arrays import FloatArray
from solvers.fem.finite_strain.load_path import LoadPath
from solvers.fem.finite_strain.solver import FemNonlinearSolver
from solvers.fem.ranks import on_all_ranks
from solvers.lagrange import LagrangeSpace
from solvers.problem import Problem
from solvers.solver import Progress, silent

ITERATIONS = 40
"""Newton iterations from a displacement that is off by some percent, whose first steps are short."""


@dataclass(frozen=True, eq=False)
class Equilibrium:
    """An equilibrium under the full load."""

    nodal: FloatArray  # Displacements of the nodes of a `LagrangeSpace` of degree 2, shape (N, 2), mm
    energy: float  # Elastic energy per depth, N mm / mm
    unstable: int  # Number of directions in which the energy falls


def equilibria_near(problem: Problem, starts: Sequence[FloatArray]) -> list[Equilibrium | None]:
    """The equilibrium to which Newton's method leads from each start; None where it leads nowhere.

    Args:
        problem: With a law of finite strain and a load without a cylinder.
        starts: Displacements of the nodes of a `LagrangeSpace` of degree 2, shape (N, 2), mm.
    """
    return on_all_ranks(_Search(tuple(starts)).run, problem, silent)


@dataclass(frozen=True, eq=False)
class _Search:
    starts: tuple[FloatArray, ...]

    def run(self, problem: Problem, progress: Progress) -> list[Equilibrium | None]:
        path = FemNonlinearSolver(max_iterations=ITERATIONS).path(problem, LagrangeSpace(problem.mesh, 2))
        found = [_near(path, start) for start in self.starts]
        path.close()
        return found


def _near(path: LoadPath, start: FloatArray) -> Equilibrium | None:
    state = path.settled_from(start)
    if state is None:
        return None
    path.equilibrium.factorise(state)
    return Equilibrium(state.nodal, path.equilibrium.energy(state.nodal), path.equilibrium.unstable or 0)
