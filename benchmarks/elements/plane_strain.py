"""Plane strain and plane stress against the finger in three dimensions, on its side face and in its middle.

Errors of the plane models for the presets, for twelve fingers drawn at random, and over the depth of the
default finger. Writes `docs/plane-strain.csv`, the tables of `docs/plane-strain.md` and their picture.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import cache
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from rich.table import Table

from benchmarks.tables import DOCS, fill, keep_rows, kept_rows, markdown
from compare.evaluation.evaluation import field_difference
from compare.figures.style import axes_at, write_heading
from compare.runtime.tables import terminal_table
from geometry.cache import finger_mesh
from geometry.errors import UserError
from geometry.figure import INK, MUTED, SMALL, Figure, figure
from geometry.finger.design import Design
from geometry.finger.presets import load_design
from geometry.mesh.quadrature import body_quadrature
from geometry.mesh.settings import MeshSettings
from solvers.fem.finite_strain.solver import FemNonlinearSolver
from solvers.fem.linear import FemSolver
from solvers.fem.solid import FaceField, Fem3dSolver
from solvers.problem import Load, Material, Problem
from solvers.solution import Solution

FIGURES, PAGE = DOCS / "plane-strain.csv", DOCS / "plane-strain.md"
PICTURE = DOCS / "pictures" / "plane-strain.png"

PRESETS = ("default", "slender", "stiff", "many-ribs", "csiro")
DRAWN = tuple(f"random-{seed}" for seed in range(12))
"""Fingers drawn at random; the number is the seed."""

LAWS = {"linear": PRESETS + DRAWN, "neo-hookean": ("default", "stiff")}
"""Fingers by law; the linear one with a sticking patch, neo-Hookean with a sliding one."""

LAYERS = {5.0: (3, 0.5), 10.0: (4, 0.4), 20.0: (4, 0.25), 40.0: (6, 0.12), 100.0: (8, 0.05)}
"""Depths of the default finger, mm, with the layers in half of each and their grading."""

FINE, COARSE = 1.0, 1.5
"""Element sizes, mm; the coarse mesh has one layer less. Its change is the error that the page states.

