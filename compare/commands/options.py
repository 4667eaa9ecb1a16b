"""Options that several commands share, and the objects that they stand for."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import cos, inf, radians, sin
from pathlib import Path
from typing import Annotated, Literal

from cyclopts import Group, Parameter
from pydantic import ValidationError

from compare.commands.preset_jobs import job_defaults
from geometry.errors import UserError
from geometry.finger.design import Design
from geometry.finger.presets import load_design, parse_overrides
from geometry.mesh.settings import MeshSettings
from solvers.elasticity import LawName
from solvers.problem import Load, Material
from solvers.registry import PRESETS, make_solver
from solvers.solver import Solver

RADIUS = 5.0
"""Of a cylinder for which none is given, mm."""

FINGER = Group("Finger", sort_key=1)
PHYSICS = Group("Physics", sort_key=2)
TRAINING = Group("Solvers' settings", sort_key=3)
OUTPUT = Group("Output", sort_key=4, default_parameter=Parameter(negative="", show_default=False))


Adapt = Annotated[
    float | None,
    Parameter(
        group=FINGER,
        show_default=False,
        help="Refine the mesh until fem knows the displacements of the markers to this, mm, by its own "
        "estimate of its error.",
    ),
]
"""An option of the commands that solve on the mesh that they make."""


@Parameter(name="*", group=FINGER)
@dataclass(frozen=True, kw_only=True)
class FingerOptions:
    """Which finger, and how it is meshed."""

    design: Annotated[str, Parameter(help="A preset (default, slender, ...) or a .toml file.")] = "default"
    set: Annotated[
        tuple[str, ...],
        Parameter(
            negative="",
            show_default=False,
            help="Change a parameter, as in --set rib_count=6 or N=6; may be repeated.",
        ),
    ] = ()
    mesh_size: Annotated[
        float | None,
        Parameter(help="Elements in walls and ribs, mm; up to 4 times larger in the tip; 0.25 if not given."),
    ] = None

    def read(self, preset: str | None = None) -> tuple[Design, MeshSettings]:
        """The design and the mesh settings, which a preset of the solvers may have of its own."""
        changes = parse_overrides(self.set)
        design = load_design(self.design, changes)
        if changes and "name" not in changes:  # another finger, so another name and output folder
            design = design.replaced(name=_changed_name(design, changes))
        settings = job_defaults(preset).mesh.model_dump()
        if self.mesh_size is not None:
            settings["size"] = self.mesh_size
        try:
            return design, MeshSettings(**settings)
        except UserError as error:
            raise UserError(f"--mesh-{error}") from None


def _changed_name(design: Design, changes: Mapping[str, object]) -> str:
    """The preset's name with the changes, of the letters and the length that a name may have."""
    parts = (f"-{name}-{value}" for name, value in changes.items())
    name = design.name + re.sub(r"[^A-Za-z0-9._-]", "", "".join(parts))
    return name if len(name) <= 64 else f"{name[:55]}-{design.digest[:8]}"


@Parameter(name="*", group=PHYSICS)
@dataclass(frozen=True, kw_only=True)
class PhysicsOptions:
    """Material and load."""

    young: Annotated[float, Parameter(help="Young's modulus, MPa.")] = 11.4
    poisson: Annotated[float, Parameter(help="Poisson's ratio.")] = 0.45
    plane: Annotated[
        Literal["strain", "stress"], Parameter(help="Plane strain, or plane stress as the paper's equations.")
    ] = "strain"
    law: Annotated[
        LawName | None,
        Parameter(
            show_default=False, help="Material law of the solvers that have it; each solver's usual one."
        ),
    ] = None
    load: Annotated[
        Literal["mean", "point", "patch", "cylinder"] | None,
        Parameter(
            help="mean: weighted mean displacement of the contact, the default; point: the paper's, whose "
            "limit under refinement does not exist; patch: rigid; cylinder: rigid, frictionless."
        ),
    ] = None
    radius: Annotated[
        float | None, Parameter(show_default=False, help="Of --load cylinder, mm; 5 if not given.")
    ] = None
    stroke: Annotated[float, Parameter(help="How far the indenter presses, mm.")] = 10.0
    direction: Annotated[
        float,
        Parameter(help="Where it presses to: 0 straight into the finger, 90 along it to the tip, degrees."),
    ] = 0.0
    slide: Annotated[
        bool,
        Parameter(negative="", show_default=False, help="Let the contact slide along the finger: u free."),
    ] = False

    def read(self, preset: str | None = None) -> tuple[Material, Load]:
        """The material and the load, whose kind a preset of the solvers may choose."""
        if not 0 < self.stroke < inf:
            raise UserError(f"--stroke {self.stroke:g}: the indenter presses; give its travel, above 0 mm")
        if self.young == inf:
            raise UserError("--young inf: a rigid finger does not bend; give a finite Young's modulus, MPa")
        if not -90 < self.direction < 90:
            raise UserError(f"--direction {self.direction:g}: give an angle between -90 and 90 degrees")
        if self.slide and self.direction:
            raise UserError(
                "--slide leaves the travel along the finger free, so that --direction says nothing"
            )
        along, into = sin(radians(self.direction)), cos(radians(self.direction))
        kind = self.load or job_defaults(preset).load
        radius = RADIUS if kind == "cylinder" and self.radius is None else self.radius
        try:
            return (
                Material(young=self.young, poisson=self.poisson, plane=self.plane, law=self.law or "linear"),
                Load(
                    kind=kind,
                    displacement=(None if self.slide else self.stroke * along, -self.stroke * into),
                    radius=radius,
                ),
            )
        except ValidationError as error:
            first = error.errors()[0]
            said = first["msg"].removeprefix("Value error, ")
            if not first["loc"]:  # a rule between options
                raise UserError(said) from None
            raise UserError(f"--{first['loc'][0]} {first['input']}: {said.lower()}") from None

    def check_law(self, solvers: Sequence[Solver]) -> None:
        """Refuse a law that none of the solvers has."""
        if self.law is not None and not any(self.law in solver.laws for solver in solvers):
            known = "; ".join(f"{solver.name} has {', '.join(solver.laws)}" for solver in solvers)
            raise UserError(f"--law {self.law}: none of the solvers has it ({known})")


