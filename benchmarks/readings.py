"""Readings of what the paper leaves open: the error of linear `fem` in each, beside the paper's.

The paper gives neither the tilt of the base, nor the line from which the ribs' slope is measured, nor the
places of the markers, and it speaks of the load at one point. For each combination of choices `fem` is
compared with the virtual experiment on the same finger, as the paper compares its finite elements with its
camera. Writes `docs/readings.csv` and the table of `docs/readings.md`; a minute.
"""

import csv
from collections.abc import Iterator
from itertools import product
from pathlib import Path
from typing import Literal, NamedTuple

import numpy as np
from rich.table import Table

from compare.evaluation.virtual_experiment import virtual_experiment
from geometry.atomic import write_text
from geometry.cache import finger_mesh
from geometry.finger.presets import load_design
from geometry.mesh.settings import MeshSettings
from solvers.problem import Load, Problem
from solvers.registry import make_solver

DOCS = Path(__file__).parents[1] / "docs"
FIGURES, PAGE = DOCS / "readings.csv", DOCS / "readings.md"

PAPER = (1.41, 0.39)
"""Mean absolute errors of u and v of the paper's finite elements, mm (its Table I)."""

GROUP_TILT = 9.9
"""Tilt of the base in a printed finger of the paper's group, degrees."""

SHAPES: tuple[tuple[float, Literal["front", "base"]], ...] = (
    (0.0, "front"),  # the base is the front's normal, so that both references of the slope are one
    (GROUP_TILT, "front"),
    (GROUP_TILT, "base"),
)
LAYOUTS: tuple[Literal["front", "joints"], ...] = ("front", "joints")
LOADS: tuple[Literal["mean", "point"], ...] = ("mean", "point")

BEGIN, END = "<!-- table of readings -->\n", "<!-- end of the table -->\n"


class Reading(NamedTuple):
    """One choice of everything that is open, and the errors that follow, mm."""

    base_tilt: float
    rib_reference: Literal["front", "base"]
    marker_layout: Literal["front", "joints"]
    load: Literal["mean", "point"]
    mae_u: float
    mae_v: float

    @property
    def rss(self) -> float:
        """Root of the sum of both squares, mm: the row `disp` of the paper's Table I."""
        return float(np.hypot(self.mae_u, self.mae_v))

    @property
    def distance(self) -> float:
        """Distance of both errors from the paper's, mm."""
        return float(np.hypot(self.mae_u - PAPER[0], self.mae_v - PAPER[1]))

    @property
    def cells(self) -> tuple[str, ...]:
        """The row of the table."""
        errors = (f"{value:.3f}" for value in (self.mae_u, self.mae_v, self.rss, self.distance))
        slope = "either" if self.base_tilt == 0 else self.rib_reference
        return f"{self.base_tilt:g}°", slope, self.marker_layout, self.load, *errors


HEADER = ("tilt", "slope from", "markers", "load", "MAE_u", "MAE_v", "rss", "distance")


def main() -> Table:
    """Compute every reading, write the figures and the page's table, nearest to the paper first."""
    readings = sorted(read_all(), key=lambda each: each.distance)
    rows = [Reading._fields, *([str(value) for value in each] for each in readings)]
    write_text(FIGURES, "".join(f"{','.join(row)}\n" for row in rows))
    before, _, rest = PAGE.read_text(encoding="utf-8").partition(BEGIN)
    write_text(PAGE, before + BEGIN + markdown(readings) + END + rest.partition(END)[2])
    table = Table(title="fem against the virtual experiment, mm; the paper: 1.41, 0.39, 1.463")
    for name in HEADER:
        table.add_column(name, no_wrap=True)
    for each in readings:
        table.add_row(*each.cells)
    return table


def read_all(settings: MeshSettings | None = None) -> Iterator[Reading]:
    """Every reading, on a mesh of its own finger.

    Args:
        settings: Element sizes; the default ones if None.
    """
    for (tilt, reference), layout in product(SHAPES, LAYOUTS):
        design = load_design().replaced(base_tilt=tilt, rib_reference=reference, marker_layout=layout)
        mesh = finger_mesh(design, settings=settings or MeshSettings())
        observed, _ = virtual_experiment(Problem(mesh), design.marker_radius)
        for load in LOADS:
            solution = make_solver("fem", estimate=False).solve(Problem(mesh, load=Load(kind=load)))
            errors = np.abs(solution.displacement(observed.points) - observed.displacements)
            u, v = (round(float(value), 4) for value in errors.mean(axis=0))
            yield Reading(tilt, reference, layout, load, u, v)


def kept_readings() -> list[Reading]:
    """The readings of `FIGURES`."""
    with FIGURES.open(encoding="utf-8") as file:
        return [
            Reading(
                float(row["base_tilt"]),
                "base" if row["rib_reference"] == "base" else "front",
                "joints" if row["marker_layout"] == "joints" else "front",
                "point" if row["load"] == "point" else "mean",
                float(row["mae_u"]),
                float(row["mae_v"]),
            )
            for row in csv.DictReader(file)
        ]


def markdown(readings: list[Reading]) -> str:
    """The page's table, the paper's numbers first."""
    rows = [("the paper", "", "", "", *(f"{value:.3f}" for value in (*PAPER, np.hypot(*PAPER))), "")]
    rows += [each.cells for each in readings]
    lines = [HEADER, ("---",) * 4 + ("---:",) * 4, *rows]
    return "".join(f"| {' | '.join(row)} |\n" for row in lines)
