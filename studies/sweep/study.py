"""A parameter study as its file describes it."""

from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any, Literal, Self, TypeVar

from pydantic import Field, model_validator

from pinnray.geometry.finger.parameters import (
    SYMBOLS,
    CheckedModel,
    Parameters,
    bounded,
    parameter_info,
    unknown_parameter,
)
from pinnray.runtime.errors import UserError
from pinnray.runtime.text_files import read_toml
from pinnray.solvers.problem import Load, Material, Physics
from pinnray.solvers.registry import make_solver
from pinnray.solvers.solver import Solver, Traits, check_law, with_law

PHYSICS = tuple(Physics.model_fields)
"""Parameters of material and load."""

WHOLE = tuple(name for name, field in Parameters.model_fields.items() if field.annotation is int)
"""Parameters of a design that are whole numbers."""

MOST = 1_000_000
"""Largest number of samples of a study."""

Value = bool | int | float | str
T = TypeVar("T")


class Range(CheckedModel):
    """Values between two ends, or a list of choices.

    Attributes:
        low: Smallest value (`from` in the file).
        high: Largest value (`to`).
        step: Distance of the values, counted from `low`, such as that of a printer; None leaves any value.
        values: The choices instead.
    """

    low: float | None = Field(default=None, alias="from")
    high: float | None = Field(default=None, alias="to")
    step: float | None = Field(default=None, gt=0)
    values: tuple[Value, ...] | None = Field(default=None, min_length=1)

    @property
    def ends(self) -> tuple[float, float]:
        """Smallest and largest value, of numbers."""
        numbers = [float(each) for each in self.values or (self.low, self.high) if each is not None]
        return min(numbers), max(numbers)

    @model_validator(mode="after")
    def _one_kind(self) -> Self:
        ends = (self.low, self.high)
        if self.values is not None:
            if ends != (None, None) or self.step is not None:
                raise ValueError("give either values, or from and to")
            if len(set(map(repr, self.values))) < len(self.values):
                raise ValueError("a value is given twice")
        elif self.low is None or self.high is None:
            raise ValueError("give from and to, or values")
        elif self.low >= self.high:
            raise ValueError(f"from = {self.low:g} must be below to = {self.high:g}")
        elif self.step is not None and not 1 <= (self.high - self.low) / self.step <= MOST:
            raise ValueError(f"step = {self.step:g} must be shorter than the range, and not 0")
        return self


class Study(CheckedModel):
    """Fingers to sample, and the solver that judges them.

    Attributes:
        name: What pages and folders call it; the file's name by default.
        design: Preset or .toml file from which the fingers differ by the parameters below.
        solver: Name of the solver.
        settings: Its settings that differ from the default.
        mesh_size: Element size in walls and ribs, mm.
        density: Of the material, g/cm^3; the default is that of a printed polyurethane.
        time_limit: Time after which the work on a finger is stopped, s; None means no limit.
        sampling: `grid`: every combination; `sobol`: a scrambled Sobol sequence, which can be continued.
        samples: Number of samples, unless on a grid.
        strokes: Number of equal strokes up to the full one at which each sample's displacement field is kept,
            for `pinnray explore`; None keeps none. Needs a cylinder and `fem-nonlinear`.
        seed: Of the samples.
        fixed: Parameters with one value for all samples.
        varied: Parameters with a range of values, among them settings of the solver, such as
            `pinn-std.learning_rate`.
    """

    name: str = Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9._-]{0,47}$")
    design: str = "default"
    solver: str = "fem"
    settings: dict[str, Value] = Field(default_factory=dict)
    mesh_size: float = bounded(0.5, 0.02, 20, "Largest element in the walls and ribs", "mm")
    density: float = bounded(1.2, 1e-3, 30, "Density of the material", "g/cm^3")
    time_limit: float | None = bounded(None, 0.1, 1e6, "Longest time for a finger", "s")
    sampling: Literal["grid", "sobol"] = "sobol"
    samples: int | None = bounded(None, 1, MOST, "Number of samples")
    strokes: int | None = bounded(None, 2, 100, "Strokes at which a sample's field is kept")
    seed: int = bounded(0, 0, 2**32 - 1, "Seed of the samples")
    fixed: dict[str, Value] = Field(default_factory=dict)
    varied: dict[str, Range]

    @classmethod
    def load(cls, path: Path) -> Self:
        """The one in a TOML file.

        Raises:
            UserError: If it cannot be read, or something in it is wrong.
        """
        kind = cls.__name__.lower()
        content = read_toml(path, kind)
        try:
            return cls(**{"name": path.stem, **content})
        except UserError as error:
            raise UserError(f"{kind} {path}: {error}") from None

    @model_validator(mode="before")
    @classmethod
    def _ranges(cls, values: Any) -> Any:
        if not isinstance(values, Mapping):
            return values
        read = dict(values)
        for group in ("fixed", "varied"):
            entries = read.get(group, {})
            if not isinstance(entries, Mapping):
                raise ValueError(f"[{group}] must be a table of parameters")
            read[group] = {SYMBOLS.get(name, name): entry for name, entry in entries.items()}
        if not read["varied"]:
            raise ValueError(
                "nothing is varied; give a table [varied], such as rib_count = {from = 2, to = 6}"
            )
        read["varied"] = {name: _range(name, entry) for name, entry in read["varied"].items()}
        return read

    @model_validator(mode="after")
    def _fits(self) -> Self:
        settings = self.settings_of(self.varied)
        known = {*PHYSICS, *Parameters.model_fields} - {"name"}
        for name in (*self.fixed, *self.varied):
            if name not in known and name.removeprefix(f"{self.solver}.") not in settings:
                hint = unknown_parameter(name, Parameters)
                raise ValueError(f"{hint}; of material and load there are {', '.join(PHYSICS)}")
        if both := sorted(self.fixed.keys() & self.varied.keys()):
            raise ValueError(f"{both[0]} is both fixed and varied; give it once")
        for name, values in self.varied.items():
            _check_range(name, values, self.sampling)
        if self.sampling == "grid":
            if self.samples is not None:
                raise ValueError("a grid has no samples to choose; leave samples out")
        elif self.samples is None:
            raise ValueError(f"sampling = {self.sampling}: give the number of samples, such as samples = 256")
        if self.strokes is not None:
            self._check_fields()
        ends = {name: (values.values or (values.low,))[0] for name, values in settings.items()}
        solver = self.made_solver({name: value for name, value in ends.items() if value is not None})
        laws = self.varied["law"].values if "law" in self.varied else None
        for law in laws or [self.fixed[name] for name in self.fixed if name == "law"]:
            check_law([solver], physics_of({"law": law})[0])
        for names in (PHYSICS, ("law", "plane")):  # where one varies, a sample that does not fit is refused
            if not self.varied.keys() & names:
                said = {name: value for name, value in self.fixed.items() if name in names}
                with_law(physics_of(said)[0], solver)
        return self

    def _check_fields(self) -> None:
        """Refuse what fields on one moving mesh do not allow."""
        if self.solver != "fem-nonlinear" or self.fixed.get("load") != "cylinder":
            raise ValueError("strokes: fields need solver = 'fem-nonlinear' and load = 'cylinder' fixed")
        if "stroke" in self.varied:
            raise ValueError("strokes: every sample goes to the full stroke; give stroke under [fixed]")
        choices = [name for name, each in self.varied.items() if name in WHOLE or each.values is not None]
        if choices:
            raise ValueError(
                f"strokes: {choices[0]} is a choice, between which no mesh moves; make a study of each"
            )

    @property
    def middle(self) -> dict[str, float]:
        """The middle of every range of numbers."""
        return {name: sum(each.ends) / 2 for name, each in self.varied.items() if each.low is not None}

    @property
    def settings_alone(self) -> bool:
        """Whether only settings of the solver are varied."""
        return len(self.settings_of(self.varied)) == len(self.varied)

    def settings_of(self, values: Mapping[str, T]) -> dict[str, T]:
        """Entries that belong to settings of the solver, by the settings' names."""
        own = f"{self.solver}."
        return {name.removeprefix(own): value for name, value in values.items() if name.startswith(own)}

    def made_solver(self, settings: Mapping[str, Value] = MappingProxyType({})) -> Solver:
        """The solver with its settings, of which some may be those of a sample."""
        solver = make_solver(self.solver, **{**self.settings, **settings})
        if Traits.of(solver).assimilates:
            raise UserError(f"solver {self.solver} needs measured markers, which a study does not have")
        return solver


