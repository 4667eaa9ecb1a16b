"""A stiffness or tangent of finite elements, factorised, for nodal right-hand sides."""

from typing import Any

import numpy as np

from pinnray.runtime.arrays import BoolArray, FloatArray
from pinnray.runtime.errors import UserError
from pinnray.solvers.fem.dolfinx_compat import DolfinxSpace
from pinnray.solvers.petsc import PETSc
from pinnray.solvers.symmetric_factors import FactorisationError, SymmetricFactors

LARGEST_RESIDUAL = 1e-3
"""Residual force of a solution over its right-hand side above which rounding has spoilt it.

It is 1e-10 for the default finger, and 1e-3 at Poisson's ratio 0.49999999, where the energy still has seven
right digits; at 0.1 it has four, at 2 none.
"""


class Factorisation:
    """A symmetric matrix that is factorised when it is first solved with: some never are.

    A mask `clamped`, shape (N, d), says which components of the right-hand sides are set to zero. Solutions
    are checked if the matrix is `positive_definite`. A tangent that may be indefinite only gives steps of an
    iteration.
    """

    def __init__(
        self, space: DolfinxSpace[Any], matrix: PETSc.Mat, clamped: BoolArray, *, positive_definite: bool
    ) -> None:
        self._space, self.matrix, self._clamped = space, matrix, clamped
        self._checked, self._made = positive_definite, False
        plane = space.dimension == 2
        self._factors = SymmetricFactors(matrix, definite=positive_definite, least_fill=plane)

    def update(self) -> None:
        """Factorise again after the matrix has got new values in its old places."""
        try:
            self._factors.update()
        except FactorisationError as error:
            raise UserError(
                "MUMPS cannot factorise the stiffness matrix: "
                "is there enough memory, and is no element nearly flat?"
            ) from error
        self._made = True

    @property
    def negative(self) -> int:
        """Number of negative eigenvalues."""
        return self._ready().negative

    def solve(self, nodal: FloatArray) -> FloatArray:
        """Solve for a right-hand side of shape (N, d); the solution has the same shape."""
        return np.asarray(self.solve_all(nodal[None])[0])

    def solve_all(self, nodal: FloatArray) -> FloatArray:
        """Solve for several right-hand sides, shape (r, N, d); the solutions have the same shape.

        A `UserError` says that rounding has spoilt one.
        """
        if not len(nodal):
            return nodal
        right = self._space.dofs(np.where(self._clamped, 0.0, nodal))
        found = self._ready().solve(right)
        if self._checked:
            for given, values in zip(right, found, strict=True):
                self._check(given, values)
        return self._space.nodal(found)

    def _ready(self) -> SymmetricFactors:
        """The factors of the matrix, made if they are not yet."""
        if not self._made:
            self.update()
        return self._factors

    def _check(self, right: FloatArray, values: FloatArray) -> None:
        """Raise a `UserError` if a solution, shape (n,), leaves too much of its right-hand side."""
        solution, product = self.matrix.createVecs()
        solution.array[:] = values
        self.matrix.mult(solution, product)
        left, size = np.linalg.norm(product.array_r - right), np.linalg.norm(right)
        for item in (solution, product):
            item.destroy()
        if not left <= LARGEST_RESIDUAL * size:  # nor if it is NaN
            raise UserError(
                f"rounding has spoilt the solution of the stiffness: a residual of {left / size:.1g} of the "
                f"load is left, not {LARGEST_RESIDUAL:g}; take Poisson's ratio farther from 0.5, or a mesh "
                "without flat triangles"
            )

    def destroy(self) -> None:
        """Free the factors and the matrix."""
        self._factors.destroy()
