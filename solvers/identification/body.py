"""The interface of a discretised finger at finite strain to the inverse problem.

A state c is an array of degrees of freedom. The energy of a finger whose walls differ from the drawn ones is

    E(c) = ∫ ψ(G) det(I + ∇W) dX        G = ∇u (I + ∇W)⁻¹

over the drawn body, with the motion W of `WallMotion`; u = 0 holds at the base. F is its derivative by c.
"""

from typing import Protocol

from geometry.arrays import FloatArray
from geometry.mesh.point_location import LocatedPoints
from solvers.elasticity import Lame
from solvers.solution import DisplacementField


class Linearised(Protocol):
    """A body about a state."""

    @property
    def force(self) -> FloatArray:
        """F there, of the shape of a state, N/mm."""
        ...

    @property
    def negative(self) -> int:
        """Number of negative eigenvalues of the tangent K; valid as long as `solve` is."""
        ...

    def solve(self, right: FloatArray) -> FloatArray:
        """K⁻¹ of generalised forces of shape (r, *shape); valid until the body is linearised again."""
        ...


class Body(Protocol):
    """A finger of one law, clamped at its base, discretised."""

    @property
    def shape(self) -> tuple[int, ...]:
        """Shape of a state."""
        ...

    def linearised(self, state: FloatArray, lame: Lame, changes: FloatArray) -> Linearised | None:
        """The force at a state and the tangent K, factorised; None if a point is turned inside out.

        Args:
            state: Shape `shape`.
            lame: Lamé constants, MPa.
            changes: Of the walls' thickness, shape (k,), mm.
        """
        ...

    def force_slopes(
        self, state: FloatArray, lame: Lame, changes: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Derivatives of F by the k thicknesses, (k, *shape), and by λ and μ, (2, *shape), at fixed state."""
        ...

    def displacement_rows(self, points: FloatArray, weights: FloatArray) -> FloatArray:
        """Rows, shape (r, 2, *shape), whose product with a state is Σ_q w_rq u(P_q).

        Args:
            points: P, shape (q, 2), mm, in the drawn body.
            weights: w, shape (r, q).
        """
        ...

    def gradient_rows(self, points: FloatArray, weights: FloatArray) -> FloatArray:
        """Rows, shape (r, 2, *shape), whose product with a state is Σ_q w_rqj ∂u/∂X_j(P_q)."""
        ...

    def energy(self, state: FloatArray, lame: Lame, changes: FloatArray) -> float:
        """Elastic energy per depth, N mm / mm."""
        ...

    def field(self, state: FloatArray) -> DisplacementField:
        """The displacement as a function of the drawn position."""
        ...

    def gradients(self, states: FloatArray, location: LocatedPoints) -> FloatArray:
        """Displacement gradients (s, n, 2, 2) of states (s, *shape) at points of the drawn body."""
        ...
