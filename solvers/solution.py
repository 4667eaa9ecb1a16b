"""The solution that every solver returns, with strain and stress derived from the displacement gradient."""

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from typing import ClassVar, Literal, NamedTuple, Protocol, cast, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike

from pinnray.geometry.finger.learned import Learned
from pinnray.geometry.mesh.point_location import LocatedPoints
from pinnray.geometry.picture_frame import Pictures
from pinnray.runtime.arrays import BoolArray, FloatArray
from pinnray.runtime.notebook import brief, fact_table
from pinnray.solvers.elasticity import energy_density_of, strain_of, stress_of, von_mises
from pinnray.solvers.problem import Load, Problem


class DisplacementField(Protocol):
    """The displacement as a function of position, which a solver provides."""

    def displacement(self, location: LocatedPoints) -> FloatArray:
        """Displacement at `location.points`, shape (n, 2), mm."""

    def gradient(self, location: LocatedPoints) -> FloatArray:
        """Displacement gradient H[i, j] = du_i/dx_j at `location.points`, shape (n, 2, 2)."""


@runtime_checkable
class SolidField(DisplacementField, Protocol):
    """A plane, such as a side face, of a displacement in three dimensions."""

    def solid_gradient(self, location: LocatedPoints) -> FloatArray:
        """Displacement gradient du_i/dx_j at `location.points`, shape (n, 3, 3)."""


@runtime_checkable
class SmoothField(DisplacementField, Protocol):
    """A displacement whose gradient depends on the point alone: it does not jump between triangles."""

    smooth: ClassVar[Literal[True]]


@runtime_checkable
class MovedWallsField(DisplacementField, Protocol):
    """A displacement from a solver that finds that the walls are not as drawn."""

    def displacement_in_space(self, location: LocatedPoints) -> FloatArray:
        """Displacement of the material that is at `location.points` before the load, shape (n, 2), mm."""


class Uncertainty(NamedTuple):
    """Standard deviations of a solution that was estimated from markers, as functions of position."""

    #: Of `Solution.displacement_in_space`, shape (n, 2), mm
    displacement: Callable[[LocatedPoints], FloatArray]
    #: Of the von Mises stress, shape (n,), MPa, where the solver knows it
    von_mises: Callable[[LocatedPoints], FloatArray] | None = None
    #: Of `Solution.shown`, shape (n, 2), mm, where the solver found the pictures' frames
    shown: Callable[[LocatedPoints], FloatArray] | None = None


class Contact(NamedTuple):
    """Contact between indenter and finger at the full load: abscissae on the drawn front, mm."""

    position: float  #: Where the resultant force acts
    start: float  #: End of the contact nearer to the base
    end: float  #: The other end
    points: "ContactPoints | None" = None  #: From a solver that finds the pressure of a cylinder


@dataclasses.dataclass(frozen=True, eq=False)
class ContactPoints:
    """Pressure and friction of a cylinder at the k points of the front that touch it."""

    x: FloatArray  #: Abscissae before the load, shape (k,), mm
    pressure: FloatArray  #: Cauchy pressure, shape (k,), MPa
    #: Friction on the finger over area, shape (k,), MPa: positive along x where the cylinder touches below it
    friction: FloatArray
    slips: BoolArray  #: Whether the point slips along the cylinder at the end of the load, shape (k,)

    __repr__ = brief


def _interval(value: float, low: float, high: float) -> str:
    return f"{value:.4g} ({low:.4g} to {high:.4g})"


class Estimated(NamedTuple):
    """A number estimated from markers, with its 95 % interval."""

    value: float
    low: float
    high: float


class IdentifiedForce(NamedTuple):
    """The indenter's force, identified from markers; `stroke_axes` has the directions of the components."""

    force: Estimated  #: N/mm
    tangential_force: Estimated  #: N/mm
    position: Estimated | None  #: Contact's abscissa on the drawn front, mm; None where it was no unknown
    #: Shares of the variance of `force` by what they come from, the largest first
    shares: Mapping[str, float] = {}
    advice: str = ""  #: A sentence on the largest share, and on what would narrow the interval
    contact: Literal["cylinder", "patch"] = "patch"  #: What presses in the model of the finger
    learned: Learned | None = None  #: What the markers, and those of earlier pictures, say of the finger

    def phrase(self, depth: float | None = None) -> str:
        """Forces and place with their intervals in words: in N for a finger of a depth, mm, else in N/mm."""
        unit, factor = ("N/mm", 1.0) if depth is None else ("N", depth)
        force, across = (
            f"{_interval(*(factor * value for value in each))} {unit}"
            for each in (self.force, self.tangential_force)
        )
        by = " of the cylinder" if self.contact == "cylinder" else ""
        said = f"force {force}{by}, tangential force {across}"
        return said if self.position is None else f"{said}, at x = {_interval(*self.position)} mm"


