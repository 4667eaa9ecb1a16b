"""Material and load: elastic constants, and the motion of the indenter."""

from collections.abc import Sequence
from math import cos, isfinite, radians, sin
from numbers import Real
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, ClassVar, Literal, NamedTuple, Self, get_args

import numpy as np
from pydantic import Field, PrivateAttr, field_validator, model_validator

from pinnray.geometry.finger.parameters import CheckedModel, bounded
from pinnray.runtime.arrays import FloatArray
from pinnray.runtime.errors import UserError
from pinnray.solvers.elasticity import Lame, lame_constants
from pinnray.solvers.names import LawName
from pinnray.solvers.names import LoadKind as LoadKind

RADIUS = 5.0
"""Default radius of the cylinder, mm."""

ROUGHEST = 5.0
"""Largest coefficient of friction; that of rubber on rough ground is below."""

LEAST_TRAVEL = 1e-9
"""Smallest displacement of an indenter that moves, mm: a hundredth of an atom's size."""


def _number(
    default: float | None, low: float, high: float, unit: str, meaning: str, symbol: str = "", **limits: Any
) -> Any:
    """A number with its unit, the ends of the range that a study may span, and the limits of pydantic."""
    return Field(
        default=default,
        description=meaning,
        json_schema_extra={"unit": unit, "symbol": symbol, "low": low, "high": high},
        **limits,
    )


class Substance(NamedTuple):
    """What is known of a material besides its elasticity."""

    name: str
    density: float  #: g/cm^3
    strain_at_break: float  #: Nominal strain


class Material(CheckedModel):
    """An isotropic elastic material; by default the paper's, Agilus30 and VeroUltra mixed to Shore 85A.

    Young's modulus and Poisson's ratio go by their names or symbols: `Material(young=3, poisson=0.4)` equals
    `Material(E=3, nu=0.4)`. A `UserError` says that a constant is out of its range, or that the law is not
    given for plane stress.
    """

    synonyms = MappingProxyType(
        dict.fromkeys(("e", "modulus", "elastic_modulus", "stiffness"), "young") | {"nu": "poisson"}
    )

    young: float = _number(11.4, 1e-6, 1e7, "MPa", "Young's modulus", "E", gt=0)
    poisson: float = _number(0.45, -0.99, 0.4999, "", "Poisson's ratio", "nu", gt=-1, lt=0.5)
    #: Plane "strain" (thick finger) or plane "stress" (the equations that the paper prints)
    plane: Literal["strain", "stress"] = "strain"
    law: LawName = "linear"  #: "linear" is Hooke's law; the others are of finite strain
    _substance: Substance | None = PrivateAttr(None)  # beside the constants, which alone decide a solution

    if TYPE_CHECKING:

        def __init__(
            self,
            *,
            young: float = 11.4,
            poisson: float = 0.45,
            plane: Literal["strain", "stress"] = "strain",
            law: LawName = "linear",
            E: float = 11.4,
            nu: float = 0.45,
        ) -> None: ...

    @field_validator("young")
    @classmethod
    def _of_a_solid(cls, young: float) -> float:
        softest, stiffest = 1e-6, 1e7  # a thousandth of the softest gels' to eight times diamond's
        if not softest <= young <= stiffest:
            raise ValueError(
                f"no solid has this Young's modulus; give {softest:g} to {stiffest:g} MPa (1 MPa = 10^6 Pa)"
            )
        return young

    @model_validator(mode="after")
    def _supported(self) -> Self:
        if self.law != "linear" and self.plane == "stress":
            raise ValueError(f"the {self.law} law is given for plane strain only; take plane = strain")
        return self

    @property
    def substance(self) -> Substance | None:
        """What the finger is made of, where that is known."""
        return self._substance

    def made_of(self, substance: Substance | None) -> Self:
        """The same elastic constants, of a substance."""
        made = self.model_copy()
        made._substance = substance
        return made

    @property
    def lame(self) -> Lame:
        """Lamé constants of the plane law, MPa."""
        return lame_constants(self.young, self.poisson, self.plane)

    @property
    def solid_lame(self) -> Lame:
        """Lamé constants in three dimensions, MPa."""
        return lame_constants(self.young, self.poisson, "strain")


