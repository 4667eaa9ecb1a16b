"""Solutions of the stiffness: factors by MUMPS, or multigrid for large matrices in little memory."""

from typing import Any, ClassVar, Literal
from weakref import finalize

import numpy as np

from pinnray.runtime.arrays import BoolArray, FloatArray
from pinnray.runtime.errors import UserError
from pinnray.solvers.fem.dolfinx_compat import DistributedSpace
from pinnray.solvers.petsc import PETSc

LinearSolver = Literal["auto", "direct", "iterative"]

MAX_ITERATIONS = 1000

LARGEST_RESIDUAL = 1e-3
"""Residual force of a direct solution over its right-hand side above which rounding has spoilt it.

It is 1e-10 for the default finger, and 1e-3 at Poisson's ratio 0.49999999, where the energy still has seven
right digits; at 0.1 it has four, at 2 none.
"""


class StiffnessSolver:
    """A symmetric matrix and its solver in PETSc, for any number of right-hand sides.

    A mask `clamped`, shape (N, d), says which components of the right-hand sides are set to zero. On one rank
    PETSc's objects are freed with this one at the latest: petsc4py would keep them for ever. On several ranks
    all have to call `destroy` at once.
    """

    def __init__(self, space: DistributedSpace[Any], matrix: PETSc.Mat, clamped: BoolArray) -> None:
        self._space, self.matrix, self._clamped = space, matrix, clamped
        self._ksp = PETSc.KSP().create(space.comm)
        self._ksp.setOperators(matrix)
        self._free_with_this(self._ksp, matrix)

    def _free_with_this(self, *items: PETSc.Object) -> None:
        if self._space.comm.size == 1:
            for item in items:
                finalize(self, item.destroy)

    def solve(self, nodal: FloatArray) -> FloatArray:
        """Solve for a right-hand side of shape (N, d); the solution has the same shape."""
        right, solution = self.matrix.createVecs()
        self._space.distribute(np.where(self._clamped, 0.0, nodal), right)
        self._ksp.solve(right, solution)
        values = self._space.gather(solution)
        right.destroy()
        solution.destroy()
        return values

    def solve_all(self, nodal: FloatArray) -> FloatArray:
        """Solve for several right-hand sides, shape (r, N, d); the solutions have the same shape."""
        return np.array([self.solve(each) for each in nodal]).reshape(nodal.shape)

    def destroy(self) -> None:
        """Free the factors or the preconditioner, and the matrix."""
        self._ksp.destroy()
        self.matrix.destroy()


