"""Displacements and forces under linear constraints, by a factorisation of the stiffness alone."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from geometry.arrays import FloatArray


@dataclass(frozen=True, eq=False)
class Bordered:
    """Solutions of K x - f_k b_k = r, b_k . x = d_k; vectors have n components in any order.

    Attributes:
        solve: K^-1 of a vector.
        functionals: b_k, shape (k, n).
        responses: K^-1 b_k, shape (k, n).
    """

    solve: Callable[[FloatArray], FloatArray]
    functionals: FloatArray
    responses: FloatArray

    @classmethod
    def of(cls, solve: Callable[[FloatArray], FloatArray], functionals: FloatArray) -> "Bordered":
        """Solve for every functional."""
        return cls(solve, functionals, np.array([solve(functional) for functional in functionals]))

    def solution(self, right: FloatArray, values: FloatArray) -> tuple[FloatArray, FloatArray]:
        """x, shape (n,), and f, shape (k,), for r of shape (n,) and d of shape (k,)."""
        free = self.solve(right) if right.any() else right
        forces = np.linalg.solve(self.functionals @ self.responses.T, values - self.functionals @ free)
        return free + forces @ self.responses, forces
