"""Simulated truths with other laws, walls and loads than the solvers that are judged by them."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from math import radians, tan

from geometry.errors import UserError
from geometry.finger.design import Design
from geometry.finger.finger import Finger
from geometry.finger.section import rib_feet, rib_pitch, rib_slope
from solvers.elasticity import LawName
from solvers.problem import Load, Material

FINER, FINER_SOLID = 0.5, 1.5
"""Element sizes of truths over that of the shared mesh: in the plane, and through the depth."""


@dataclass(frozen=True, kw_only=True)
class Truth:
    """A simulated finger and its load, as they differ from the drawn finger and the load of the solvers.

    Attributes:
        name: Its name on the command line and in tables.
        description: Law, walls and load in words; `{:.4g}` stands for the stroke, mm.
        law: Law of finite strain, in plane strain.
        poisson: Poisson's ratio; None for that of the material.
        scaled: Factors of wall thicknesses, by their names in `Design`.
        thicker: Additions to wall thicknesses, mm, by their names in `Design`.
        radius: Radius of a rigid cylinder without friction, mm; None for a patch of the contact's width.
        slope: Displacement of the indenter along the front over the stroke; None lets a patch slide.
        solid: Whether the finger has its depth, with side faces free of traction, of which one is seen; else
            it is in plane strain.
    """

    name: str
    description: str
    law: LawName = "neo-hookean"
    poisson: float | None = None
    scaled: Mapping[str, float] = field(default_factory=dict)
    thicker: Mapping[str, float] = field(default_factory=dict)
    radius: float | None = None
    slope: float | None = None
    solid: bool = False

    @property
    def solver(self) -> str:
        """The solver that simulates it."""
        return "fem-3d" if self.solid else "fem-nonlinear"

    @property
    def finer(self) -> float:
        """Element size over that of the shared mesh."""
        return FINER_SOLID if self.solid else FINER

    @property
    def simulation(self) -> str:
        """Solver and elements that simulate it, in words."""
        return f"{self.solver} on elements of {self.finer:g} times the size"

    @property
    def keeps_walls(self) -> bool:
        """Whether its walls are as thick as drawn."""
        return not (self.scaled or self.thicker)

    def changes(self, drawn: Finger) -> dict[str, float]:
        """Changes of the wall thicknesses of a drawn finger, mm, by their names in `Design`.

        Raises:
            UserError: If the walls change and the finger has no parameters.
        """
        if self.keeps_walls:
            return {}
        if not isinstance(drawn, Design):
            possible = ", ".join(name for name, truth in TRUTHS.items() if truth.keeps_walls)
            raise UserError(
                f"truth {self.name}: {drawn.name} is a drawing, whose walls have no parameters to change; "
                f"it can have {possible}"
            )
        return {
            name: (self.scaled.get(name, 1.0) - 1.0) * getattr(drawn, name) + self.thicker.get(name, 0.0)
            for name in (*self.scaled, *self.thicker)
        }

    def finger(self, drawn: Finger) -> Finger:
        """The finger with its walls, whose ribs have the axes of the drawn ones.

        Raises:
            UserError: If the finger has no parameters, or cannot have such walls.
        """
        changes = self.changes(drawn)
        if not changes or not isinstance(drawn, Design):
            return drawn
        values: dict[str, float] = {name: getattr(drawn, name) + change for name, change in changes.items()}
        if drawn.rib_count:  # given, because the foot lies on the inner face and the pitch follows the walls
            deeper = changes.get("front_thickness", 0.0)
            values["rib_start"] = float(rib_feet(drawn)[0]) + deeper * tan(radians(rib_slope(drawn)))
            values["rib_pitch"] = rib_pitch(drawn)
        try:
            return drawn.replaced(**values)
        except UserError as error:
            raise UserError(f"truth {self.name}: {error}") from None

    def material(self, material: Material) -> Material:
        """The material with its law and Poisson's ratio."""
        own = {} if self.poisson is None else {"poisson": self.poisson}
        return material.model_copy(update={"law": self.law, "plane": "strain", **own})

    def load(self, stroke: float) -> Load:
        """Its load for a stroke into the finger, mm."""
        along = None if self.slope is None else self.slope * stroke
        if self.radius is None:
            return Load(kind="patch", displacement=(along, -stroke))
        return Load(kind="cylinder", displacement=(along, -stroke), radius=self.radius)