@Parameter(name="*", group=TRAINING)
@dataclass(frozen=True, kw_only=True)
class SolverOptions:
    """Settings of the solvers that are named elsewhere."""

    preset: Annotated[
        str | None,
        Parameter(
            show_default=False,
            help="Of pinn-std and pinn-asm. fast, the default: networks with random hidden weights whose "
            "output layer is solved exactly. paper: the paper's networks and training, and its problem: a "
            "uniform mesh of 91,006 nodes and --load point, unless --mesh-size or --load is given. On a "
            "CPU its 60,000 epochs take many hours.",
        ),
    ] = None
    solver_set: Annotated[
        tuple[str, ...],
        Parameter(
            negative="",
            show_default=False,
            help="Change a solver's setting, as in --solver-set pinn-std.neurons=7; may be repeated.",
        ),
    ] = ()
    device: Annotated[
        str | None,
        Parameter(show_default=False, help="cpu or cuda, for the solvers that can choose."),
    ] = None
    seed: Annotated[int, Parameter(help="Of every solver that draws random numbers.")] = 0

    def read(self, names: str) -> list[Solver]:
        """The solvers with these names, commas between them.

        Raises:
            UserError: If a solver, preset or setting does not exist or a text cannot be read.
        """
        if self.seed < 0:
            raise UserError(f"--seed {self.seed}: give a whole number from 0")
        chosen = [name.strip() for name in names.split(",") if name.strip()]
        given = _settings(chosen, self.solver_set)
        if self.preset is not None:
            having = [name for name in given if self.preset in PRESETS.get(name, ())]
            if not having:
                known = "; ".join(f"{name} has {', '.join(presets)}" for name, presets in PRESETS.items())
                raise UserError(f"--preset {self.preset}: none of the solvers {names} has it ({known})")
            for name in having:
                given[name].setdefault("preset", self.preset)
        shared: dict[str, object] = {"seed": self.seed}
        if self.device is not None:
            shared["device"] = self.device
        solvers = [_made(name, given[name], shared) for name in chosen]
        if "device" in shared and not any("device" in solver.settings() for solver in solvers):
            raise UserError(f"--device {self.device}: none of the solvers {names} can choose a device")
        return solvers


def _settings(names: list[str], texts: tuple[str, ...]) -> dict[str, dict[str, object]]:
    """The settings of each solver from texts such as `pinn-std.neurons=7`."""
    given: dict[str, dict[str, object]] = {name: {} for name in names}
    for text in texts:
        target, dot, rest = text.partition(".")
        key, equals, value = rest.partition("=")
        if not (dot and equals and key and value):
            raise UserError(f"cannot read {text!r}; write solver.setting=value, such as pinn-std.neurons=7")
        if target not in given:
            raise UserError(f"{text!r} is for {target!r}, which is not among the solvers {', '.join(names)}")
        if key in given[target]:
            raise UserError(f"{target}.{key} is set twice; set it once")
        given[target][key] = value
    return given


def _made(name: str, given: Mapping[str, object], shared: Mapping[str, object]) -> Solver:
    """The solver with its own settings and, of the shared ones, those that it has."""
    try:
        solver = make_solver(name, **given)
        had = {key: value for key, value in shared.items() if key in solver.settings() and key not in given}
        return make_solver(name, **given, **had)
    except ImportError as error:
        raise UserError(f"solver {name!r} cannot be loaded: {error}") from None


def existing(path: Path | None) -> Path | None:
    """The path, refused if there is no such file."""
    if path is not None and not path.is_file():
        raise UserError(f"there is no file {path}")
    return path
