"""Objectives and constraints of an optimisation, as its file describes them."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, Literal, Self, TypeVar, cast

import numpy as np
from pydantic import Field, model_validator

from pinnray.geometry.finger.parameters import CheckedModel, bounded
from pinnray.runtime.arrays import FloatArray
from pinnray.solvers.finger_figures import QUANTITIES
from pinnray.studies.sweep.study import Study, Value

Sense = Literal["least", "largest"]
V = TypeVar("V", float, FloatArray)

ENOUGH = 12
"""Smallest number of converged runs to which the emulator is fitted, and of samples to start from."""

FEWEST = 20
"""Smallest number of solver runs: those samples, and a few proposals."""

GRIP: Mapping[str, Value] = MappingProxyType({"load": "cylinder", "friction": 0.5})
"""Load of a question with one objective: it asks for the best gripper, and an object has friction."""

NONLINEAR = "fem-nonlinear"
"""The solver that has this load."""


class Limit(CheckedModel):
    """Limits of a quantity.

    Attributes:
        at_least: Smallest allowed value; None means no limit.
        at_most: Largest allowed value.
    """

    at_least: float | None = None
    at_most: float | None = None

    @model_validator(mode="after")
    def _limits(self) -> Self:
        if self.at_least is None and self.at_most is None:
            raise ValueError("give at_least, at_most or both")
        return self

    @property
    def ends(self) -> list[float]:
        """The limits that there are."""
        return [end for end in (self.at_least, self.at_most) if end is not None]

    def excess(self, value: V) -> V:
        """How far a value, or each of an array, is beyond the limits; negative or zero within them."""
        low = -np.inf if self.at_least is None else self.at_least
        high = np.inf if self.at_most is None else self.at_most
        return cast(V, np.maximum(value - high, low - value))


class Question(Study):
    """A study with objectives and constraints; its samples are those that the search starts from.

    Attributes:
        objectives: One to three quantities, each to be the least or the largest. With one, and no load named,
            the finger grips a cylinder with friction; see `GRIP`.
        constraints: Limits of quantities.
        runs: Number of runs of the solver.
    """

    objectives: dict[str, Sense] = Field(default_factory=dict)
    constraints: dict[str, Limit] = Field(default_factory=dict)
    runs: int = bounded(120, FEWEST, 100_000, "Number of runs of the solver")

    @model_validator(mode="before")
    @classmethod
    def _start(cls, values: Any) -> Any:
        if not isinstance(values, Mapping):
            return values
        if said := [name for name in ("sampling", "samples") if name in values]:
            raise ValueError(f"{said[0]} belongs to a study; the search chooses its samples: give runs")
        objectives, fixed, varied = (
            each if isinstance(each := values.get(name), Mapping) else {}
            for name in ("objectives", "fixed", "varied")
        )
        usual: dict[str, object] = {}
        free = "load" not in {*fixed, *varied} and values.get("solver", NONLINEAR) == NONLINEAR
        if free and len(objectives) == 1:
            own = {name: value for name, value in GRIP.items() if name not in varied}
            usual = {"solver": NONLINEAR, "fixed": {**own, **fixed}}
        runs = values.get("runs", cls.model_fields["runs"].default)
        start = max(runs // 3, ENOUGH) if isinstance(runs, int) else ENOUGH
        return {**values, **usual, "sampling": "sobol", "samples": start}

    @model_validator(mode="after")
    def _known(self) -> Self:
        if not 1 <= len(self.objectives) <= 3:
            raise ValueError(
                f'objectives: give one, two or three quantities, such as force = "largest", not '
                f"{len(self.objectives)}"
            )
        for name in (*self.objectives, *self.constraints):
            if name not in QUANTITIES:
                raise ValueError(f"there is no quantity {name!r}; there are {', '.join(QUANTITIES)}")
        return self

    @property
    def wanted(self) -> str:
        """The objectives in words."""
        return " and ".join(f"{sense} {name}" for name, sense in self.objectives.items())

    @property
    def single(self) -> bool:
        """Whether there is one objective, so that fingers have an order in place of a front."""
        return len(self.objectives) == 1

    @property
    def heading(self) -> str:
        """The heading of its fingers."""
        return "Best fingers" if self.single else "Fingers on the front"

    @property
    def names(self) -> list[str]:
        """Quantities of the objectives and constraints, each once."""
        return list(dict.fromkeys((*self.objectives, *self.constraints)))

    def costs(self, values: Mapping[str, V]) -> list[V]:
        """The objectives as numbers, or arrays of them, of which the least is best."""
        return [
            values[name] if sense == "least" else -values[name] for name, sense in self.objectives.items()
        ]

    def excesses(self, values: Mapping[str, V]) -> list[V]:
        """How far each constrained quantity is beyond its limits; at most zero if it obeys them."""
        return [limit.excess(values[name]) for name, limit in self.constraints.items()]

    def allows(self, values: Mapping[str, float]) -> bool:
        """Whether every constraint is obeyed."""
        return all(excess <= 0 for excess in self.excesses(values))