def travel(stroke: float, direction: float = 0.0, slide: bool = False) -> tuple[float | None, float]:
    """Displacement (u, v), mm, of an indenter that presses.

    Args:
        stroke: Its travel, mm.
        direction: Of the travel, degrees: 0 into the finger, 90 along it to the tip.
        slide: Whether the contact slides along the finger: u is free.

    Raises:
        UserError: If it does not press.
    """
    for name, value in (("stroke", stroke), ("direction", direction)):
        if isinstance(value, bool) or not isinstance(value, Real) or not isfinite(value):
            raise UserError(f"{name} = {value!r} is not a finite number")
    if stroke <= 0:
        raise UserError(f"stroke {stroke:g}: the indenter presses; give its travel, above 0 mm")
    if not -90 < direction < 90:
        raise UserError(f"direction {direction:g}: give an angle between -90 and 90 degrees")
    if slide and direction:
        raise UserError("slide leaves the travel along the finger free, so that direction says nothing")
    along, into = sin(radians(direction)), cos(radians(direction))
    return None if slide else stroke * along, -stroke * into


class Load(CheckedModel):
    """Displacement that the indenter prescribes at the boundary `contact`; a component None is free of force.

    `Load("cylinder", stroke=5)`: the kind may be given first, and `stroke`, `direction` and `slide` stand for
    the displacement, as in `travel`.

    Attributes:
        kind: `mean`: the weighted mean displacement over the contact is prescribed (`contact_functional`);
            well posed, the default. `point`: the displacement of the contact's middle node is prescribed, as
            in the paper; its limit under mesh refinement does not exist. `patch`: every point of the contact
            has the displacement. `cylinder`: a rigid cylinder, which does not turn and touches the front face
            at the contact's middle from outside, moves by the displacement; the contact zone is found.
        displacement: Prescribed (u, v), mm.
        position: Abscissa of the contact's middle on the front face, mm; None means where the mesh has its
            boundary `contact`, whose width the contact has in any case. A `patch` cannot be elsewhere.
        radius: Radius of the cylinder, mm, 5 unless given; None for the other kinds.
        friction: Coulomb's coefficient of friction between cylinder and finger; 0 for the other kinds.

    Raises:
        UserError: If nothing is prescribed, a number is not finite, or a value does not go with the kind.
    """

    kind: LoadKind = "mean"
    displacement: tuple[float | None, float | None] = (0.0, -10.0)
    position: float | None = None
    radius: float | None = Field(default=None, gt=0, allow_inf_nan=False)
    friction: float = bounded(0.0, 0.0, ROUGHEST, "", "", "Coefficient of friction of a cylinder")

    other_words: ClassVar = ("stroke", "direction", "slide")
    synonyms = MappingProxyType(
        dict.fromkeys(("travel", "indentation"), "stroke")
        | dict.fromkeys(("mu", "friction_coefficient"), "friction")
        | {"angle": "direction"}
    )

    if TYPE_CHECKING:

        def __init__(
            self,
            kind: LoadKind = "mean",
            *,
            displacement: tuple[float | None, float | None] = (0.0, -10.0),
            stroke: float = 10.0,
            direction: float = 0.0,
            slide: bool = False,
            position: float | None = None,
            radius: float | None = None,
            friction: float = 0.0,
        ) -> None: ...

    else:

        def __init__(self, *kind, **values) -> None:
            if len(kind) == 1 and isinstance(kind[0], str) and "kind" not in values:
                values, kind = {"kind": kind[0], **values}, ()
            way = {name: values.pop(name) for name in self.other_words if name in values}
            if way and "displacement" in values:
                raise UserError(f"{next(iter(way))} and displacement both say how far; give one of them")
            if way:
                values["displacement"] = travel(**{"stroke": 10.0, **way})
            if values.get("kind") == "cylinder" and values.get("radius") is None:
                values["radius"] = RADIUS
            super().__init__(*kind, **values)

    @field_validator("kind", mode="before")
    @classmethod
    def _of_a_kind(cls, kind: object) -> object:
        if kind not in (kinds := get_args(LoadKind)):
            raise ValueError(f"there are {', '.join(kinds)}")
        return kind

    @field_validator("displacement", mode="before")
    @classmethod
    def _of_two(cls, displacement: object) -> object:
        if isinstance(displacement, np.ndarray):
            displacement = displacement.tolist()
        if not isinstance(displacement, Sequence) or isinstance(displacement, str) or len(displacement) != 2:
            raise ValueError("give u and v in mm, such as (0, -10), or the travel alone as stroke = 10")
        return displacement

    @model_validator(mode="after")
    def _acts(self) -> Self:
        if all(value is None for value in self.displacement):
            raise ValueError("the load leaves both components free; prescribe u, v or both (mm)")
        if 0 < max(abs(value or 0.0) for value in self.displacement) < LEAST_TRAVEL:
            raise ValueError(
                f"the load moves the contact by less than {LEAST_TRAVEL:g} mm, a hundredth of an atom's "
                "size; give mm"
            )
        if self.kind == "patch" and self.position is not None:
            raise ValueError(
                "a patch lies on whole elements: mesh the finger with its contact_position there"
            )
        if (self.kind == "cylinder") != (self.radius is not None):
            raise ValueError("a radius belongs to the load cylinder, and to no other; give it in mm")
        if self.friction and self.kind != "cylinder":
            raise ValueError("friction belongs to the load cylinder, and to no other; leave it out")
        if self.kind == "cylinder" and None in self.displacement:
            raise ValueError("a cylinder is moved in u and v: the finger slides along it as friction lets it")
        if self.kind == "cylinder" and not any(self.displacement):
            raise ValueError("the cylinder does not move; prescribe a displacement (mm)")
        return self

    def as_mean(self) -> "Load":
        """The same displacement as the mean over a contact as wide as the drawn one."""
        return Load(displacement=self.displacement, position=self.position)

    @property
    def prescribed(self) -> list[int]:
        """The components (0 for u, 1 for v) that are prescribed."""
        return [axis for axis, value in enumerate(self.displacement) if value is not None]

    @property
    def values(self) -> FloatArray:
        """The prescribed components' displacements, shape (1,) or (2,), mm."""
        return np.array([value for value in self.displacement if value is not None], dtype=np.float64)


