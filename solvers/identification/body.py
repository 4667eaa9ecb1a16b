"""The interface of a discretised finger at finite strain to the inverse problem.

A state c is an array of degrees of freedom. The energy of a finger whose walls differ from the drawn ones is

    E(c) = ∫ ψ(G) det(I + ∇W) dX        G = ∇u (I + ∇W)⁻¹

over the drawn body, with the motion W of `WallMotion`. At the base u is zero or, where that has feet, their
motion. F is the derivative of E by the rest of c.
"""

from collections.abc import Callable
from typing import ClassVar, NamedTuple, Protocol, runtime_checkable

from pinnray.geometry.mesh.point_location import LocatedPoints
from pinnray.runtime.arrays import FloatArray
from pinnray.solvers.elasticity import Lame
from pinnray.solvers.solution import DisplacementField


class Linearised(NamedTuple):
    """A body about a state; the functions are valid until the body is linearised again."""

    force: FloatArray  # F there, of the shape of a state, N/mm
    # K⁻¹ of generalised forces of shape (r, *shape), with the tangent K
    solve: Callable[[FloatArray], FloatArray]
    negative: Callable[[], int]  # Number of negative eigenvalues of K


class Body(Protocol):
    """A finger of one law, clamped at its base, discretised.

    Arguments are a state of shape `shape`, Lamé constants, MPa, and changes of the k walls' thickness, mm.
    """

    thick: ClassVar[bool]  # Whether it has a depth with free side faces, or is in plane strain

    @property
    def shape(self) -> tuple[int, ...]:
        """Shape of a state."""
        ...

    def admissible(self, state: FloatArray, changes: FloatArray) -> bool:
        """Whether neither the walls' motion nor the displacement turns a point inside out."""
        ...

    def linearised(self, state: FloatArray, lame: Lame, changes: FloatArray) -> Linearised | None:
        """The force at a state and the tangent, factorised; None if a point is turned inside out."""
        ...

    @property
    def feet(self) -> FloatArray:
        """States (f, *shape) that are zero but at the base, which has a unit of each motion of `Feet`."""
        ...

    def force_slopes(
        self, state: FloatArray, lame: Lame, changes: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Derivatives of F by the k thicknesses, (k, *shape), by λ and μ, (2, *shape), and by the f motions.

        The state is held, but for the base in the last ones, of shape (f, *shape).
        """
        ...

    def displacement_rows(self, points: FloatArray, weights: FloatArray) -> FloatArray:
        """Rows (r, 2, *shape) of Σ_q w_rq u(P_q), for points (q, 2), mm, and weights (r, q)."""
        ...

    def traction_rows(self, points: FloatArray, weights: FloatArray) -> FloatArray:
        """As `displacement_rows`, of the mean over the depth, on which a traction does work."""
        ...

    def gradient_rows(self, points: FloatArray, weights: FloatArray) -> FloatArray:
        """Rows (r, 2, *shape) of Σ_qj w_rqj ∂u/∂X_j(P_q), for points (q, 2), mm, and weights (r, q, 2)."""
        ...

    def energy(self, state: FloatArray, lame: Lame, changes: FloatArray) -> float:
        """Elastic energy per depth, N mm / mm."""
        ...

    def field(self, state: FloatArray) -> DisplacementField:
        """The displacement as a function of the drawn position."""
        ...

    def displacements(self, states: FloatArray, location: LocatedPoints) -> FloatArray:
        """Displacements (s, n, 2) of states (s, *shape) at points of the drawn body."""
        ...

    def gradients(self, states: FloatArray, location: LocatedPoints) -> FloatArray:
        """Displacement gradients (s, n, d, d) of states (s, *shape): d is 3 on a side face, else 2."""
        ...


@runtime_checkable
class PressedBody(Body, Protocol):
    """A body whose front a cylinder may press: each equilibrium takes its response to many forces."""

    @property
    def front(self) -> FloatArray:
        """Points of the front that are not held, shape (m, 2), mm, at which a cylinder is kept out."""
        ...