class Factorisation(StiffnessSolver):
    """A symmetric matrix factorised by MUMPS.

    Solutions are checked if the matrix is `positive_definite`. A tangent that may be indefinite only gives
    steps of an iteration.
    """

    message: ClassVar[str] = "solved directly"
    stats: ClassVar[dict[str, float | int | str]] = {"linear_solver": "direct"}

    def __init__(
        self, space: DistributedSpace[Any], matrix: PETSc.Mat, clamped: BoolArray, *, positive_definite: bool
    ) -> None:
        super().__init__(space, matrix, clamped)
        self._checked = positive_definite
        matrix.setOption(PETSc.Mat.Option.SYMMETRIC, True)
        matrix.setOption(PETSc.Mat.Option.SPD, positive_definite)
        self._ksp.setType(PETSc.KSP.Type.PREONLY)
        # By options alone: MUMPS, once made, no longer reads any.
        prefix = f"pinnray_{space.dimension}d_{'stiffness' if positive_definite else 'tangent'}_"
        self._ksp.setOptionsPrefix(prefix)
        if space.dimension == 2:
            # Eliminate in the order of approximate minimum fill, whose analysis of plane meshes is quicker:
            # in all 2.5 s in place of 5.5 s at 717,000 unknowns, with 7 % more entries.
            PETSc.Options(prefix)["mat_mumps_icntl_7"] = 2
        if not positive_definite:  # the end on one process: on several, pivots would not be counted
            PETSc.Options(prefix)["mat_mumps_icntl_13"] = 1
        preconditioner = self._ksp.getPC()
        preconditioner.setType(PETSc.PC.Type.CHOLESKY)
        preconditioner.setFactorSolverType(PETSc.Mat.SolverType.MUMPS)
        preconditioner.destroy()  # the name only: petsc4py would keep it, and the factors, for ever
        self._ksp.setErrorIfNotConverged(True)
        self._factorised = False  # At first use: an equilibrium that is carried here has no need of the rest

    def _ready(self) -> None:
        """Factorise the matrix that was given, unless it is done."""
        if not self._factorised:
            self.update()

    def update(self, nodal: FloatArray | None = None) -> None:
        """Factorise again after the matrix has got new values in its old places; needs no displacements."""
        self._ksp.setOperators(self.matrix)
        try:
            self._ksp.setUp()
        except PETSc.Error as error:
            raise UserError(
                "MUMPS cannot factorise the stiffness matrix: "
                "is there enough memory, and is no element nearly flat?"
            ) from error
        self._factorised = True

    @property
    def negative(self) -> int:
        """Number of negative eigenvalues: of the negative pivots, by Sylvester's law of inertia."""
        return self.output(12)

    def output(self, number: int) -> int:
        """MUMPS' global output of a number, INFOG in its guide."""
        self._ready()
        preconditioner = self._ksp.getPC()
        factors = preconditioner.getFactorMatrix()
        found = int(factors.getMumpsInfog(number))
        for item in (factors, preconditioner):
            item.destroy()  # petsc4py would keep the factors for ever
        return found

    def solve(self, nodal: FloatArray) -> FloatArray:
        """See `StiffnessSolver`; a `UserError` says that rounding has spoilt the solution."""
        self._ready()
        values = super().solve(nodal)
        self._check(nodal, values)
        return values

    def _check(self, nodal: FloatArray, values: FloatArray) -> None:
        """Raise a `UserError` if a solution, shape (N, d), leaves too much of its right-hand side."""
        if not self._checked:
            return
        given, product = self.matrix.createVecs()
        self._space.distribute(values, given)
        self.matrix.mult(given, product)
        right: FloatArray = np.where(self._clamped, 0.0, nodal)
        left, size = np.linalg.norm(self._space.gather(product) - right), np.linalg.norm(right)
        for item in (given, product):
            item.destroy()
        if not left <= LARGEST_RESIDUAL * size:  # nor if it is NaN
            raise UserError(
                f"rounding has spoilt the solution of the stiffness: a residual of {left / size:.1g} of the "
                f"load is left, not {LARGEST_RESIDUAL:g}; take Poisson's ratio farther from 0.5, or a mesh "
                "without flat triangles"
            )

    def solve_all(self, nodal: FloatArray) -> FloatArray:
        """Solve for several right-hand sides at once; see `solve`."""
        if self._space.comm.size > 1 or not len(nodal):
            return super().solve_all(nodal)
        self._ready()
        right = PETSc.Mat().createDense((nodal[0].size, len(nodal)), comm=self._space.comm)
        right.setUp()
        held = self.matrix.createVecRight()
        columns = right.getDenseArray()
        for column, each in zip(columns.T, nodal, strict=True):
            self._space.distribute(np.where(self._clamped, 0.0, each), held)
            column[:] = held.array_r
        del columns
        right.assemble()
        solution = right.duplicate()
        preconditioner = self._ksp.getPC()
        factors = preconditioner.getFactorMatrix()
        factors.matSolve(right, solution)
        found = np.empty_like(nodal)
        for column, each in zip(solution.getDenseArray().T, found, strict=True):
            held.array[:] = column
            each[:] = self._space.gather(held)
        for item in (right, solution, held, factors, preconditioner):
            item.destroy()  # petsc4py would keep the factors for ever
        for each, values in zip(nodal, found, strict=True):
            self._check(each, values)
        return found


