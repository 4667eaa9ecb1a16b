"""Linear systems under linear constraints, rigid or through springs, by the inverse of the stiffness alone.

    K x - Cᵀ f = r        C x + S f = g

with the constraints' forces f and the diagonal matrix S of the springs' compliances, zero where a constraint
is rigid. With the free solution K⁻¹ r and the responses K⁻¹ Cᵀ to unit forces,

    (C K⁻¹ Cᵀ + S) f = g - C K⁻¹ r        x = K⁻¹ r + K⁻¹ Cᵀ f

Source: M. Benzi, G. H. Golub, J. Liesen, Acta Numerica 14 (2005) 1-137, section 5, for the multipliers -f.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from pinnray.runtime.arrays import FloatArray


@dataclass(frozen=True, eq=False)
class ConstrainedElimination:
    """k constraints on a solution x of any array shape."""

    rows: FloatArray  # C, shape (k, *x.shape)
    responses: FloatArray  # K⁻¹ Cᵀ, of the same shape
    compliance: FloatArray | float = 0.0  # Diagonal of S, shape (k,), or one number for all

    @cached_property
    def flexibility(self) -> FloatArray:
        """C K⁻¹ Cᵀ, shape (k, k)."""
        return _flat(self.rows) @ _flat(self.responses).T

    @cached_property
    def schur_complement(self) -> FloatArray:
        """C K⁻¹ Cᵀ + S, shape (k, k)."""
        return self.flexibility + self.compliance * np.eye(len(self.rows))

    def unstable(self, negative: int) -> int:
        """Number of directions that keep the constraints and in which the energy, springs included, falls.

        K has `negative` negative eigenvalues. The whole system's inertia is K's plus its Schur complement's,
        and also S's plus that of K with the springs, whose compliance may be negative (Haynsworth).
        """
        schur = np.linalg.eigvalsh(self.schur_complement)
        springs = np.broadcast_to(self.compliance, len(self.rows))
        return negative - int(np.count_nonzero(schur < 0)) + int(np.count_nonzero(springs < 0))

    def values(self, x: FloatArray) -> FloatArray:
        """C x, shape (k,)."""
        return _flat(self.rows) @ x.ravel()

    def weighted(self, forces: FloatArray) -> FloatArray:
        """Cᵀ f of forces of shape (k,)."""
        return np.tensordot(forces, self.rows, axes=1)

    def forces(self, gaps: FloatArray) -> FloatArray:
        """Forces f that close gaps g - C K⁻¹ r, both of shape (k,)."""
        return np.linalg.solve(self.schur_complement, gaps)

    def solution(self, free: FloatArray, values: FloatArray | float = 0.0) -> tuple[FloatArray, FloatArray]:
        """Solution x and forces f, from the free solution K⁻¹ r and values g, shape (k,) or one for all."""
        forces = self.forces(values - self.values(free))
        return free + (forces @ _flat(self.responses)).reshape(free.shape), forces


def _flat(rows: FloatArray) -> FloatArray:
    return rows.reshape(len(rows), int(np.prod(rows.shape[1:])))