SLIDING = Truth(
    name="sliding",
    description=(
        "neo-Hookean, finite strain, plane strain, contact patch that is pressed in by {:.4g} mm and slides "
        "along x"
    ),
)
"""The truth of every virtual experiment that names no other."""

_PRINTED = {"front_thickness": 1.05, "back_thickness": 0.95, "rib_thickness": 1.05}
_THICK_BASE = {"base_thickness": 1.0}

TRUTHS: Mapping[str, Truth] = {
    truth.name: truth
    for truth in (
        SLIDING,
        Truth(
            name="stvk",
            law="st-venant-kirchhoff",
            description=(
                "St Venant-Kirchhoff, contact patch that is pressed in by {:.4g} mm and slides along x"
            ),
        ),
        Truth(
            name="gent",
            law="gent",
            description=(
                "Gent, which stiffens, contact patch that is pressed in by {:.4g} mm and slides along x"
            ),
        ),
        Truth(
            name="print",
            scaled=_PRINTED,
            description=(
                "neo-Hookean, front wall and ribs printed 5 % thicker and back wall 5 % thinner than drawn, "
                "contact patch that is pressed in by {:.4g} mm and slides along x"
            ),
        ),
        Truth(
            name="base",
            scaled=_PRINTED,
            thicker=_THICK_BASE,
            description=(
                "neo-Hookean, front wall and ribs printed 5 % thicker, back wall 5 % thinner and base wall "
                "1 mm thicker than drawn, contact patch that is pressed in by {:.4g} mm and slides along x"
            ),
        ),
        Truth(
            name="cylinder",
            radius=10.0,
            slope=0.0,
            description=(
                "neo-Hookean, rigid cylinder of radius 10 mm without friction that is pressed in by {:.4g} mm"
            ),
        ),
        Truth(
            name="oblique",
            radius=20.0,
            slope=0.3,
            description=(
                "neo-Hookean, rigid cylinder of radius 20 mm without friction that is pressed in by {:.4g} "
                "mm and moves 0.3 times as far towards the tip"
            ),
        ),
        Truth(
            name="mixed",
            law="st-venant-kirchhoff",
            poisson=0.42,
            scaled=_PRINTED,
            thicker=_THICK_BASE,
            radius=10.0,
            slope=0.0,
            description=(
                "St Venant-Kirchhoff with Poisson's ratio 0.42, front wall and ribs printed 5 % thicker, "
                "back wall 5 % thinner and base wall 1 mm thicker than drawn, rigid cylinder of radius 10 mm "
                "without friction that is pressed in by {:.4g} mm"
            ),
        ),
        Truth(
            name="friction",
            slope=-0.07,
            description=(
                "neo-Hookean, contact patch that is pressed in by {:.4g} mm and that friction "
                "holds half way between sliding and sticking"
            ),
        ),
        Truth(
            name="3d",
            solid=True,
            description=(
                "neo-Hookean finger in three dimensions, of which the side face is seen, contact patch that "
                "is pressed in by {:.4g} mm and slides along x"
            ),
        ),
        Truth(
            name="sticking",
            slope=0.0,
            description="neo-Hookean, contact patch that is pressed in by {:.4g} mm, sticks and cannot turn",
        ),
    )
}
"""Every truth by name."""


def check_truths(names: Sequence[str], drawn: Finger) -> None:
    """Raise a `UserError` if a truth does not exist, is named twice, or is not for a finger."""
    if unknown := next((name for name in names if name not in TRUTHS), None):
        raise UserError(f"there is no truth {unknown!r}; there are all, {', '.join(TRUTHS)}")
    if not names or len(set(names)) < len(names):
        raise UserError(f"truth: name at least one of {', '.join(TRUTHS)}, none twice")
    for name in names:
        TRUTHS[name].finger(drawn)


def check_walls(truth: Truth) -> None:
    """Raise a `UserError` if a truth has other walls than the drawn finger."""
    if not truth.keeps_walls:
        possible = ", ".join(name for name, each in TRUTHS.items() if each.keeps_walls)
        raise UserError(
            f"truth {truth.name}: its walls are not those of the drawing, so that fields cannot be "
            f"compared point by point; take {possible}, or cross-validate with it"
        )
