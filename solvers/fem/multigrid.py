"""Conjugate gradients with algebraic multigrid: large stiffness matrices in little memory."""

import numpy as np
from petsc4py import PETSc

from geometry.arrays import BoolArray, FloatArray
from geometry.errors import UserError
from solvers.fem.dolfinx_compat import DistributedSpace

TOLERANCE = 1e-10
"""Residual force over the right-hand side at which the iteration ends."""

MAX_ITERATIONS = 1000


class Multigrid:
    """A symmetric positive definite stiffness, solved by conjugate gradients for any right-hand side.

    The preconditioner is PETSc's smoothed aggregation (GAMG). Its aggregates carry the rigid motions of the
    plane, translations and rotation, which have no energy in the unclamped body (Vanek, Mandel, Brezina 1996,
    Computing 56, 179-196).

    Args:
        space: The space of right-hand sides and solutions.
        matrix: The assembled matrix.
        clamped: Mask of shape (N, 2): components whose right-hand side is set to zero.
    """

    def __init__(self, space: DistributedSpace, matrix: PETSc.Mat, clamped: BoolArray) -> None:
        self._space = space
        self._matrix = matrix
        self._clamped = clamped
        self._iterations: list[int] = []
        positions = matrix.createVecRight()
        space.distribute(space.space.nodes, positions)
        matrix.setOption(PETSc.Mat.Option.SPD, True)
        matrix.setNearNullSpace(PETSc.NullSpace().createRigidBody(positions))
        positions.destroy()
        self._ksp = PETSc.KSP().create(space.comm)
        self._ksp.setOperators(matrix)
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
        """Solve for a right-hand side of shape (N, 2); the solution has the same shape.

        Raises:
            UserError: If the iteration does not converge.
        """
        right, solution = self._matrix.createVecs()
        self._space.distribute(np.where(self._clamped, 0.0, nodal), right)
        size = right.norm()
        self._ksp.solve(right, solution)
        self._iterations.append(self._ksp.getIterationNumber())
        residual = self._ksp.getResidualNorm() / size if size else 0.0
        values = self._space.gather(solution)
        right.destroy()
        solution.destroy()
        if self._ksp.getConvergedReason() <= 0:
            raise UserError(
                f"conjugate gradients have not converged: after {self._iterations[-1]} iterations the "
                f"residual is {residual:.1e} of the load, not {TOLERANCE:g}; take linear_solver=direct, "
                "or a mesh without flat triangles"
            )
        return values

    def destroy(self) -> None:
        """Free the preconditioner and the matrix."""
        self._ksp.destroy()
        self._matrix.destroy()