Three elements across a wall limit the size of both, so that it is mostly the layer's.
"""


class Case(NamedTuple):
    """One finger, law and mesh."""

    design: str
    law: str
    depth: float
    size: float


class Row(NamedTuple):
    """A plane model against three dimensions, on the side face and in the middle plane.

    Depth and element size, mm; at the markers the mean of |du| + |dv| and the largest |(du, dv)|, mm; the
    other differences are relative, in L2 over the body.
    """

    design: str
    law: str
    depth: float
    size: float
    model: str  # plane "strain" or "stress"
    side_markers: float
    side_worst: float
    side_displacement: float
    side_von_mises: float
    middle_markers: float
    middle_worst: float
    middle_displacement: float
    middle_von_mises: float
    force: float  # per depth, over the one in three dimensions, less one

    @property
    def key(self) -> tuple[str | float, ...]:
        """The case and the plane model."""
        return self[:5]


def main() -> Table:
    """Compute every case, write figures, page and picture, and return the table for the terminal."""
    rows = [row for case in cases() for row in measured(case)]
    keep_rows(FIGURES, Row, rows)
    for name, table in tables(rows).items():
        fill(PAGE, name, table)
    picture(rows).save(PICTURE)
    shown = [cells(row, rows) for row in finger_rows(rows, PRESETS + DRAWN)]
    return terminal_table("plane models against three dimensions", HEADER, shown, left=HEADER[:4])


def cases() -> Iterator[Case]:
    """Every preset and random finger, and the default finger at other depths; each on two meshes."""
    for size in (COARSE, FINE):
        for law, designs in LAWS.items():
            for design in designs:
                yield Case(design, law, finger(design).depth, size)
        for depth in LAYERS:
            if depth != finger("default").depth:
                yield Case("default", "linear", depth, size)


@cache
def finger(name: str) -> Design:
    """A preset, or a finger drawn from printable ranges; draws that break a rule are drawn again."""
    if name not in DRAWN:
        return load_design(name)
    rng = np.random.default_rng(DRAWN.index(name))
    while True:
        height = rng.uniform(60, 130)
        values = {
            "height": height,
            "base_width": rng.uniform(0.3, 0.5) * height,
            "depth": rng.uniform(10, 40),
            "rib_count": int(rng.integers(3, 9)),
            "rib_angle": rng.uniform(-30, 30),
            "rib_thickness": rng.uniform(1, 3),
            "front_thickness": rng.uniform(1.2, 3.5),
            "back_thickness": rng.uniform(1.2, 3.5),
            "base_thickness": rng.uniform(1.5, 5),
            "tip_length": rng.uniform(0.1, 0.25) * height,
            "contact_position": rng.uniform(0.25, 0.75) * height,
        }
        try:
            return Design(**values)
        except UserError:
            continue


def measured(case: Case) -> Iterator[Row]:
    """The plane models of a case against three dimensions."""
    design = finger(case.design).replaced(depth=case.depth)
    mesh = finger_mesh(design, settings=MeshSettings(size=case.size))
    linear = case.law == "linear"
    load = Load(kind="patch", displacement=(0.0 if linear else None, -10.0))
    problem = Problem(mesh, Material(law=case.law), load)
    layers, grading = LAYERS[min(LAYERS, key=lambda depth: abs(np.log(depth / case.depth)))]
    solid = Fem3dSolver(layers=layers - (case.size == COARSE), grading=grading).solve(problem)
    for model in ("strain", "stress") if linear else ("strain",):
        flat = replace(problem, material=problem.material.model_copy(update={"plane": model}))
        plane = (FemSolver(estimate=False) if linear else FemNonlinearSolver()).solve(flat)
        force = np.linalg.norm(plane.reaction) / np.linalg.norm(solid.reaction) - 1
        errors = (value for face in ("side", "middle") for value in missed(plane, solid, face))
        yield Row(*case, model, *(round(float(value), 5) for value in (*errors, force)))


def missed(plane: Solution, solid: Solution, face: str) -> tuple[float, ...]:
    """Errors on a face: mean and worst at the markers, mm; relative in displacement and von Mises stress."""
    if not isinstance(solid.field, FaceField):
        raise TypeError("the solution in three dimensions has no faces")
    there, mesh = replace(solid, field=replace(solid.field, face=face)), solid.problem.mesh
    rule = body_quadrature(mesh)
    gaps = plane.displacement(mesh.markers) - there.displacement(mesh.markers)
    relative = (
        field_difference(here, exact, rule.weights).rel_l2
        for here, exact in (
            (plane.displacement(rule.location), there.displacement(rule.location)),
            (plane.state(rule.location).von_mises, there.state(rule.location).von_mises),
        )
    )
    return np.abs(gaps).sum(axis=1).mean(), np.linalg.norm(gaps, axis=1).max(), *relative


def kept() -> list[Row]:
    """The rows of `FIGURES`."""
    return kept_rows(FIGURES, Row)


SIDE, MIDDLE = "#d55e00", "#0072b2"
HEADER = (
    *("finger", "depth, mm", "law", "plane", "markers, side, mm", "worst", "markers, middle, mm"),
    *("displ., side, %", "middle", "v. Mises, side, %", "middle", "force, %"),
)


def finger_rows(rows: Sequence[Row], fingers: Sequence[str]) -> list[Row]:
    """Rows of fingers as they are drawn, on the fine mesh."""
    chosen = [row for row in rows if row.size == FINE and row.design in fingers]
    return [row for row in chosen if row.design in DRAWN or row.depth == finger(row.design).depth]


def depth_rows(rows: Sequence[Row]) -> list[Row]:
    """Linear rows of the default finger in plane strain on the fine mesh, by depth."""
    chosen = [row for row in rows if row.size == FINE and row.design == "default" and row.law == "linear"]
    return sorted((row for row in chosen if row.model == "strain"), key=lambda row: row.depth)


def tables(rows: Sequence[Row]) -> dict[str, str]:
    """The page's tables in Markdown, by the names of their marks."""
    parts = {
        "table of presets": finger_rows(rows, PRESETS),
        "table of random fingers": [row for row in finger_rows(rows, DRAWN) if row.model == "strain"],
        "table of depths": depth_rows(rows),
    }
    return {
        name: markdown(HEADER, [cells(row, rows) for row in part], left=4) for name, part in parts.items()
    }


