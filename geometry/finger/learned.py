"""Knowledge of a finger from its pictures: means, deviations and correlations of walls, clamp and modulus."""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Self

import numpy as np
from pydantic import Field, model_validator

from pinnray.geometry.finger.parameters import CheckedModel
from pinnray.runtime.arrays import FloatArray
from pinnray.runtime.atomic import atomic_path
from pinnray.runtime.errors import UserError
from pinnray.runtime.text_files import read_toml

TABLE = "learned"
"""Name of the table in the file of a design, or of a drawing's description."""
DIGITS, ROUNDING = 9, 1e-8
"""Digits of the numbers in a file, and the least eigenvalue of a correlation that rounding leaves."""


class Learned(CheckedModel):
    """A normal distribution of k unknowns of a finger, after pictures of it, and before.

    Values are those of `unknowns`, or their logarithms where the solver knows them to a factor.
    """

    pictures: int = Field(ge=1, description="Pictures that taught it")
    weighed: int = Field(default=0, ge=0, description="How many of them were of a press on a scale")
    unknowns: tuple[str, ...] = Field(
        min_length=1, description="Names, as in the table of docs/how-to/force.md"
    )
    mean: tuple[float, ...] = Field(description="Means after the pictures")
    deviation: tuple[float, ...] = Field(description="Standard deviations after the pictures")
    drawn_mean: tuple[float, ...] = Field(description="Means before")
    drawn_deviation: tuple[float, ...] = Field(description="Standard deviations before")
    correlation: tuple[tuple[float, ...], ...] = Field(description="Matrix (k, k), after the pictures")

    @model_validator(mode="after")
    def _fit_together(self) -> Self:
        count, correlation = len(self.unknowns), self.correlation
        for name in ("mean", "deviation", "drawn_mean", "drawn_deviation", "correlation"):
            if len(getattr(self, name)) != count:
                raise ValueError(
                    f"{TABLE}: {name} has {len(getattr(self, name))} values for {count} unknowns"
                )
        if min(*self.deviation, *self.drawn_deviation) <= 0:
            raise ValueError(f"{TABLE}: deviations are above zero")
        matrix = np.array(correlation) if {len(row) for row in correlation} == {count} else np.zeros((1, 1))
        if not np.allclose(matrix, matrix.T) or not np.linalg.eigvalsh(matrix).min() > -ROUNDING * count:
            raise ValueError(f"{TABLE}: correlation is a symmetric matrix without negative eigenvalues")
        if not np.allclose(np.diagonal(matrix), 1):
            raise ValueError(f"{TABLE}: the diagonal of correlation is one")
        return self

    def information(self, names: Sequence[str]) -> tuple[FloatArray, FloatArray]:
        """What the pictures say of k of the unknowns: a precision, shape (k, k), and it times a mean, (k,).

        They are the differences of those after the pictures and those before.
        """
        rows = [self.unknowns.index(name) for name in names]
        deviation, before = np.array(self.deviation)[rows], np.array(self.drawn_deviation)[rows] ** -2.0
        mean, drawn = np.array(self.mean)[rows], np.array(self.drawn_mean)[rows]
        correlation = np.array(self.correlation)[np.ix_(rows, rows)] + ROUNDING * np.eye(len(rows))
        after = np.linalg.inv(correlation * np.outer(deviation, deviation))
        # No direction is known less well than before, but for what was rounded or written by hand.
        scale = np.sqrt(before)
        sizes, directions = np.linalg.eigh((after - np.diag(before)) / np.outer(scale, scale))
        gained = directions * np.maximum(sizes, 0.0) @ directions.T * np.outer(scale, scale)
        return gained, (gained + np.diag(before)) @ mean - before * drawn


def read_learned(path: Path | None) -> Learned | None:
    """What a design's or description's file says of the finger; None without file or table.

    Raises:
        UserError: If the file cannot be read, or the table is not whole.
    """
    if path is None or not path.is_file():
        return None
    table = read_toml(path, "design file").get(TABLE)
    if table is None:
        return None
    needed = [name for name, field in Learned.model_fields.items() if field.is_required()]
    if missing := [name for name in needed if not isinstance(table, dict) or name not in table]:
        raise UserError(f"{path}: the table {TABLE} has no {missing[0]}; let it be learned anew")
    try:
        return Learned(**table)
    except UserError as error:
        raise UserError(f"{path}: {error}") from None


def check_target(path: Path) -> None:
    """Refuse a file for `write_learned` that is no .toml file, or holds something else.

    Raises:
        UserError: If it is refused.
    """
    if path.suffix != ".toml":
        raise UserError(f"learn {path}: give the name of a design file, such as my-finger.toml")
    if path.exists() and read_learned(path) is None:
        raise UserError(f"learn {path}: it holds a finger of which nothing was learned; name another file")


def write_learned(path: Path, learned: Learned, lines: str) -> None:
    """Write what was learned of a finger after the lines of its design or description, atomically."""
    own = {name: np.array(value) for name, value in learned.model_dump().items()}
    rounded = {
        name: np.round(value, DIGITS) if value.dtype.kind == "f" else value for name, value in own.items()
    }
    table = "\n".join(f"{name} = {json.dumps(value.tolist())}" for name, value in rounded.items())
    with atomic_path(path) as partial:
        partial.write_text(f"{lines}\n[{TABLE}]\n{table}\n", encoding="utf-8")
