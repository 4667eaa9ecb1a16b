"""Draws pictures of the pages anew: `python docs/pictures/draw.py [NAME ...]`, all in two minutes."""

import re
import sys
from functools import cache
from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.patches import Arc, Circle, PathPatch
from matplotlib.path import Path as Outline

import pinnray as pr
from pinnray.comparison.figures import body
from pinnray.comparison.figures.canvas import Extent
from pinnray.comparison.figures.layout import HALO, arrow, axes_at, write_heading
from pinnray.comparison.figures.solver_colours import solver_look
from pinnray.geometry.mesh.boundary import edge_paths
from pinnray.geometry.mesh.triangle_mesh import TriangleMesh
from pinnray.runtime.arrays import FloatArray
from pinnray.runtime.figure import BODY, COLUMN, CONTACT, INK, MEASURED, MUTED, PAGE, Figure, figure
from pinnray.solvers.problem import front_points
from pinnray.studies.optimum.pictures import draw_front_fingers
from pinnray.studies.optimum.question import Question
from pinnray.studies.optimum.search import Optimum
from pinnray.studies.sweep.measurement import Measurement

HERE = Path(__file__).parent
NOTCH = HERE.parents[1] / "tests" / "data" / "compliant-finray" / "Finray_9_notch_10deg_0deg10inf.stp"

HEAD, EXTENT = 0.22, Extent(-9.0, 93.0, -33.0, 15.0)
"""Height of a heading, inches, and what a panel of the default finger shows, mm."""

PARTS = (
    ("base, held", (-7, 6), (0, -1), INK),
    ("front wall", (37, 6), (40, -0.5), INK),
    ("rib", (7, -13), (19, -10), INK),
    ("back wall", (48, -28), (40, -17), INK),
    ("markers", (72, -15), (80, -1.6), MEASURED),
)
"""Name of a part, where it stands, the place that it names, mm, and its colour."""


@cache
def pressed() -> pr.Solution:
    """The default finger under a cylinder."""
    return pr.solve("default", "fem-nonlinear", load="cylinder")


def titled_axes(drawn: Figure, left: float, width: float, title: str) -> Axes:
    """Axes for a body, their left end and width in inches."""
    axes = axes_at(drawn, (left, HEAD, width, width * EXTENT.height / EXTENT.width))
    body.prepare(axes, EXTENT)
    axes.set_title(title, weight="bold", x=0.02)
    return axes


def draw_body(axes: Axes, mesh: TriangleMesh, points: FloatArray) -> None:
    """A filled body with its nodes at points of shape (n, 2), mm, and its clamp."""
    outlines = [Outline(points[path]) for path in edge_paths(mesh.boundary_edges)]
    axes.add_patch(PathPatch(Outline.make_compound_path(*outlines), fc=BODY, ec=INK, lw=0.8))
    body.clamp(axes, body.base_lines(mesh), size=body.hatch_size(mesh.points))


def draw_finger() -> Figure:
    """The default finger with its parts named, and pressed, with the force and the cylinder's stroke."""
    mesh, load, half = pressed().problem.mesh, pressed().problem.load, PAGE / 2
    with figure(HEAD + half * EXTENT.height / EXTENT.width, PAGE) as drawn:
        axes = titled_axes(drawn, 0.0, half, "At rest")
        draw_body(axes, mesh, mesh.points)
        axes.plot(*mesh.markers.T, "o", ms=3.6, mew=0, color=MEASURED, zorder=4)
        for name, place, end, colour in PARTS:
            line = {"arrowstyle": "-", "color": colour, "lw": 0.6, "shrinkA": 1, "shrinkB": 0}
            axes.annotate(name, end, place, arrowprops=line, color=colour, size=9, zorder=6)
        axes = titled_axes(drawn, half, half, "Pressed by a cylinder")
        draw_body(axes, mesh, mesh.points + pressed().displacement(mesh.points))
        axes.plot(*(mesh.markers + pressed().at_markers()).T, "o", ms=3.6, mew=0, color=MEASURED, zorder=4)
        outline = max(edge_paths(mesh.boundary_edges), key=len)
        body.draw_outline(axes, [outline], mesh.points, colour=MUTED, width=0.5, zorder=0)
        (x, _), (_, down), radius = contact(mesh), load.values, load.radius or 0.0
        for y, style in ((0.0, ":"), (down, "-")):
            axes.add_patch(Circle((x, y + radius), radius, fill=False, ec=INK, lw=1.0, ls=style, zorder=5))
        arrow(axes, (x, 14), (x, down), colour=CONTACT, width=1.8)
        axes.text(x + 2, 12, f"force {pressed().figures.force:.1f} N", color=CONTACT, size=9)
        arrow(axes, (x + 8, 0), (x + 8, down), style="<|-|>,head_width=0.15,head_length=0.3", width=0.8)
        axes.text(x + 7, 1.5, f"stroke {-down:g} mm", size=9)
    return drawn


