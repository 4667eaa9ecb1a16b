"""Load: the indenter's kind, how far and which way it moves, and how it touches."""

from math import cos, radians, sin
from typing import TYPE_CHECKING, Any, Literal, Self

from pydantic import Field, field_validator, model_validator

from pinnray.geometry.finger.parameters import CheckedModel, bounded
from pinnray.runtime.errors import UserError
from pinnray.solvers.material import Material

if TYPE_CHECKING:  # options are of this class, and `--help` has to be quick
    from pinnray.runtime.arrays import FloatArray

LoadKind = Literal["mean", "point", "patch", "cylinder"]
"""See `Load`."""

USUAL_RADIUS = 5.0
"""Default radius of the cylinder, mm."""

ROUGHEST = 5.0
"""Largest coefficient of friction; that of rubber on rough ground is below."""

LEAST_TRAVEL = 1e-9
"""Smallest displacement of an indenter that moves, mm: a hundredth of an atom's size."""


class Travel(CheckedModel):
    """Stroke and direction of an indenter that presses.

    Raises:
        UserError: If it does not press, or slides and has a direction.
    """

    stroke: float = bounded(10.0, 1e-6, 1e4, "Stroke of the indenter", "mm")
    direction: float = bounded(
        0.0, -89, 89, "Direction of the stroke: 0 into the finger, 90 along it to the tip", "deg"
    )
    slide: bool = Field(default=False, description="Let the contact slide along the finger: u is free")

    @model_validator(mode="after")
    def _one_way(self) -> Self:
        if self.slide and self.direction:
            raise ValueError("slide leaves the contact free along the finger, so that direction says nothing")
        return self

    @property
    def displacement(self) -> tuple[float | None, float]:
        """Displacement (u, v), mm."""
        along, into = sin(radians(self.direction)), cos(radians(self.direction))
        return None if self.slide else self.stroke * along, -self.stroke * into


RADIUS: Any = bounded(None, 1e-6, 1e4, "Radius of a cylinder; none means 5 mm", "mm")
FRICTION: Any = bounded(0.0, 0.0, ROUGHEST, "Coefficient of friction of a cylinder")


class Load(CheckedModel):
    """Displacement that the indenter prescribes at the boundary `contact`; a component None is free of force.

    `Load("cylinder", stroke=5)`: the kind may be given first, and `stroke`, `direction` and `slide` stand for
    the displacement, as in `Travel`.

    Attributes:
        kind: `mean`: the mean displacement over the contact, weighted by `mean_weight`, is prescribed; well
            posed, the default. `point`: the displacement of the contact's middle node is prescribed, as
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
    radius: float | None = RADIUS
    friction: float = FRICTION
    other_words = tuple(Travel.model_fields)

    def __init__(self, kind: LoadKind = "mean", **values: Any) -> None:
        way = {name: values.pop(name) for name in self.other_words if name in values}
        if way and "displacement" in values:
            raise UserError(f"{next(iter(way))} and displacement both say how far; give one of them")
        if way:
            values["displacement"] = Travel(**way).displacement
        if isinstance(kind, str) and kind == "cylinder" and values.get("radius") is None:
            values["radius"] = USUAL_RADIUS
        super().__init__(**{"kind": kind, **values})

    @field_validator("displacement", mode="before")
    @classmethod
    def _of_an_array(cls, displacement: Any) -> object:
        return displacement.tolist() if hasattr(displacement, "tolist") else displacement

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
    def values(self) -> "FloatArray":
        """The prescribed components' displacements, shape (1,) or (2,), mm."""
        import numpy as np

        return np.array([value for value in self.displacement if value is not None], dtype=np.float64)


def mean_weight(distance: "FloatArray", width: float) -> "FloatArray":
    """Weight of the displacement at distances from the contact's middle, shape (n,), in the mean load, 1/mm.

    The raised cosine (1 + cos(2 pi s / b)) / b at distance s, in mm, of a contact of width b: smooth, zero at
    both ends, with integral one.
    """
    import numpy as np

    return np.asarray((1 + np.cos(2 * np.pi * distance / width)) / width)


class Physics(Travel, Material):
    """Material and load by the names that options, keywords, files and studies share."""

    load: LoadKind = Field(
        default="mean",
        description="Indenter. mean: prescribed weighted mean displacement of the contact; point: one "
        "prescribed point, as in the paper, which has no limit under refinement; patch: rigid patch; "
        "cylinder: rigid cylinder",
    )
    radius: float | None = RADIUS
    friction: float = FRICTION

    @property
    def parts(self) -> tuple[Material, Load]:
        """Material and load."""
        load = Load(self.load, displacement=self.displacement, radius=self.radius, friction=self.friction)
        return Material(**self.model_dump(include=set(Material.model_fields), exclude_unset=True)), load
