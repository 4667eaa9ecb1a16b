"""Verification cases: measured numbers with their bounds."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from shutil import which

import numpy as np


@dataclass(frozen=True)
class Expectation:
    """Bounds of a number, and their text."""

    low: float
    high: float
    words: str


def about(value: float, tolerance: float) -> Expectation:
    """A value with an absolute tolerance."""
    return Expectation(value - tolerance, value + tolerance, f"{value:g} ± {tolerance:.2g}")


def between(low: float, high: float) -> Expectation:
    """Two bounds."""
    return Expectation(low, high, f"{low:g} to {high:g}")


def at_most(high: float) -> Expectation:
    """An upper bound of a number that cannot be negative."""
    return Expectation(0.0, high, f"at most {high:g}".replace("e-0", "e-"))


@dataclass(frozen=True)
class Row:
    """One measured number.

    Attributes:
        quantity: What was measured, with its unit if it has one.
        measured: The number.
        expected: Its bounds.
        degree: Of the elements.
        plane: "strain", "stress" or, for a body in three dimensions, "space".
        error: Relative error on the finest mesh, beside a slope.
    """

    quantity: str
    measured: float
    expected: Expectation
    degree: int = 2
    plane: str = "strain"
    error: float | None = None

    @property
    def passed(self) -> bool:
        """Whether the number is within its bounds; a NaN is not."""
        return self.expected.low <= self.measured <= self.expected.high

    @property
    def shown(self) -> str:
        """The number as text; a power of ten for one near rounding, which differs by machine."""
        if self.measured < 1e-6:
            return f"below 1e{np.ceil(np.log10(max(self.measured, 1e-12))):.0f}"
        number = f"{self.measured:#.5g}" if self.measured > 0.01 else f"{self.measured:.2g}"
        return number if self.error is None else f"{self.measured:.3f} (error {self.error:.1e})"


@dataclass(frozen=True)
class Case:
    """A boundary-value problem with a known answer.

    Attributes:
        name: A few words.
        answer: Kind of the known answer.
        measure: Solves it.
        needs: Program that it runs, if any.
    """

    name: str
    answer: str
    measure: Callable[[], tuple[Row, ...]]
    needs: str = ""

    @property
    def available(self) -> bool:
        """Whether the program that it needs is installed."""
        return not self.needs or which(self.needs) is not None

    @cache  # noqa: B019 - a handful of cases that live as long as the program
    def rows(self) -> tuple[Row, ...]:
        """The measured numbers, measured once."""
        return self.measure()


def slope_rows(
    errors: list[tuple[float, float]],
    degree: int,
    plane: str,
    displacement: Expectation,
    stress: Expectation,
    note: str = "",
) -> list[Row]:
    """Orders of convergence from the errors on the last two meshes, each twice as fine as the one before.

    Args:
        errors: Of the displacement in L2 and of the stress in the energy norm, mesh by mesh.
        degree: Of the elements.
        plane: "strain" or "stress".
        displacement: Bounds of the order in L2.
        stress: Bounds of the order in the energy norm.
        note: Added to the names.
    """
    names = ("slope of displacement, L2", "slope of stress, energy norm")
    return [
        Row(name + note, float(np.log2(coarse / fine)), expected, degree, plane, fine)
        for name, coarse, fine, expected in zip(names, *errors[-2:], (displacement, stress), strict=True)
    ]