def contact(mesh: TriangleMesh) -> FloatArray:
    """The middle of the contact, shape (2,), mm."""
    ends = mesh.points[np.unique(mesh.boundary("contact")), 0]
    return np.asarray(front_points(mesh, np.array([(ends.min() + ends.max()) / 2]))[0])


def draw_wrap() -> Figure:
    """The wrap angle of the default finger under a cylinder."""
    mesh = pressed().problem.mesh
    rest = front_points(mesh, np.array([0.0, contact(mesh)[0], mesh.points[:, 0].max()]))
    base, middle, tip = rest + pressed().displacement(rest)
    with figure(HEAD + COLUMN * EXTENT.height / EXTENT.width, COLUMN) as drawn:
        axes = titled_axes(drawn, 0.0, COLUMN, f"Wrap angle {pressed().figures.wrap:.1f}°")
        draw_body(axes, mesh, mesh.points + pressed().displacement(mesh.points))
        axes.plot(*rest.T, color=MUTED, lw=1.0, ls="--")
        axes.plot(*np.array([base, middle, tip]).T, "o-", color=CONTACT, lw=1.6, ms=4, zorder=5)
        axes.plot(
            *np.array([middle, middle + 0.65 * (middle - base)]).T, ":", color=CONTACT, lw=1.2, zorder=5
        )
        low, high = (np.degrees(np.arctan2(way[1], way[0])) for way in (middle - base, tip - middle))
        axes.add_patch(Arc(tuple(middle), 32, 32, theta1=low, theta2=high, color=CONTACT, lw=1.2, zorder=5))
        axes.annotate(
            "wrap", middle + np.array([17, -3.5]), color=CONTACT, size=9, zorder=6, path_effects=HALO
        )
    return drawn


def draw_fingers() -> Figure:
    """The fingers in the table of the page for designers, each solved anew."""
    page = (HERE.parent / "designers.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| (\d+) \| [\d.]+ \| [\d.]+ \| ((?:[\d.]+ \| ){5}[\d.]+) \|$", page, re.MULTILINE)
    names = ("rib_count", "rib_angle", "rib_thickness", "front_thickness", "back_thickness", "tip_length")
    load = pr.Load("cylinder", radius=10, stroke=10)
    solved = {}
    for number, cells in rows:
        values = map(float, cells.split(" | "))
        finger = pr.Design(contact_position=35, marker_diameter=0.4, **dict(zip(names, values, strict=True)))
        solved[int(number)] = pr.solve(finger, "fem-nonlinear", load=load, size=1.0)
    question = Question.load(HERE.parent / "examples" / "wrap-cylinder.toml")
    runs = range(1 + max(solved))
    found = [
        Measurement(run, "done", "", 0.0, vars(solved[run].figures) if run in solved else {}) for run in runs
    ]
    return draw_front_fingers(Optimum(question, [{} for _ in runs], found, list(runs)[1:]), solved)


def draw_growth() -> Figure:
    """CPU time and memory over the number of unknowns, with lines through the largest three."""
    table = pd.read_csv(HERE.parent / "growth.csv")
    with figure(2.6, PAGE) as drawn:
        write_heading(drawn, "Cost over the number of unknowns", "default finger, one core")
        for side, (column, label) in enumerate({"seconds": "CPU time, s", "gigabytes": "memory, GB"}.items()):
            axes = axes_at(drawn, (0.7 + side * PAGE / 2, 0.5, PAGE / 2 - 1.0, 1.6))
            for solver, rows in table.groupby("solver"):
                colour, mark = solver_look(str(solver))
                x, y = rows["unknowns"].to_numpy(), rows[column].to_numpy()
                slope, offset = np.polyfit(np.log(x[-3:]), np.log(y[-3:]), 1)
                axes.plot(x, y, mark, color=colour, ms=5, label=solver)
                axes.plot(x[-3:], np.exp(offset) * x[-3:] ** slope, color=colour, lw=1.2)
            axes.set(xscale="log", yscale="log", xlabel="unknowns", ylabel=label, ylim=(0.05, 100))
            axes.xaxis.set_major_formatter("{x:,.0f}")
            axes.yaxis.set_major_formatter("{x:g}")
            axes.grid()
        axes.legend(loc="upper left")
    return drawn


PICTURES = {
    "growth": draw_growth,
    "finger": draw_finger,
    "wrap": draw_wrap,
    "front-fingers": draw_fingers,
    "notebook": lambda: pr.solve("slender", "fem", size=1.0).plot("von_mises"),
    "drawing-notch": lambda: pr.load_drawing(NOTCH).plot(),
}

if __name__ == "__main__":
    for chosen in sys.argv[1:] or PICTURES:
        print(PICTURES[chosen]().save(HERE / f"{chosen}.png"))
