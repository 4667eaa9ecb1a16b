"""The solution that every solver returns, with strain and stress derived from the displacement gradient."""

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Literal, NamedTuple, Protocol, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike

from geometry.arrays import FloatArray
from geometry.errors import UserError
from geometry.mesh.point_location import LocatedPoints
from geometry.notebook import fact_table
from solvers.elasticity import energy_density_of, strain_of, stress_of, von_mises
from solvers.problem import Problem

if TYPE_CHECKING:
    from geometry.figure import Figure


class DisplacementField(Protocol):
    """The displacement as a function of position, which a solver has to provide."""

    def displacement(self, location: LocatedPoints) -> FloatArray:
        """Displacement at `location.points`, shape (n, 2), mm."""
        ...

    def gradient(self, location: LocatedPoints) -> FloatArray:
        """Displacement gradient H[i, j] = du_i/dx_j at `location.points`, shape (n, 2, 2)."""
        ...


@runtime_checkable
class SolidField(DisplacementField, Protocol):
    """A plane, such as a side face, of a displacement in three dimensions."""

    def solid_gradient(self, location: LocatedPoints) -> FloatArray:
        """Displacement gradient du_i/dx_j at `location.points`, shape (n, 3, 3)."""
        ...


@runtime_checkable
class MovedWallsField(DisplacementField, Protocol):
    """A displacement of the drawn material, of a solver that finds that the walls are not as drawn."""

    def displacement_in_space(self, location: LocatedPoints) -> FloatArray:
        """Displacement of the material that is at `location.points` before the load, shape (n, 2), mm."""
        ...


class Uncertainty(NamedTuple):
    """Standard deviations of a solution that was estimated from markers, as functions of position.

    Attributes:
        displacement: Of `Solution.displacement_in_space`, shape (n, 2), mm.
        von_mises: Of the von Mises stress, shape (n,), MPa, where the solver knows it.
    """

    displacement: Callable[[LocatedPoints], FloatArray]
    von_mises: Callable[[LocatedPoints], FloatArray] | None = None


class Contact(NamedTuple):
    """Contact between indenter and finger at the full load: abscissae on the drawn front, mm.

    Attributes:
        position: Where the resultant force acts.
        start: End of the contact nearer to the base.
        end: The other end.
    """

    position: float
    start: float
    end: float


class Estimated(NamedTuple):
    """A number estimated from markers, with its 95 % interval."""

    value: float
    low: float
    high: float


class IdentifiedForce(NamedTuple):
    """The indenter's force, identified from markers.

    Attributes:
        size: N/mm.
        position: Abscissa of the contact on the drawn front, mm; None where it was not an unknown.
    """

    size: Estimated
    position: Estimated | None


@dataclasses.dataclass(frozen=True)
class Status:
    """Outcome of a solve.

    Attributes:
        converged: Whether the solver's own criterion was met.
        message: A sentence on the outcome, with advice if it has not converged.
    """

    converged: bool
    message: str


def unstable_phrase(directions: int) -> str:
    """A clause on an equilibrium in which the energy falls in some directions."""
    where = "one direction" if directions == 1 else f"{directions} directions"
    return (
        f"this equilibrium is NOT STABLE: the energy falls in {where}, so that a real finger buckles away "
        "from it; take smaller load steps, a smaller stroke or thicker ribs"
    )


@dataclasses.dataclass(frozen=True, eq=False)
class ErrorEstimate:
    """A solver's estimate of the error of its solution.

    Attributes:
        energy_norm: Error in the energy norm over the norm of the solution.
        displacement: Relative L2 error of the displacement over the body.
        von_mises: Relative L2 error of the von Mises stress over the body.
        markers: Exact minus computed displacement at the mesh's markers, shape (m, 2), mm.
        field: A more accurate field: its distance from the solution's is the estimated error.
    """

    energy_norm: float
    displacement: float
    von_mises: float
    markers: FloatArray
    field: DisplacementField

    @property
    def at_markers(self) -> float:
        """Largest error of u or v at a marker, mm."""
        return float(np.abs(self.markers).max())

    @property
    def phrase(self) -> str:
        """The estimated error in words."""
        size = f"{self.at_markers:.2g} mm at the markers and {self.energy_norm:.2%} in the energy norm"
        return f"an estimated {size}"


