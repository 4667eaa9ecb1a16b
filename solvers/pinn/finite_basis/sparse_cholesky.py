"""Sparse symmetric systems of dense blocks, by MUMPS."""

from dataclasses import dataclass
from typing import Any
from weakref import finalize

import numpy as np

from pinnray.runtime.arrays import FloatArray, IntArray
from pinnray.runtime.errors import UserError
from pinnray.solvers.petsc import PETSc

PREFIX = "pinnray_network_"
LEAST_FILL = 2
"""MUMPS' ordering that eliminates first what fills least: a sixth less work than by its own choice."""
NEGATIVE_PIVOTS = 12
"""Number of MUMPS' output that counts them."""
SPARE_WORKSPACE = 14, 200
"""MUMPS' option for the workspace beyond its estimate, %: indefinite tangents delay many pivots."""


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
        stored.setOption(PETSc.Mat.Option.SYMMETRIC, True)
        stored.setOption(PETSc.Mat.Option.SPD, definite)
        preconditioner = PETSc.PC().create(PETSc.COMM_SELF)
        try:
            preconditioner.setOperators(stored)
            preconditioner.setType(PETSc.PC.Type.CHOLESKY)
            preconditioner.setFactorSolverType(PETSc.Mat.SolverType.MUMPS)
            preconditioner.setFactorSetUpSolverType()
            PETSc.Options(PREFIX)["mat_mumps_icntl_7"] = LEAST_FILL
            preconditioner.getFactorMatrix().setOptionsPrefix(PREFIX)
            preconditioner.getFactorMatrix().setMumpsIcntl(*SPARE_WORKSPACE)
            preconditioner.setUp()
            failed = preconditioner.getFactorMatrix().getMumpsInfog(1) < 0
        except PETSc.Error:
            failed = True
        stored.destroy()
        if failed:
            preconditioner.destroy()
            raise UserError("MUMPS cannot factorise the output layer; take fewer neurons")
        return Factors(scale.ravel(), preconditioner, regularisation)


@dataclass(frozen=True, eq=False)
class Factors:
    """Factors of a matrix in MUMPS, freed with this object: petsc4py would keep them for ever."""

    scale: FloatArray  # One over the roots of the diagonal, shape (n b,)
    preconditioner: Any  # PETSc's object that holds them
    regularisation: float  # That was added to the unit diagonal of the scaled matrix

    def __post_init__(self) -> None:
        finalize(self, self.preconditioner.destroy)

    def solve(self, right: FloatArray) -> FloatArray:
        """The solutions for right-hand sides, both of shape (r, n b)."""
        count, size = right.shape
        given, found = (PETSc.Mat().createDense((size, count), comm=PETSc.COMM_SELF) for _ in range(2))
        try:
            for dense in (given, found):
                dense.setUp()
            given.getDenseArray()[:] = (right * self.scale).T
            given.assemble()
            self.preconditioner.getFactorMatrix().matSolve(given, found)
            return np.asarray(found.getDenseArray().T * self.scale, dtype=np.float64)
        finally:
            given.destroy()
            found.destroy()

    @property
    def damping(self) -> FloatArray:
        """What the regularisation added to the diagonal of the matrix, shape (n b,)."""
        return self.regularisation / self.scale**2

    @property
    def negative(self) -> int:
        """Number of negative eigenvalues: that of negative pivots, by Sylvester's law of inertia."""
        return int(self.preconditioner.getFactorMatrix().getMumpsInfog(NEGATIVE_PIVOTS))

    def close(self) -> None:
        """Free the factors."""
        self.preconditioner.destroy()
