"""Sparse symmetric systems of dense blocks."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from pinnray.runtime.arrays import FloatArray, IntArray
from pinnray.runtime.errors import UserError
from pinnray.solvers.petsc import PETSc
from pinnray.solvers.symmetric_factors import FactorisationError, SymmetricFactors


@dataclass(frozen=True, eq=False)
class BlockMatrix:
    """The upper half of a symmetric matrix of n x n blocks of b x b numbers."""

    size: int  # Blocks in a row, n
    rows: IntArray  # Row of every block, ascending, shape (k,)
    columns: IntArray  # Its column, at least the row and ascending within it, shape (k,)
    blocks: FloatArray  # Shape (k, b, b)

    def diagonal(self) -> FloatArray:
        """The diagonal, shape (n, b)."""
        return np.diagonal(self.blocks[self.rows == self.columns], axis1=1, axis2=2)

    def factorised(self, regularisation: float, *, definite: bool = True) -> "Factors":
        """The factors of the matrix with its diagonal scaled to one, for any number of solves.

        Args:
            regularisation: Added to the unit diagonal.
            definite: Whether the matrix is known to be positive definite.

        Raises:
            UserError: If the factorisation fails.
        """
        diagonal = np.abs(self.diagonal())
        scale = 1 / np.sqrt(np.where(diagonal > 0, diagonal, 1.0))
        scaled = self.blocks * scale[self.rows, :, None]
        scaled *= scale[self.columns, None, :]
        scaled[self.rows == self.columns] += regularisation * np.eye(scaled.shape[-1])
        starts = np.searchsorted(self.rows, np.arange(self.size + 1))
        index: Any = PETSc.IntType
        stored = PETSc.Mat().createSBAIJ(
            (scale.size, scale.size),
            scaled.shape[-1],
            csr=(starts.astype(index), self.columns.astype(index), scaled.ravel()),
            comm=PETSc.COMM_SELF,
        )
        factors = SymmetricFactors(stored, definite=definite, roomy=True)
        try:
            factors.update()
        except FactorisationError:
            factors.destroy()
            raise UserError("MUMPS cannot factorise the output layer; take fewer neurons") from None
        return Factors(scale.ravel(), factors, regularisation)


@dataclass(frozen=True, eq=False)
class Factors:
    """Factors of a matrix with its diagonal scaled to one."""

    scale: FloatArray  # One over the roots of the diagonal, shape (n b,)
    scaled: SymmetricFactors
    regularisation: float  # That was added to the unit diagonal of the scaled matrix

    def solve(self, right: FloatArray) -> FloatArray:
        """The solutions for right-hand sides, both of shape (r, n b)."""
        return self.scaled.solve(right * self.scale) * self.scale

    @property
    def damping(self) -> FloatArray:
        """What the regularisation added to the diagonal of the matrix, shape (n b,)."""
        return self.regularisation / self.scale**2

    @property
    def negative(self) -> int:
        """Number of negative eigenvalues."""
        return self.scaled.negative

    def close(self) -> None:
        """Free the factors."""
        self.scaled.destroy()
