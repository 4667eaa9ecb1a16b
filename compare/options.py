"""Options that several commands share, and the objects that they stand for."""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from math import inf
from pathlib import Path
from typing import Annotated, Literal

from cyclopts import Group, Parameter
from pydantic import ValidationError

from geometry.design import Design
from geometry.errors import UserError
from geometry.presets import load_design, parse_overrides
from geometry.settings import MeshSettings
from solvers.problem import Load, Material
from solvers.registry import make_solver
from solvers.solver import Solver

FINGER = Group("Finger", sort_key=1)
PHYSICS = Group("Physics", sort_key=2)


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
        float, Parameter(help="Elements in walls and ribs, mm; up to 4 times larger in the tip.")
    ] = 0.25

    def read(self) -> tuple[Design, MeshSettings]:
        """The design and the mesh settings."""
        changes = parse_overrides(self.set)
        design = load_design(self.design, changes)
        if changes and "name" not in changes:  # another finger, so another name and output folder
            design = design.replaced(name=_changed_name(design, changes))
        try:
            return design, MeshSettings(size=self.mesh_size)
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
    load: Annotated[
        Literal["mean", "point", "patch"],
        Parameter(
            help="mean: weighted mean displacement of the contact; point: the paper's, whose limit under "
            "refinement does not exist; patch: rigid."
        ),
    ] = "mean"
    stroke: Annotated[float, Parameter(help="How far the indenter presses, mm.")] = 10.0
    slide: Annotated[
        bool,
        Parameter(negative="", show_default=False, help="Let the contact slide along the finger: u free."),
    ] = False

    def read(self) -> tuple[Material, Load]:
        """The material and the load."""
        if not 0 < self.stroke < inf:
            raise UserError(f"--stroke {self.stroke:g}: the indenter presses; give its travel, above 0 mm")
        if self.young == inf:
            raise UserError("--young inf: a rigid finger does not bend; give a finite Young's modulus, MPa")
        try:
            return (
                Material(young=self.young, poisson=self.poisson, plane=self.plane),
                Load(kind=self.load, displacement=(None if self.slide else 0.0, -self.stroke)),
            )
        except ValidationError as error:
            first = error.errors()[0]
            raise UserError(f"--{first['loc'][0]} {first['input']}: {first['msg'].lower()}") from None


def read_solvers(names: str, settings: tuple[str, ...], seed: int) -> list[Solver]:
    """Solvers from a list of names with commas and settings such as `pinn-std.units=300`.

    Raises:
        UserError: If a solver or setting does not exist or a text cannot be read.
    """
    if seed < 0:
        raise UserError(f"--seed {seed}: give a whole number from 0")
    chosen = [name.strip() for name in names.split(",") if name.strip()]
    given: dict[str, dict[str, object]] = {name: {} for name in chosen}
    for setting in settings:
        target, dot, rest = setting.partition(".")
        key, equals, value = rest.partition("=")
        if not (dot and equals and key and value):
            raise UserError(
                f"cannot read {setting!r}; write solver.setting=value, such as pinn-std.units=300"
            )
        if target not in given:
            raise UserError(f"{setting!r} is for {target!r}, which is not among the solvers {names}")
        if key in given[target]:
            raise UserError(f"{target}.{key} is set twice; set it once")
        given[target][key] = value
    solvers = []
    for name in chosen:
        try:
            solver = make_solver(name, **given[name])
            if "seed" in solver.settings() and "seed" not in given[name]:
                solver = make_solver(name, **given[name], seed=seed)
        except ImportError as error:
            raise UserError(f"solver {name!r} cannot be loaded: {error}") from None
        solvers.append(solver)
    return solvers


def existing(path: Path | None) -> Path | None:
    """The path, refused if there is no such file."""
    if path is not None and not path.is_file():
        raise UserError(f"there is no file {path}")
    return path
