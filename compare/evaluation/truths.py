"""Simulated truths: what differs from the drawn finger and the load that the solvers know.

A truth is richer than the linear models that are judged by it: finite strain, a sliding indenter, other
walls, laws and loads. The distance of those models from it is of the size and pattern of the paper's gap
between simulation and experiment.
"""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from math import isfinite, radians, tan

from pinnray.geometry.finger.design import Design
from pinnray.geometry.finger.finger import Finger
from pinnray.geometry.finger.section import rib_feet, rib_pitch, rib_slope
from pinnray.runtime.errors import UserError
from pinnray.solvers.elasticity import LawName
from pinnray.solvers.problem import Load, LoadKind, Material

EVERY_TRUTH = "all"
"""The name that stands for every truth."""

LAWS: Mapping[str, tuple[LawName, ...]] = {
    "fem-nonlinear": ("neo-hookean", "st-venant-kirchhoff", "gent"),
    "fem-3d": ("neo-hookean", "st-venant-kirchhoff"),
}
"""Laws of finite strain of the solvers that simulate; here too, since the solvers need DOLFINx."""

WALLS = ("front_thickness", "back_thickness", "rib_thickness", "base_thickness")
"""Walls that can be thicker or thinner than drawn: those of `WallMotion`."""


@dataclass(frozen=True)
class Truth:
    """A simulated finger and its load, as they differ from the drawn finger and the load of the solvers.

    Attributes:
        name: Its name in tables.
        description: Law, walls and load in words; `{:.4g}` stands for the stroke, mm.
        law: Law of finite strain, in plane strain.
        poisson: Poisson's ratio; that of the material if None.
        scaled: Factors of wall thicknesses, by their names in `Design`.
        thicker: Additions to wall thicknesses, mm, by their names in `Design`.
        radius: Radius of a rigid cylinder, mm; a patch of the contact's width if None.
        friction: Coefficient of friction of the cylinder.
        farther: Its stroke over the one that is asked for; solvers are given the longer one.
        slope: Displacement of the indenter along the front over the stroke; None lets a patch slide.
        solid: Whether the finger has its depth, with side faces free of traction, of which one is seen; else
            it is in plane strain.

    Raises:
        UserError: If no solver has the law, a wall does not exist or keeps no thickness, a constant of the
            material or the load cannot be, or the name or the description cannot be shown.
    """

    name: str
    description: str
    law: LawName = "neo-hookean"
    poisson: float | None = None
    scaled: Mapping[str, float] = field(default_factory=dict)
    thicker: Mapping[str, float] = field(default_factory=dict)
    radius: float | None = None
    friction: float = 0.0
    farther: float = 1.0
    slope: float | None = None
    solid: bool = False

    def __post_init__(self) -> None:
        try:
            self._check()
        except UserError as error:
            raise UserError(f"truth {self.name}: {error}") from None

    def _check(self) -> None:
        if not re.fullmatch(r"[a-z0-9][a-z0-9-]*", self.name) or self.name == EVERY_TRUTH:
            raise UserError(f"a name has small letters, digits and '-', and {EVERY_TRUTH} is taken")
        try:
            self.description.format(1.0)
        except (LookupError, ValueError, AttributeError):
            raise UserError(
                "in its description, write {:.4g} once for the stroke and no other braces"
            ) from None
        if self.law not in LAWS[self.solver]:
            raise UserError(f"{self.solver} has no law {self.law!r}; it has {', '.join(LAWS[self.solver])}")
        for name, value in (*self.scaled.items(), *self.thicker.items()):
            if name not in WALLS:
                raise UserError(f"there is no wall {name!r}; there are {', '.join(WALLS)}")
            if not isfinite(value) or (name in self.scaled and self.scaled[name] <= 0):
                raise UserError(f"{name}: {value:g}: give a factor above 0, or an addition in mm")
        if self.radius is not None and self.slope is None:
            raise UserError("a cylinder does not slide freely; give its slope, such as 0, and its friction")
        if not (isfinite(self.farther) and self.farther > 0):
            raise UserError(f"farther {self.farther:g}: give a factor of the stroke above 0")
        self.material(Material())
        self.load(1.0)

    @property
    def solver(self) -> str:
        """Name of the solver that simulates it."""
        return "fem-3d" if self.solid else "fem-nonlinear"

    @property
    def finer(self) -> float:
        """Element size over that of the shared mesh; through the depth elements are costly."""
        return 1.5 if self.solid else 0.5

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
            raise UserError(
                f"truth {self.name}: {drawn.name} is a drawing, whose walls have no parameters to change; "
                f"it can have {_keeping_walls()}"
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
        poisson = material.poisson if self.poisson is None else self.poisson
        return Material(young=material.young, poisson=poisson, law=self.law).made_of(material.substance)

    def reached(self, load: Load) -> Load:
        """A load with the stroke that it asks for made `farther`."""
        displacement = tuple(None if value is None else self.farther * value for value in load.displacement)
        return load.model_copy(update={"displacement": displacement})

    def load(self, stroke: float) -> Load:
        """Its load for its own stroke into the finger, mm."""
        along = None if self.slope is None else self.slope * stroke
        kind: LoadKind = "patch" if self.radius is None else "cylinder"
        return Load(kind, displacement=(along, -stroke), radius=self.radius, friction=self.friction)


_PRINTED = {"front_thickness": 1.05, "back_thickness": 0.95, "rib_thickness": 1.05}
_THICK_BASE = {"base_thickness": 1.0}

_PATCH = "contact patch that is pressed in by {:.4g} mm"
_SLIDES = f"{_PATCH} and slides along x"
_CYLINDER = "rigid cylinder of radius {} mm without friction that is pressed in by {{:.4g}} mm"
_ROUGH = _CYLINDER.replace("without friction", "with friction {}")
_WALLS = "front wall and ribs printed 5 % thicker"
_BASE = f"{_WALLS}, back wall 5 % thinner and base wall 1 mm thicker than drawn"

SLIDING = Truth("sliding", f"neo-Hookean, finite strain, plane strain, {_SLIDES}")
"""The truth of every virtual experiment that names no other."""

_TRUTHS = (
    SLIDING,
    Truth("stvk", f"St Venant-Kirchhoff, {_SLIDES}", law="st-venant-kirchhoff"),
    Truth("gent", f"Gent, which stiffens, {_SLIDES}", law="gent"),
    Truth("print", f"neo-Hookean, {_WALLS} and back wall 5 % thinner than drawn, {_SLIDES}", scaled=_PRINTED),
    Truth("base", f"neo-Hookean, {_BASE}, {_SLIDES}", scaled=_PRINTED, thicker=_THICK_BASE),
    Truth("cylinder", f"neo-Hookean, {_CYLINDER.format(10)}", radius=10.0, slope=0.0),
    Truth(
        "oblique",
        f"neo-Hookean, {_CYLINDER.format(20)} and moves 0.3 times as far towards the tip",
        radius=20.0,
        slope=0.3,
    ),
    Truth(
        "mixed",
        f"St Venant-Kirchhoff with Poisson's ratio 0.42, {_BASE}, {_CYLINDER.format(10)}",
        law="st-venant-kirchhoff",
        poisson=0.42,
        scaled=_PRINTED,
        thicker=_THICK_BASE,
        radius=10.0,
        slope=0.0,
    ),
    Truth(
        "friction",
        f"neo-Hookean, {_PATCH} and that friction holds half way between sliding and sticking",
        slope=-0.07,
    ),
    Truth("rubbing", f"neo-Hookean, {_ROUGH.format(10, 0.5)}", radius=10.0, friction=0.5, slope=0.0),
    Truth(
        "3d", f"neo-Hookean finger in three dimensions, of which the side face is seen, {_SLIDES}", solid=True
    ),
    Truth(
        "3d-cylinder",
        f"neo-Hookean finger in three dimensions, of which the side face is seen, {_CYLINDER.format(10)}",
        radius=10.0,
        slope=0.0,
        solid=True,
    ),
    Truth(
        "3d-rubbing",
        f"neo-Hookean finger in three dimensions, of which the side face is seen, {_ROUGH.format(10, 0.5)}",
        radius=10.0,
        friction=0.5,
        slope=0.0,
        solid=True,
    ),
    Truth("wide", f"neo-Hookean, {_ROUGH.format(25, 0.9)}", radius=25.0, friction=0.9, slope=0.0),
    Truth(
        "limit",
        f"neo-Hookean, {_CYLINDER.format(10)}, beyond its largest force",
        radius=10.0,
        farther=2.2,
        slope=0.0,
    ),
    Truth("sticking", f"neo-Hookean, {_PATCH}, sticks and cannot turn", slope=0.0),
)
TRUTHS: Mapping[str, Truth] = {truth.name: truth for truth in _TRUTHS}
"""Every truth by name."""
if len(TRUTHS) < len(_TRUTHS):
    raise UserError(f"two truths have one name: {', '.join(truth.name for truth in _TRUTHS)}")


def check_truths(names: Sequence[str], drawn: Finger) -> None:
    """Raise a `UserError` if a truth does not exist, is named twice, or cannot have the finger."""
    if unknown := next((name for name in names if name not in TRUTHS), None):
        raise UserError(f"there is no truth {unknown!r}; there are all, {', '.join(TRUTHS)}")
    if not names or len(set(names)) < len(names):
        raise UserError(f"truth: name at least one of {', '.join(TRUTHS)}, none twice")
    for name in names:
        TRUTHS[name].finger(drawn)


def check_walls(truth: Truth) -> None:
    """Raise a `UserError` if a truth has other walls than the drawn finger."""
    if not truth.keeps_walls:
        raise UserError(
            f"truth {truth.name}: its walls are not those of the drawing, so that fields cannot be "
            f"compared point by point; take {_keeping_walls()}, or cross-validate with it"
        )


def _keeping_walls() -> str:
    return ", ".join(name for name, truth in TRUTHS.items() if truth.keeps_walls)
