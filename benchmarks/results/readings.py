"""Readings of the choices that the paper leaves open: the error of linear `fem` in each, beside the paper's.

The paper gives neither the tilt of the base, nor the line from which the ribs' slope is measured, nor the
places of the markers, and it speaks of the load at one point. For each combination of choices `fem` is
compared with the virtual experiment on the same finger, as the paper compares its finite elements with its
camera. Writes `docs/readings.csv` and the table of `docs/readings.md`; a minute.
"""

from collections.abc import Iterator, Sequence
from itertools import product
from typing import NamedTuple

import numpy as np
from rich.table import Table

from benchmarks.tables import DOCS, fill, keep_rows, kept_rows, markdown
from compare.evaluation.truths import virtual_experiment
from compare.runtime.tables import terminal_table
from geometry.cache import finger_mesh
from geometry.finger.presets import load_design
from geometry.mesh.settings import MeshSettings
from solvers.problem import Load, Problem
from solvers.registry import make_solver

FIGURES, PAGE, MARK = DOCS / "readings.csv", DOCS / "readings.md", "table of readings"

PAPER = (1.41, 0.39)
"""Mean absolute errors of u and v of the paper's finite elements, mm (its Table I)."""

# A printed finger of the paper's group has a tilt of 9.9 degrees; without tilt the base is the front's
# normal, so that both lines from which the slope may be measured are one.
SHAPES = ((0.0, "front"), (9.9, "front"), (9.9, "base"))
"""Tilts of the base, degrees, with the line from which the ribs' slope is measured."""
LAYOUTS, LOADS = ("front", "joints"), ("mean", "point")

HEADER = ("tilt", "slope from", "markers", "load", "MAE_u", "MAE_v", "rss", "distance")


class Reading(NamedTuple):
    """One choice of everything that is open, and the errors that follow, mm."""

    base_tilt: float
    rib_reference: str
    marker_layout: str
    load: str
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


def main() -> Table:
    """Compute every reading, write the figures and the page's table, nearest to the paper first."""
    readings = sorted(read_all(), key=lambda each: each.distance)
    keep_rows(FIGURES, Reading, readings)
    fill(PAGE, MARK, table(readings))
    title = "fem against the virtual experiment, mm; the paper: 1.41, 0.39, 1.463"
    return terminal_table(title, HEADER, [each.cells for each in readings], left=HEADER[:4])


def read_all(settings: MeshSettings | None = None) -> Iterator[Reading]:
    """Every reading, on a mesh of its own finger.

    Args:
        settings: Element sizes; the default ones if None.
    """
    for (tilt, reference), layout in product(SHAPES, LAYOUTS):
        changes = {"base_tilt": tilt, "rib_reference": reference, "marker_layout": layout}
        design = load_design(overrides=changes)
        mesh = finger_mesh(design, settings=settings or MeshSettings())
        observed, _ = virtual_experiment(Problem(mesh), design.marker_radius)
        for load in LOADS:
            solution = make_solver("fem", estimate=False).solve(Problem(mesh, load=Load(kind=load)))
            errors = np.abs(solution.displacement(observed.points) - observed.displacements)
            u, v = (round(float(value), 4) for value in errors.mean(axis=0))
            yield Reading(tilt, reference, layout, load, u, v)


def kept_readings() -> list[Reading]:
    """The readings of `FIGURES`."""
    return kept_rows(FIGURES, Reading)


def table(readings: Sequence[Reading]) -> str:
    """The page's table, the paper's numbers first."""
    paper = ("the paper", "", "", "", *(f"{value:.3f}" for value in (*PAPER, np.hypot(*PAPER))), "")
    return markdown(HEADER, [paper, *(each.cells for each in readings)], left=4)