def stroke_axes(load: Load) -> FloatArray:
    """Unit vectors along the indenter's stroke and across it, rows of shape (2, 2).

    The component of the indenter's force along the first is the *force*, positive where it presses. The
    second is the first turned by 90 degrees counter-clockwise: the component along it, the *tangential
    force*, is positive toward the tip if the stroke goes straight into the finger. A stroke of zero has no
    direction, and no force either: both are NaN.
    """
    stroke = np.array([value or 0.0 for value in load.displacement])
    u, v = stroke / (np.linalg.norm(stroke) or np.nan)
    return np.array([[u, v], [-v, u]])


def indenter_forces(load: Load, reaction: FloatArray, identified: IdentifiedForce | None) -> FloatArray:
    """Force and tangential force of the indenter, N/mm: as identified from markers, else the reaction's.

    What rounding leaves of one, 1e-9 of the other or less, is zero.
    """
    if identified is not None:
        return np.array([identified.force.value, identified.tangential_force.value])
    forces = stroke_axes(load) @ reaction
    return np.where(np.abs(forces) <= 1e-9 * np.abs(forces).max(), 0.0, forces)


@dataclasses.dataclass(frozen=True)
class Status:
    """Outcome of a solve."""

    converged: bool  #: Whether the solver's own criterion was met
    message: str  #: A sentence on the outcome, with advice if it has not converged
    warnings: Sequence[str] = ()  #: What speaks against what the solver was given, a sentence each


def unstable_phrase(directions: int) -> str:
    """A clause on an equilibrium in which the energy falls in some directions."""
    where = "one direction" if directions == 1 else f"{directions} directions"
    return (
        f"this equilibrium is NOT STABLE: the energy falls in {where}, so that a real finger buckles away "
        "from it; take smaller load steps, a smaller stroke or thicker ribs"
    )


@dataclasses.dataclass(frozen=True, eq=False)
class ErrorEstimate:
    """A solver's estimate of the error of its solution."""

    energy_norm: float  #: Error in the energy norm over the norm of the solution
    displacement: float  #: Relative L2 error of the displacement over the body
    von_mises: float  #: Relative L2 error of the von Mises stress over the body
    markers: FloatArray  #: Exact minus computed displacement at the mesh's markers, shape (m, 2), mm
    field: DisplacementField  #: A more accurate field, whose distance from the solution is the estimate

    __repr__ = brief

    @property
    def at_markers(self) -> float:
        """Largest error of u or v at a marker, mm."""
        return float(np.abs(self.markers).max())

    @property
    def phrase(self) -> str:
        """The estimated error in words."""
        at_markers, energy_norm = f"{self.at_markers:.2g} mm at the markers", f"{self.energy_norm:.2%}"
        return f"an estimated {at_markers} and {energy_norm} in the energy norm"


