"""Solutions of problems that differ a little from one that is solved, to first order.

With a residual R(x, p) = 0 of the displacements and multipliers x, the implicit function theorem gives
dx/dp = -(dR/dx)⁻¹ dR/dp: one factorisation, and one back substitution for each parameter. dR/dp is the
central difference of the residual at a fixed x, to eight digits. Source: M. B. Giles, N. A. Pierce, Flow,
Turbulence and Combustion 65 (2000) 393-415, section 2.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from pinnray.runtime.arrays import FloatArray
from pinnray.runtime.errors import UserError
from pinnray.solvers.fem.boundary_conditions import reaction_by_residual_work
from pinnray.solvers.fem.equilibrium import DiscreteEquilibrium, LoadState
from pinnray.solvers.fem.finite_strain.nested_path import coarser
from pinnray.solvers.fem.finite_strain.solver import FemNonlinearSolver
from pinnray.solvers.fem.linear import FemSolver
from pinnray.solvers.lagrange import LagrangeField, LagrangeSpace
from pinnray.solvers.problem import Problem
from pinnray.solvers.solution import Solution, Status
from pinnray.solvers.solver import NoSolutionError, Progress, silent

ROUNDS, SETTLED = 60, 1e-6
"""Updates of a cylinder's multipliers at most, and their last change over the largest; each halves it."""

Pair = tuple[Problem, Problem]
"""Two problems that a parameter's step backward and forward make of one."""


class VariedProblem:
    """The equilibrium of a problem by `fem` or `fem-nonlinear`, as its law is, and of problems near it.

    Raises:
        UserError: If there is friction, which depends on the way, the body has several materials, or the load
            is a cylinder and the law linear.
        NoSolutionError: If the equilibrium under the full load is not found or not stable, or the derivatives
            of a cylinder's contact do not settle.
    """

    def __init__(self, problem: Problem, progress: Progress = silent, degree: int = 2) -> None:
        if problem.load.friction:
            raise UserError("derivatives are without friction, whose forces depend on the way to the load")
        if problem.load.kind == "cylinder" and problem.material.law == "linear":
            raise UserError("a cylinder needs a law of finite strain: set law = neo-hookean")
        if problem.mesh.moduli is not None:
            raise UserError("derivatives are of a body of one material")
        self._problem, self._degree = problem, degree
        self._equilibrium, self._state = _solved(problem, degree, progress)
        self._equilibrium.factorise(self._state)
        if self._equilibrium.unstable:
            raise NoSolutionError("the equilibrium is not stable, so that it has no derivatives; see solve")

    @property
    def solution(self) -> Solution:
        """Of the problem itself."""
        return self._solution(self._problem, self._state.nodal)

    def solutions(self, pairs: Sequence[Pair]) -> list[tuple[Solution, Solution]]:
        """The solutions, to first order, of each pair's problems."""
        found = []
        for pair, change in zip(pairs, self._changes(pairs), strict=True):
            low, high = (
                self._solution(each, self._state.nodal + sign * change)
                for each, sign in zip(pair, (-1, 1), strict=True)
            )
            found.append((low, high))
        return found

    def _changes(self, pairs: Sequence[Pair]) -> list[FloatArray]:
        """Changes of the displacements by each pair's step forward, (N, 2), mm."""
        equilibrium, state = self._equilibrium, self._state
        changes = [np.zeros_like(state.nodal)] * len(pairs)
        contacts = [np.zeros_like(state.contact)] * len(pairs)
        for _ in range(ROUNDS):  # without a cylinder there are no multipliers, and one is enough
            loads, gaps, held = [], [], []
            for pair, contact in zip(pairs, contacts, strict=True):
                ends = [
                    self._residual(each, replace(state, contact=state.contact + sign * contact))
                    for each, sign in zip(pair, (-1, 1), strict=True)
                ]
                residual, gap, given = (0.5 * (after - before) for before, after in zip(*ends, strict=True))
                loads.append(-residual)
                gaps.append(gap)
                held.append(given)
            free = equilibrium.factors.solve_all(np.array(loads))
            changes = [
                given + equilibrium.elimination.solution(each, gap)[0]
                for each, gap, given in zip(free, gaps, held, strict=True)
            ]
            before = contacts
            contacts = [self._contact_change(*each) for each in zip(pairs, changes, contacts, strict=True)]
            most = max((np.abs(each).max(initial=0.0) for each in contacts), default=0.0)
            if all(
                np.abs(new - old).max(initial=0.0) <= SETTLED * most
                for new, old in zip(contacts, before, strict=True)
            ):
                break
        else:
            raise NoSolutionError("the contact's derivatives do not settle; take a finer mesh")
        equilibrium.vary(self._problem)
        return changes

    def _residual(self, problem: Problem, state: LoadState) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Residual forces (N, 2), N/mm, and of the constraints (k,), mm; held displacements (N, 2), mm."""
        equilibrium = self._equilibrium
        equilibrium.vary(problem)
        held = np.where(equilibrium.clamped, equilibrium.prescribed, 0.0)
        state = replace(state, nodal=np.where(equilibrium.clamped, held, state.nodal))
        gaps = equilibrium.constraints.residual(state.nodal, state.forces, 1.0)
        return equilibrium.residual(state)[0], gaps, held

    def _contact_change(self, pair: Pair, change: FloatArray, contact: FloatArray) -> FloatArray:
        """Change of a cylinder's multipliers by a step forward, (m,), N/mm."""
        state, found = self._state, []
        for problem, sign in zip(pair, (-1, 1), strict=True):
            self._equilibrium.vary(problem)
            if (cylinder := self._equilibrium.contact) is None:
                return contact
            moved = replace(state, nodal=state.nodal + sign * change, contact=state.contact + sign * contact)
            found.append(cylinder.settled(moved)[0].contact)
        return np.asarray(0.5 * (found[1] - found[0]))

    def _solution(self, problem: Problem, nodal: FloatArray) -> Solution:
        space, equilibrium = LagrangeSpace(problem.mesh, self._degree), self._equilibrium
        equilibrium.vary(problem)
        return Solution(
            solver=FemSolver.name if equilibrium.linear else FemNonlinearSolver.name,
            problem=problem,
            field=LagrangeField(space, nodal),
            energy=equilibrium.energy(nodal),
            reaction=reaction_by_residual_work(space, equilibrium.internal_force(nodal)),
            status=Status(True, "to first order about a solution"),
            stats={},
        )

    def close(self) -> None:
        """Free the factors."""
        self._equilibrium.factors.destroy()


def _solved(problem: Problem, degree: int, progress: Progress) -> tuple[DiscreteEquilibrium, LoadState]:
    if problem.material.law == "linear":
        equilibrium = DiscreteEquilibrium(problem, LagrangeSpace(problem.mesh, degree))
        return equilibrium, equilibrium.linear_guess(1.0)
    solver = FemNonlinearSolver(degree=degree)
    path = solver.path(problem, LagrangeSpace(problem.mesh, degree))
    solver.followed(coarser(problem), path, progress)
    if path.points[-1].fraction < 1:
        raise NoSolutionError(path.phrase)
    return path.equilibrium, path.points[-1]
