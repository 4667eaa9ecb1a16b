"""Newton's method with line search by PETSc's SNES, for displacements and multipliers together."""

from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from pinnray.runtime.arrays import FloatArray
from pinnray.solvers.fem.equilibrium import DiscreteEquilibrium, LoadState
from pinnray.solvers.petsc import PETSc


class NewtonResult(NamedTuple):
    """The end of a Newton iteration."""

    state: LoadState
    converged: bool  # Whether the state is in equilibrium
    reason: str  # PETSc's word for the end, in lower case
    iterations: int  # Newton steps taken
    tangent: bool  # Whether the tangent factorised last is as good as that of the state


TANGENT = 1e-3
"""Largest residual, over the largest internal force, where a tangent stands for that of equilibrium."""


class ConstrainedNewton:
    """SNES on the unknowns [c; f] of a `DiscreteEquilibrium`.

        R(c, f) = [dΠ/dc - f_k b_k;  s (d_k - b_k . c - s_k f_k)]      J = [K, -b;  -s b^T, -s diag(s_k)]

    The factor s, Young's modulus, makes forces of the constraints. `ConstrainedElimination` solves J y = R.
    A step that would turn an element inside out is halved before the line search. Near equilibrium every
    second step takes the tangent of the one before, which saves a factorisation at the end of most solves.

    The iteration ends where R is below `tolerance` times the largest internal force.
    """

    def __init__(self, equilibrium: DiscreteEquilibrium, tolerance: float, max_iterations: int) -> None:
        self._equilibrium, self._tolerance = equilibrium, tolerance
        self._scale, self._state = equilibrium.problem.material.young, equilibrium.rest
        self._size = self._off = 0.0
        self._torn = self._near = self._kept = self._tangent = False
        self._part = equilibrium.matrix.createVecRight()
        self._own = equilibrium.clamped.size
        size = self._own + len(equilibrium.constraints.targets)
        self._unknown = PETSc.Vec().createSeq(size)
        self._residual = self._unknown.duplicate()
        self._jacobian = PETSc.Mat().createPython((size, size), context=self, comm=PETSc.COMM_SELF)
        self._jacobian.setUp()
        self._snes = PETSc.SNES().create(PETSc.COMM_SELF)
        self._snes.setFunction(self._evaluate, self._residual)
        self._snes.setJacobian(self._factorise, self._jacobian)
        self._snes.setLineSearchPreCheck(self._shorten)
        self._snes.setConvergenceTest(self._ended)
        self._snes.setTolerances(max_it=max_iterations)
        linear = self._snes.getKSP()
        linear.setType(PETSc.KSP.Type.PREONLY)
        elimination = linear.getPC()
        elimination.setType(PETSc.PC.Type.PYTHON)
        elimination.setPythonContext(self)
        elimination.destroy()  # the names only: petsc4py would keep them for ever
        linear.destroy()

    def close(self) -> None:
        """Free what PETSc holds."""
        for item in (self._snes, self._jacobian, self._residual, self._unknown, self._part):
            item.destroy()

    def solve(self, guess: LoadState) -> NewtonResult:
        """Find equilibrium at the guess's fraction of the load and multipliers of the contact."""
        contact = self._equilibrium.contact
        self._state = guess if contact is None else contact.holding(guess)
        self._torn = not self._equilibrium.admissible(guess.nodal)
        self._kept = self._tangent = False
        if self._torn:
            return NewtonResult(guess, False, "diverged_function_domain", 0, False)
        self._join(guess.nodal, guess.forces, self._unknown)
        self._snes.solve(None, self._unknown)
        reason = self._snes.getConvergedReason()
        words = {value: name for name, value in vars(PETSc.SNES.ConvergedReason).items() if name[0] != "_"}
        word = "diverged_function_domain" if self._torn else words[reason].lower()
        iterations = self._snes.getIterationNumber()
        return NewtonResult(self._at(self._unknown), reason > 0, word, iterations, self._tangent)

    def apply(self, preconditioner: PETSc.PC, right: PETSc.Vec, step: PETSc.Vec) -> None:
        """J^-1, as PETSc calls it."""
        balance, missed = self._split(right)
        nodal = self._equilibrium.factors.solve(balance)
        self._join(*self._equilibrium.elimination.solution(nodal, -missed / self._scale), step)

    def mult(self, matrix: PETSc.Mat, step: PETSc.Vec, product: PETSc.Vec) -> None:
        """J times a step, as the line search calls it."""
        nodal, forces = self._split(step)
        elements, constraints = self._equilibrium.elements, self._equilibrium.constraints
        self._part.array[:] = elements.dofs(nodal)
        force = self._part.duplicate()
        self._equilibrium.matrix.mult(self._part, force)
        balance = elements.nodal(force.array_r) - constraints.at_nodes(forces)
        force.destroy()
        missed = self._scale * constraints.residual(nodal, forces, 0.0)
        self._join(np.where(self._equilibrium.clamped, 0.0, balance), missed, product)

    def _evaluate(self, snes: PETSc.SNES, unknown: PETSc.Vec, residual: PETSc.Vec) -> None:
        state = self._at(unknown)
        balance, self._size = self._equilibrium.residual(state)
        missed = self._equilibrium.constraints.residual(state.nodal, state.forces, state.fraction)
        self._join(balance, self._scale * missed, residual)

    def _factorise(self, snes: PETSc.SNES, unknown: PETSc.Vec, jacobian: PETSc.Mat, other: PETSc.Mat) -> None:
        self._kept = self._near and not self._kept
        if not self._kept:
            self._equilibrium.factorise(self._at(unknown))
            self._tangent = self._off <= TANGENT

    def _shorten(self, unknown: PETSc.Vec, step: PETSc.Vec) -> bool:
        """Halve the step, which will be subtracted, until no element is turned inside out; let nodes go."""
        self._state = replace(self._state, held=False)
        start, _ = self._split(unknown)
        down, _ = self._split(step)
        length, shortest = 1.0, 2.0**-10
        while not self._equilibrium.admissible(start - length * down) and length >= shortest:
            length /= 2
        self._torn = length < shortest
        step.scale(length)
        return length < 1

    def _ended(self, snes: PETSc.SNES, iteration: int, norms: Any) -> int:
        reasons = PETSc.SNES.ConvergedReason
        if self._torn:
            return int(reasons.DIVERGED_FUNCTION_DOMAIN)
        residual = snes.getFunction()[0].norm(PETSc.NormType.INFINITY)
        if not np.isfinite(residual):
            return int(reasons.DIVERGED_FNORM_NAN)
        size = max(self._size, 1e-4 * self._scale)  # rounding of positions makes forces, too
        self._off = residual / size
        self._near = iteration > 0 and self._off <= 1e-5
        if self._off <= self._tolerance and not self._state.held:
            return int(reasons.CONVERGED_FNORM_RELATIVE)
        return int(reasons.CONVERGED_ITERATING)

    def _at(self, unknown: PETSc.Vec) -> LoadState:
        nodal, forces = self._split(unknown)
        return replace(self._state, nodal=nodal, forces=forces)

    def _split(self, unknown: PETSc.Vec) -> tuple[FloatArray, FloatArray]:
        """Displacements, shape (N, 2), and multipliers, shape (k,)."""
        values = unknown.array_r
        return self._equilibrium.elements.nodal(values[: self._own]), values[self._own :].copy()

    def _join(self, nodal: FloatArray, forces: FloatArray, unknown: PETSc.Vec) -> None:
        unknown.array[: self._own] = self._equilibrium.elements.dofs(nodal)
        unknown.array[self._own :] = forces