def cells(row: Row, rows: Sequence[Row]) -> tuple[str, ...]:
    """A row of the table: each number ± its change from the coarse mesh."""
    coarse = next(each for each in rows if each.key == row._replace(size=COARSE).key)

    def length(name: str) -> str:
        value, other = getattr(row, name), getattr(coarse, name)
        return f"{value:.3f} ± {max(abs(value - other), 0.001):.3f}"

    def share(name: str, sign: str = "") -> str:
        value, other = 100 * getattr(row, name), 100 * getattr(coarse, name)
        return f"{value:{sign}.1f} ± {max(abs(value - other), 0.1):.1f}"

    return (
        *(row.design, f"{row.depth:.3g}", row.law, row.model),
        *(length("side_markers"), f"{row.side_worst:.3f}", length("middle_markers")),
        *map(share, ("side_displacement", "middle_displacement", "side_von_mises", "middle_von_mises")),
        share("force", "+"),
    )


def picture(rows: Sequence[Row]) -> Figure:
    """Errors of plane strain over the depth of the default finger."""
    by_depth = depth_rows(rows)
    ratio = [row.depth / 2.0 for row in by_depth]  # the default finger's walls are 2 mm thick
    tracker = 0.005  # error of a marker's measured displacement, mm
    marks = {"ms": 3.5, "lw": 1.2}
    with figure(2.45) as drawn:
        left, right = (axes_at(drawn, (start, 0.5, 2.15, 1.5)) for start in (0.55, 3.25))
        side, middle = ([getattr(row, f"{face}_markers") for row in by_depth] for face in ("side", "middle"))
        left.plot(ratio, side, "o-", color=SIDE, **marks)
        left.plot(ratio, middle, "s-", color=MIDDLE, **marks)
        left.axhline(tracker, color=MUTED, lw=0.8, ls=":")
        _label(left, "side face", (ratio[2], side[2]), SIDE, above=True)
        _label(left, "middle plane", (1.2 * ratio[2], 0.92 * middle[2]), MIDDLE, above=False)
        _label(left, "the tracker's own", (ratio[3], tracker), MUTED, above=True)
        side, middle, forces = (
            [100 * getattr(row, name) for row in by_depth]
            for name in ("side_von_mises", "middle_von_mises", "force")
        )
        right.plot(ratio, side, "o-", color=SIDE, **marks)
        right.plot(ratio, middle, "s-", color=MIDDLE, **marks)
        right.plot(ratio, forces, "^--", color=INK, **marks)
        _label(right, "von Mises, side face", (ratio[3], side[3]), SIDE, above=True)
        _label(right, "von Mises,\nmiddle plane", (0.8 * ratio[1], 0.9 * middle[1]), MIDDLE, above=False)
        _label(right, "force", (1.3 * ratio[1], forces[1]), INK, above=True)
        left.set_ylabel("error at the markers, mm")
        right.set_ylabel("error, %")
        for axes in (left, right):
            axes.set_xscale("log")
            axes.set_xticks(ratio, [f"{value:g}" for value in ratio])
            axes.minorticks_off()
            axes.set(xlabel="depth over wall thickness", ylim=(0, 1.13 * axes.get_ylim()[1]))
        write_heading(
            drawn, "Plane strain against three dimensions", "default finger, linear law, sticking patch"
        )
    return drawn


def _label(axes: Axes, text: str, place: tuple[float, float], colour: str, *, above: bool) -> None:
    """A line's name above or below a place of it."""
    style = {"ha": "center", "va": "bottom" if above else "top", "color": colour, "size": SMALL}
    axes.annotate(text, place, (0, 5 if above else -5), textcoords="offset points", **style)
