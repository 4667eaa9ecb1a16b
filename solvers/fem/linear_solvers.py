"""Solutions of the stiffness: factors by MUMPS, or multigrid for large matrices in little memory."""

from typing import Any, ClassVar

import numpy as np
from petsc4py import PETSc

from geometry.arrays import BoolArray, FloatArray
from geometry.errors import UserError
from solvers.fem.dolfinx_compat import DistributedSpace

TOLERANCE = 1e-10
"""Residual force over the right-hand side at which the iteration ends."""

MAX_ITERATIONS = 1000


class StiffnessSolver:
    """A symmetric matrix and its solver in PETSc, for any number of right-hand sides.

    Args:
        space: The space of right-hand sides and solutions.
        matrix: The assembled matrix.
        clamped: Mask of shape (N, d): components whose right-hand side is set to zero.
    """

    def __init__(self, space: DistributedSpace[Any], matrix: PETSc.Mat, clamped: BoolArray) -> None:
        self._space, self._matrix, self._clamped = space, matrix, clamped
        self._ksp = PETSc.KSP().create(space.comm)
        self._ksp.setOperators(matrix)

    def solve(self, nodal: FloatArray) -> FloatArray:
        """Solve for a right-hand side of shape (N, d); the solution has the same shape."""
        right, solution = self._matrix.createVecs()
        self._space.distribute(np.where(self._clamped, 0.0, nodal), right)
        self._ksp.solve(right, solution)
        values = self._space.gather(solution)
        right.destroy()
        solution.destroy()
        return values

    def destroy(self) -> None:
        """Free the factors or the preconditioner, and the matrix."""
        self._ksp.destroy()
        self._matrix.destroy()


class Factorisation(StiffnessSolver):
    """A symmetric matrix factorised by MUMPS.

    Args:
        positive_definite: False where a tangent may be indefinite. The others are those of `StiffnessSolver`.

    Attributes:
        message: The method in words.
        stats: The same for a table.
    """

    message: ClassVar[str] = "solved directly"
    stats: ClassVar[dict[str, float | int | str]] = {"linear_solver": "direct"}

    def __init__(
        self, space: DistributedSpace[Any], matrix: PETSc.Mat, clamped: BoolArray, *, positive_definite: bool
    ) -> None:
        super().__init__(space, matrix, clamped)
        matrix.setOption(PETSc.Mat.Option.SYMMETRIC, True)
        matrix.setOption(PETSc.Mat.Option.SPD, positive_definite)
        self._ksp.setType(PETSc.KSP.Type.PREONLY)
        preconditioner = self._ksp.getPC()
        preconditioner.setType(PETSc.PC.Type.CHOLESKY)
        preconditioner.setFactorSolverType(PETSc.Mat.SolverType.MUMPS)
        preconditioner.destroy()  # the name only: petsc4py would keep it, and the factors, for ever
        self._ksp.setErrorIfNotConverged(True)
        self.update()

    def update(self) -> None:
        """Factorise again after the matrix has got new values in its old places: the analysis is kept."""
        self._ksp.setOperators(self._matrix)
        try:
            self._ksp.setUp()
        except PETSc.Error as error:
            raise UserError(
                "MUMPS cannot factorise the stiffness matrix: "
                "is there enough memory, and is no element nearly flat?"
            ) from error

    def solve_all(self, nodal: FloatArray) -> FloatArray:
        """Solve for several right-hand sides at once, shape (r, N, d); the solutions have the same shape."""
        if self._space.comm.size > 1 or not len(nodal):
            return np.array([self.solve(each) for each in nodal]).reshape(nodal.shape)
        right = PETSc.Mat().createDense((nodal[0].size, len(nodal)), comm=self._space.comm)
        right.setUp()
        held, _ = self._matrix.createVecs()
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
        return found


class Multigrid(StiffnessSolver):
    """A symmetric positive definite stiffness, solved by conjugate gradients.

    The preconditioner is PETSc's smoothed aggregation (GAMG). Its aggregates carry the rigid motions of the
    plane, translations and rotation, which have no energy in the unclamped body (Vanek, Mandel, Brezina 1996,
    Computing 56, 179-196).
    """

    def __init__(self, space: DistributedSpace[Any], matrix: PETSc.Mat, clamped: BoolArray) -> None:
        super().__init__(space, matrix, clamped)
        self._iterations: list[int] = []
        positions = matrix.createVecRight()
        space.distribute(space.space.nodes, positions)
        matrix.setOption(PETSc.Mat.Option.SPD, True)
        matrix.setNearNullSpace(PETSc.NullSpace().createRigidBody(positions))
        positions.destroy()
        self._ksp.setType(PETSc.KSP.Type.CG)
        self._ksp.setNormType(PETSc.KSP.NormType.UNPRECONDITIONED)
        self._ksp.setTolerances(rtol=TOLERANCE, max_it=MAX_ITERATIONS)
        preconditioner = self._ksp.getPC()
        preconditioner.setType(PETSc.PC.Type.GAMG)
        preconditioner.destroy()  # the name only
        self._ksp.setUp()

    @property
    def message(self) -> str:
        """The method in words."""
        return (
            f"solved by {max(self._iterations, default=0)} conjugate-gradient iterations to a residual of "
            f"{TOLERANCE:g} of the load"
        )

    @property
    def stats(self) -> dict[str, float | int | str]:
        """The method for a table; `iterations` is the sum over all right-hand sides so far."""
        return {"linear_solver": "iterative", "iterations": sum(self._iterations)}

    def solve(self, nodal: FloatArray) -> FloatArray:
        """Solve for a right-hand side of shape (N, d); the solution has the same shape.

        Raises:
            UserError: If the iteration does not converge.
        """
        values = super().solve(nodal)
        self._iterations.append(self._ksp.getIterationNumber())
        if self._ksp.getConvergedReason() <= 0:
            size = float(np.linalg.norm(nodal[~self._clamped])) or 1.0
            raise UserError(
                f"conjugate gradients have not converged: after {self._iterations[-1]} iterations the "
                f"residual is {self._ksp.getResidualNorm() / size:.1e} of the load, not {TOLERANCE:g}; "
                "take linear_solver=direct, or a mesh without flat triangles"
            )
        return values