@dataclasses.dataclass(frozen=True, eq=False)
class Solution:
    """A displacement field with its problem and a record of the solve.

    Attributes:
        solver: Name of the solver.
        problem: The problem solved, with the material that the solver used.
        field: The displacement field.
        energy: Elastic energy per unit depth, N mm / mm.
        reaction: Force of the indenter on the finger per unit depth, shape (2,), N/mm.
        status: Outcome of the solve.
        stats: Numbers that describe the solve: `seconds`, `unknowns`, ...
        history: Columns of the training or load-stepping record, all of one length; empty for a direct solve.
        states: The displacement field at every row of the history, from a solver that follows the load.
        error: The discretisation error, where the solver estimates it.
        left_out: From a solver that assimilates: the displacement of each observed marker as predicted
            without it, shape (m, 2), mm; NaN where it was not seen.
        uncertainty: Standard deviations of the field, from a solver that estimates it.
        contact: Where the indenter presses, from a solver of finite strain; None if it does not touch.
        identified: The force, from a solver that identifies it.
    """

    solver: str
    problem: Problem
    field: DisplacementField
    energy: float
    reaction: FloatArray
    status: Status
    stats: Mapping[str, float | int | str]
    history: Mapping[str, FloatArray] = dataclasses.field(default_factory=dict)
    states: Sequence[DisplacementField] = ()
    error: ErrorEstimate | None = None
    left_out: FloatArray | None = None
    uncertainty: Uncertainty | None = None
    contact: Contact | None = None
    identified: IdentifiedForce | None = None

    def displacement(self, points: ArrayLike | LocatedPoints) -> FloatArray:
        """Displacement at points of shape (n, 2), mm: shape (n, 2), mm.

        Raises:
            OutsideBodyError: If a point lies outside the finger.
        """
        return self.field.displacement(self._locate(points))

    def displacement_in_space(self, points: ArrayLike | LocatedPoints) -> FloatArray:
        """Displacement of the material that is at points (n, 2), mm, before the load: shape (n, 2), mm.

        It is `displacement` unless the solver has found that the walls are not as drawn, so that other
        material is there.
        """
        if isinstance(self.field, MovedWallsField):
            return self.field.displacement_in_space(self._locate(points))
        return self.displacement(points)

    def gradient(self, points: ArrayLike | LocatedPoints) -> FloatArray:
        """Displacement gradient du_i/dx_j at points of shape (n, 2), mm: shape (n, 2, 2).

        Raises:
            OutsideBodyError: If a point lies outside the finger.
        """
        return self.field.gradient(self._locate(points))

    def state(self, points: ArrayLike | LocatedPoints) -> "State":
        """Strain, stress and energy density at points of shape (n, 2), mm."""
        location = self._locate(points)
        if isinstance(self.field, SolidField):
            return State.from_gradient(self.field.solid_gradient(location), self.problem)
        return State.from_gradient(self.field.gradient(location), self.problem)

    def plot(
        self, quantity: Literal["displacement", "von_mises"] = "displacement", *, scale: float = 1.0
    ) -> "Figure":
        """A field on the deformed mesh, as a matplotlib figure.

        Args:
            quantity: `displacement`: its magnitude, mm; `von_mises`: the stress, MPa.
            scale: Factor of the displacement that is drawn.

        Raises:
            UserError: If the quantity is another one.
        """
        from geometry.mesh.picture import plot_field

        mesh = self.problem.mesh
        moved = self.displacement(mesh.points)
        if quantity == "displacement":
            name, unit = "displacement magnitude", "mm"
            values = np.linalg.norm(moved, axis=1)[mesh.triangles].mean(axis=1)
        elif quantity == "von_mises":
            name, unit, values = "von Mises stress", "MPa", self.state(mesh.at_centroids()).von_mises
        else:
            raise UserError(f"there is no field {quantity!r} to plot; there are displacement, von_mises")
        remark = "" if self.status.converged else " (not converged)"
        times = "true scale" if scale == 1 else f"displacement times {scale:g}"
        title = f"{self.solver}{remark}: {name}, {times}"
        return plot_field(mesh, scale * moved, values, title=title, label=f"{name}, {unit}")

    def _repr_html_(self) -> str:
        """Status, energy, reaction, unknowns and time, in a notebook."""
        u, v = self.reaction
        facts = {
            "status": ("converged" if self.status.converged else "not converged")
            + f": {self.status.message}",
            "energy": f"{self.energy:.5g} N mm per mm of depth",
            "reaction": f"({u:.4g}, {v:.4g}) N per mm of depth",
            "unknowns": self.stats.get("unknowns", "–"),
            "time": f"{float(self.stats.get('seconds', np.nan)):.3g} s",
        }
        return fact_table(f"Solution of {self.solver}", facts)

    def _locate(self, points: ArrayLike | LocatedPoints) -> LocatedPoints:
        return points if isinstance(points, LocatedPoints) else self.problem.mesh.locate(points)


@dataclasses.dataclass(frozen=True, eq=False)
class State:
    """Strain and stress at n points.

    Attributes:
        strain: In-plane strain tensor, shape (n, 2, 2): infinitesimal for the linear law, Green-Lagrange for
            finite strain.
        stress: In-plane Cauchy stress, shape (n, 2, 2), MPa.
        stress_zz: Out-of-plane Cauchy stress, shape (n,), MPa; zero in plane stress.
        von_mises: Shape (n,), MPa.
        energy_density: Strain energy per reference volume, shape (n,), MPa.
    """

    strain: FloatArray
    stress: FloatArray
    stress_zz: FloatArray
    von_mises: FloatArray
    energy_density: FloatArray

    @classmethod
    def from_gradient(cls, gradient: FloatArray, problem: Problem) -> "State":
        """The state of the problem's material at displacement gradients, shape (n, 2, 2) or (n, 3, 3)."""
        material, solid = problem.material, gradient.shape[-1] == 3
        law, lame = material.law, material.solid_lame if solid else material.lame
        stress, stress_zz = stress_of(law, gradient, lame)
        strain: FloatArray = np.moveaxis(np.array(strain_of(law, gradient)), -1, 0)
        return cls(
            strain=strain[:, :2, :2],
            stress=stress[:, :2, :2],
            stress_zz=stress_zz,
            von_mises=von_mises(stress, stress_zz=stress_zz),
            energy_density=np.asarray(energy_density_of(law, gradient, lame)),
        )
