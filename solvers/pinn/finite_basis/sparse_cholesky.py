"""Sparse symmetric systems of dense blocks, by MUMPS."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from petsc4py import PETSc

from geometry.arrays import FloatArray, IntArray
from geometry.errors import UserError


@dataclass(frozen=True, eq=False)
class BlockMatrix:
    """The upper half of a symmetric matrix of n x n blocks of b x b numbers.

    Attributes:
        size: Blocks in a row, n.
        rows: Row of every block, ascending, shape (k,).
        columns: Its column, at least the row and ascending within it, shape (k,).
        blocks: Shape (k, b, b).
    """

    size: int
    rows: IntArray
    columns: IntArray
    blocks: FloatArray

    def diagonal(self) -> FloatArray:
        """The diagonal, shape (n, b)."""
        return np.diagonal(self.blocks[self.rows == self.columns], axis1=1, axis2=2)

    def solve(self, right: FloatArray, regularisation: float, *, definite: bool = True) -> FloatArray:
        """Solve for several right-hand sides with one factorisation, the diagonal scaled to one.

        Args:
            right: Right-hand sides, shape (r, n b).
            regularisation: Added to the unit diagonal.
            definite: Whether the matrix is known to be positive definite.

        Raises:
            UserError: If the factorisation fails.
        """
        diagonal = np.abs(self.diagonal())
        scale = 1 / np.sqrt(np.where(diagonal > 0, diagonal, 1.0))
        scaled = self.blocks * scale[self.rows, :, None] * scale[self.columns, None, :]
        scaled[self.rows == self.columns] += regularisation * np.eye(scaled.shape[-1])
        starts = np.searchsorted(self.rows, np.arange(self.size + 1))
        index: Any = PETSc.IntType
        stored = PETSc.Mat().createSBAIJ(
            (scale.size, scale.size),
            scaled.shape[-1],
            csr=(starts.astype(index), self.columns.astype(index), scaled.ravel()),
            comm=PETSc.COMM_SELF,
        )
        stored.setOption(PETSc.Mat.Option.SYMMETRIC, True)
        stored.setOption(PETSc.Mat.Option.SPD, definite)
        ksp = PETSc.KSP().create(PETSc.COMM_SELF)
        ksp.setOperators(stored)
        ksp.setType(PETSc.KSP.Type.PREONLY)
        preconditioner = ksp.getPC()
        preconditioner.setType(PETSc.PC.Type.CHOLESKY)
        preconditioner.setFactorSolverType(PETSc.Mat.SolverType.MUMPS)
        ksp.setErrorIfNotConverged(True)
        solution = np.empty_like(right)
        vector, result = stored.createVecs()
        try:
            for row, found in zip(right * scale.ravel(), solution, strict=True):
                vector.array[:] = row
                ksp.solve(vector, result)
                found[:] = result.array
        except PETSc.Error as error:
            raise UserError("MUMPS cannot factorise the output layer; take fewer neurons") from error
        finally:
            # petsc4py would keep the preconditioner, and the factors, for ever.
            for item in (vector, result, preconditioner, ksp, stored):
                item.destroy()
        return np.asarray(solution * scale.ravel(), dtype=np.float64)