@dataclasses.dataclass(frozen=True, eq=False)
class Solution:
    """A displacement field with its problem and a record of the solve."""

    solver: str  #: Name of the solver
    problem: Problem  #: The problem solved, with the material that the solver used
    field: DisplacementField
    energy: float  #: Elastic energy per unit depth, N mm / mm
    reaction: FloatArray  #: Force of the indenter on the finger per unit depth, shape (2,), N/mm
    status: Status
    stats: Mapping[str, float | int | str]  #: Numbers that describe the solve: `seconds`, `unknowns`, ...
    #: Columns of the record of training or load steps, all of one length; empty for a direct solve
    history: Mapping[str, FloatArray] = dataclasses.field(default_factory=dict)
    #: The displacement at every row of the history, from a solver that follows the load
    states: Sequence[DisplacementField] = ()
    error: ErrorEstimate | None = None  #: The discretisation error, where the solver estimates it
    #: Displacement of each observed marker as predicted without it, from a solver that assimilates, shape
    #: (m, 2), mm; NaN where it was not seen
    left_out: FloatArray | None = None
    uncertainty: Uncertainty | None = None  #: Standard deviations, from a solver that estimates them
    #: Where the indenter presses, from a solver of finite strain; None if it does not touch
    contact: Contact | None = None
    identified: IdentifiedForce | None = None  #: The force, from a solver that identifies it
    pictures: Pictures | None = None  #: Frames of the observations' pictures, from a solver that finds them

    def displacement(self, points: ArrayLike | LocatedPoints) -> FloatArray:
        """Displacement at points of shape (n, 2) or at one of shape (2,), mm: of the same shape, mm.

        Raises:
            OutsideBodyError: If a point lies outside the finger.
        """
        return self._at(points, self.field.displacement)

    def displacement_in_space(self, points: ArrayLike | LocatedPoints) -> FloatArray:
        """Displacement of the material that is at points before the load, as `displacement`.

        It differs from `displacement` where the solver has found that the walls are not as drawn.
        """
        if isinstance(self.field, MovedWallsField):
            return self._at(points, self.field.displacement_in_space)
        return self.displacement(points)

    def at_markers(self) -> FloatArray:
        """Displacement of the markers, shape (m, 2), mm: of those observed, else of those of the design."""
        seen = self.problem.observations
        return self.displacement_in_space(self.problem.mesh.markers if seen is None else seen.points)

    @property
    def force(self) -> float:
        """Force of the indenter along its stroke, N, over the whole depth; `reaction` is per mm of depth."""
        return self.depth * float(indenter_forces(self.problem.load, self.reaction, self.identified)[0])

    @property
    def tangential_force(self) -> float:
        """Force of the indenter across its stroke, N, over the whole depth; see `stroke_axes`."""
        return self.depth * float(indenter_forces(self.problem.load, self.reaction, self.identified)[1])

    @property
    def depth(self) -> float:
        """Depth of the finger, mm."""
        finger = self.problem.finger
        return self.problem.mesh.depth if finger is None else finger.depth

    def shown(self, points: FloatArray, displacement: FloatArray) -> FloatArray:
        """What the observations' pictures show of the displacement of points, all of shape (n, 2), mm."""
        return displacement if self.pictures is None else self.pictures.shown(points, displacement)

    def __repr__(self) -> str:
        outcome = "converged" if self.status.converged else "not converged"
        load = f"{self.problem.load.kind} {self.problem.load.displacement} mm"
        return f"{type(self).__name__}({self.solver!r}, {outcome}; load {load}, force {self.force:.4g} N)"

    @property
    def force_phrase(self) -> str:
        """The force that was identified, in words; empty if there is none."""
        finger = self.problem.finger
        return self.identified.phrase(finger.depth if finger else None) if self.identified else ""

    def gradient(self, points: ArrayLike | LocatedPoints) -> FloatArray:
        """Displacement gradient du_i/dx_j at points (n, 2) or one of (2,), mm: shape (n, 2, 2) or (2, 2)."""
        return self._at(points, self.field.gradient)

    def state(self, points: ArrayLike | LocatedPoints) -> "State":
        """Strain, stress and energy density at points of shape (n, 2), or at one of shape (2,), mm."""
        location, alone = self._locate(points)
        gradient = self.field.solid_gradient if isinstance(self.field, SolidField) else self.field.gradient
        state = State.from_gradient(gradient(location), self.problem)
        return State(**{name: values[0] for name, values in vars(state).items()}) if alone else state

    def _repr_html_(self) -> str:
        """Status, energy, reaction, unknowns and time, in a notebook."""
        u, v = self.reaction
        outcome = "converged" if self.status.converged else "not converged"
        facts = {
            "status": f"{outcome}: {self.status.message}",
            "energy": f"{self.energy:.5g} N mm per mm of depth",
            "reaction": f"({u:.4g}, {v:.4g}) N per mm of depth",
            "force": f"{self.force:.4g} N over a depth of {self.depth:g} mm",
            "tangential force": f"{self.tangential_force:.4g} N",
            "unknowns": self.stats.get("unknowns", "–"),
            "time": f"{float(self.stats.get('seconds', np.nan)):.3g} s",
        }
        return fact_table(f"Solution of {self.solver}", facts)

    def _at(
        self, points: ArrayLike | LocatedPoints, field: Callable[[LocatedPoints], FloatArray]
    ) -> FloatArray:
        """A field at points; without the first axis at a single point."""
        location, alone = self._locate(points)
        values = field(location)
        return values[0] if alone else values

    def _locate(self, points: ArrayLike | LocatedPoints) -> tuple[LocatedPoints, bool]:
        """The location of points, and whether it is one point by itself, of shape (2,)."""
        if isinstance(points, LocatedPoints):
            return points, False
        alone = (
            isinstance(points, list | tuple | np.ndarray)
            and np.shape(points[:1]) == (1,)
            and len(points) == 2
        )
        return self.problem.mesh.locate(cast(ArrayLike, [points]) if alone else points), alone


@dataclasses.dataclass(frozen=True, eq=False)
class State:
    """Strain and stress at n points."""

    strain: FloatArray  #: In-plane, shape (n, 2, 2): infinitesimal, or Green-Lagrange for finite strain
    stress: FloatArray  #: In-plane Cauchy stress, shape (n, 2, 2), MPa
    stress_zz: FloatArray  #: Out-of-plane Cauchy stress, shape (n,), MPa; zero in plane stress
    von_mises: FloatArray  #: Shape (n,), MPa
    energy_density: FloatArray  #: Strain energy per reference volume, shape (n,), MPa

    __repr__ = brief

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
