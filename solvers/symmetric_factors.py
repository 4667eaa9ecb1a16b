"""Factors of sparse symmetric matrices, of single numbers or dense blocks, by MUMPS through PETSc."""

from dataclasses import dataclass
from typing import Any
from weakref import finalize

import numpy as np

from pinnray.runtime.arrays import FloatArray, IntArray
from pinnray.runtime.errors import UserError
from pinnray.solvers.petsc import PETSc

PREFIX = "pinnray_least_fill_"
"""Of PETSc's options for MUMPS' ordering that eliminates first what fills least: on plane meshes its analysis
is quicker than by its own choice (in all 2.5 s in place of 5.5 s at 717,000 unknowns), and a network's blocks
take a sixth less."""
SPARE_WORKSPACE = 14, 200
"""MUMPS' option for the workspace beyond its estimate, %: indefinite tangents delay many pivots."""
NEGATIVE_PIVOTS = 12
"""Number of MUMPS' output that counts them."""


class FactorisationError(Exception):
    """MUMPS cannot factorise a matrix."""


class SymmetricFactors:
    """A symmetric matrix, factorised, for any number of right-hand sides.

    PETSc's objects are freed with this one at the latest: petsc4py would keep them for ever.

    Args:
        matrix: Of PETSc, of this process alone; it may get new values in its old places before an `update`.
        definite: Whether it is known to be positive definite.
        least_fill: Whether MUMPS orders by least fill, see `PREFIX`, not by its own choice.
        roomy: Whether MUMPS gets `SPARE_WORKSPACE`.
    """

    def __init__(
        self, matrix: PETSc.Mat, *, definite: bool, least_fill: bool = True, roomy: bool = False
    ) -> None:
        self._matrix, self._preconditioner = matrix, PETSc.PC().create(PETSc.COMM_SELF)
        for item in (self._preconditioner, matrix):
            finalize(self, item.destroy)
        matrix.setOption(PETSc.Mat.Option.SYMMETRIC, True)
        matrix.setOption(PETSc.Mat.Option.SPD, definite)
        self._preconditioner.setOperators(matrix)
        self._preconditioner.setType(PETSc.PC.Type.CHOLESKY)
        self._preconditioner.setFactorSolverType(PETSc.Mat.SolverType.MUMPS)
        self._preconditioner.setFactorSetUpSolverType()
        factors = self._preconditioner.getFactorMatrix()
        if least_fill:
            PETSc.Options(PREFIX)["mat_mumps_icntl_7"] = 2
            factors.setOptionsPrefix(PREFIX)
        if roomy:
            factors.setMumpsIcntl(*SPARE_WORKSPACE)

    def update(self) -> None:
        """Factorise the matrix as it is now; a `FactorisationError` says that MUMPS cannot."""
        try:
            self._preconditioner.setOperators(self._matrix)
            self._preconditioner.setUp()
        except PETSc.Error as error:
            raise FactorisationError from error
        if self.output(1) < 0:
            raise FactorisationError

    def output(self, number: int) -> int:
        """MUMPS' global output of a number, INFOG in its guide."""
        return int(self._preconditioner.getFactorMatrix().getMumpsInfog(number))

    @property
    def negative(self) -> int:
        """Number of negative eigenvalues: that of negative pivots, by Sylvester's law of inertia."""
        return self.output(NEGATIVE_PIVOTS)

    def solve(self, right: FloatArray) -> FloatArray:
        """The solutions for right-hand sides, both of shape (r, n)."""
        count, size = right.shape
        given, found = (PETSc.Mat().createDense((size, count), comm=PETSc.COMM_SELF) for _ in range(2))
        try:
            for dense in (given, found):
                dense.setUp()
            given.getDenseArray()[:] = right.T
            given.assemble()
            self._preconditioner.getFactorMatrix().matSolve(given, found)
            return np.array(found.getDenseArray().T, order="C")
        finally:
            given.destroy()
            found.destroy()

    def destroy(self) -> None:
        """Free the factors and the matrix."""
        self._preconditioner.destroy()
        self._matrix.destroy()


@dataclass(frozen=True, eq=False)
class BlockMatrix:
    """The upper half of a symmetric matrix of n x n blocks of b x b numbers."""

    size: int  # Blocks in a row, n
    rows: IntArray  # Row of every block, ascending, shape (k,)
    columns: IntArray  # Its column, at least the row and ascending within it, shape (k,)
    blocks: FloatArray  # Shape (k, b, b)

    def factorised(self, regularisation: float, *, definite: bool = True) -> "Factors":
        """The factors of the matrix with its diagonal scaled to one, for any number of solves.

        Args:
            regularisation: Added to the unit diagonal.
            definite: Whether the matrix is known to be positive definite.

        Raises:
            UserError: If the factorisation fails.
        """
        diagonal = np.abs(np.diagonal(self.blocks[self.rows == self.columns], axis1=1, axis2=2))
        scale = 1 / np.sqrt(np.where(diagonal > 0, diagonal, 1.0))
        scaled = self.blocks * scale[self.rows, :, None]
        scaled *= scale[self.columns, None, :]
        scaled[self.rows == self.columns] += regularisation * np.eye(scaled.shape[-1])
        starts = np.searchsorted(self.rows, np.arange(self.size + 1))
        index: Any = PETSc.IntType
        csr = starts.astype(index), self.columns.astype(index), scaled.ravel()
        stored = PETSc.Mat().createSBAIJ((scale.size,) * 2, scaled.shape[-1], csr=csr, comm=PETSc.COMM_SELF)
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