class Multigrid(StiffnessSolver):
    """A symmetric stiffness, solved by conjugate gradients, or by MINRES where a tangent is indefinite.

    The preconditioner is PETSc's smoothed aggregation (GAMG). Its aggregates carry the rigid motions, which
    have no energy in the unclamped body (Vanek, Mandel, Brezina 1996, Computing 56, 179-196).

    Args:
        tolerance: Residual force over the right-hand side at which the iteration ends; for MINRES both are
            preconditioned.
        tangent: Whether the matrix will change. Its first values, which must be definite, are kept and
            precondition indefinite ones.
    """

    def __init__(
        self,
        space: DistributedSpace[Any],
        matrix: PETSc.Mat,
        clamped: BoolArray,
        *,
        tolerance: float = 1e-10,
        tangent: bool = False,
    ) -> None:
        super().__init__(space, matrix, clamped)
        self._iterations: list[int] = []
        self._tolerance = tolerance
        matrix.setOption(PETSc.Mat.Option.SPD, True)
        self._first = matrix.copy() if tangent else None
        if self._first is not None:
            self._free_with_this(self._first)
        self._ksp.setTolerances(rtol=tolerance, max_it=MAX_ITERATIONS)
        preconditioner = self._ksp.getPC()
        preconditioner.setType(PETSc.PC.Type.GAMG)
        if space.dimension == 3:
            # Weakest coupling within an aggregate, as layers are thicker than elements are wide: 134
            # iterations in place of 176 on 235,000 unknowns.
            self._ksp.setOptionsPrefix("pinnray_multigrid_")
            PETSc.Options("pinnray_multigrid_")["pc_gamg_threshold"] = 0.01
            preconditioner.setFromOptions()
        preconditioner.destroy()  # the name only
        self.update()

    def update(self, nodal: FloatArray | None = None) -> None:
        """Renew the preconditioner after the matrix has become the tangent at displacements (N, d), mm."""
        self._precondition_by(self.matrix, nodal)
        self._ksp.setType(PETSc.KSP.Type.CG)
        self._ksp.setNormType(PETSc.KSP.NormType.UNPRECONDITIONED)
        self._ksp.setUp()

    def _precondition_by(self, matrix: PETSc.Mat, nodal: FloatArray | None = None) -> None:
        nodes = self._space.space.nodes
        positions = matrix.createVecRight()
        self._space.distribute(nodes if nodal is None else nodes + nodal, positions)
        motions = PETSc.NullSpace().createRigidBody(positions)
        matrix.setNearNullSpace(motions)
        for item in (motions, positions):
            item.destroy()  # the names only
        self._ksp.setOperators(self.matrix, matrix)

    def destroy(self) -> None:
        """Free the preconditioner and the matrices."""
        super().destroy()
        if self._first is not None:
            self._first.destroy()

    @property
    def message(self) -> str:
        """The method in words."""
        return (
            f"solved by {max(self._iterations, default=0)} conjugate-gradient iterations to a residual of "
            f"{self._tolerance:g} of the load"
        )

    @property
    def stats(self) -> dict[str, float | int | str]:
        """The method for a table; `iterations` is the sum over all right-hand sides so far."""
        return {"linear_solver": "iterative", "iterations": sum(self._iterations)}

    def solve(self, nodal: FloatArray) -> FloatArray:
        """See `StiffnessSolver`; a `UserError` says that the iteration does not converge."""
        reasons = PETSc.KSP.ConvergedReason
        indefinite = reasons.DIVERGED_INDEFINITE_MAT, reasons.DIVERGED_INDEFINITE_PC
        values = super().solve(nodal)
        if self._ksp.getConvergedReason() in indefinite and self._first is not None:
            self._precondition_by(self._first)
            self._ksp.setType(PETSc.KSP.Type.MINRES)
            self._ksp.setNormType(PETSc.KSP.NormType.PRECONDITIONED)
            values = super().solve(nodal)
        self._iterations.append(self._ksp.getIterationNumber())
        if self._ksp.getConvergedReason() <= 0:
            size = float(np.linalg.norm(nodal[~self._clamped])) or 1.0
            raise UserError(
                f"the linear iteration has not converged: after {self._iterations[-1]} iterations the "
                f"residual is {self._ksp.getResidualNorm() / size:.1e} of the load, not {self._tolerance:g}; "
                "take linear_solver=direct, or a mesh without flat triangles"
            )
        return values