class Physics(Material):
    """Material and load by the names that options, files and studies share.

    The load is that of an indenter that travels in one direction.

    Raises:
        UserError: If the indenter does not press, or a value does not go with the kind of load.
    """

    synonyms = MappingProxyType({**Material.synonyms, **Load.synonyms})

    load: LoadKind = "mean"  #: See `Load`
    stroke: float = _number(10.0, 1e-6, 1e4, "mm", "Travel of the indenter")
    #: 0 into the finger, 90 along it to the tip
    direction: float = _number(0.0, -89, 89, "deg", "Direction of the travel")
    slide: bool = False  #: Whether the contact slides along the finger: u is free
    radius: float | None = _number(None, 1e-6, 1e4, "mm", "Radius of a cylinder; none means 5 mm")
    friction: float = bounded(0.0, 0.0, ROUGHEST, "", "", "Coefficient of friction of a cylinder")

    @model_validator(mode="after")
    def _presses(self) -> Self:
        travel(self.stroke, self.direction, self.slide)
        return self

    @property
    def parts(self) -> tuple[Material, Load]:
        """Material and load."""
        load = Load(
            self.load,
            displacement=travel(self.stroke, self.direction, self.slide),
            radius=self.radius,
            friction=self.friction,
        )
        return Material(**self.model_dump(include=set(Material.model_fields))), load