def physics_of(values: Mapping[str, Any]) -> tuple[Material, Load]:
    """Material and load of a sample, from its values of `PHYSICS` among others.

    Raises:
        UserError: If they do not go together.
    """
    return Physics(**{name: value for name, value in values.items() if name in PHYSICS}).parts


def title(name: str) -> str:
    """A parameter's name with its unit, for headings: `rib_thickness_mm`."""
    unit = unit_of(name)
    return f"{name}_{unit}" if unit else name


def unit_of(name: str) -> str:
    """Unit of a parameter; empty where it has none."""
    return str(parameter_info(name, "unit") or parameter_info(name, "unit", Physics))


def _range(name: str, entry: Any) -> Range:
    """The values of a varied parameter as a file gives them."""
    if isinstance(entry, Range):
        return entry
    if not isinstance(entry, Mapping):
        raise ValueError(
            f"varied.{name}: write {{from = LOW, to = HIGH}} or {{values = [...]}}, not {entry!r}"
        )
    keys = [field.alias or key for key, field in Range.model_fields.items()]
    if unknown := [key for key in entry if key not in keys]:
        raise ValueError(f"varied.{name}: unknown key {unknown[0]!r}; there are {', '.join(keys)}")
    try:
        return Range(**entry)
    except UserError as error:
        raise ValueError(f"varied.{name}: {error}") from None


def _check_range(name: str, values: Range, sampling: str) -> None:
    """Refuse values that the parameter or the sampling does not have."""
    if values.values is None:
        if name in ("plane", "law", "load", "slide", "rib_reference", "marker_layout"):
            raise ValueError(f"{name} has no numbers between two others; give values = [...]")
        for end in () if "." in name else (values.low, values.high):
            model = Parameters if name in Parameters.model_fields else Physics
            low, high = (float(parameter_info(name, limit, model)) for limit in ("low", "high"))
            if end is not None and not low <= end <= high:
                raise ValueError(
                    f"{name} = {end:g} is outside its range, {low:g} to {high:g} {unit_of(name)}"
                )
        if sampling == "grid" and not (values.step or name in WHOLE):
            raise ValueError(f"{name}: a grid needs the distance of the values, such as step = 5")
        numbers = (values.low or 0, values.high or 0, values.step or 1)
        if name in WHOLE and not all(float(number).is_integer() for number in numbers):
            raise ValueError(f"{name} is a whole number; give whole ends and steps")
