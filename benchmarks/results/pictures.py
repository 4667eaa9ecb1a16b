"""The pictures of pages that the program draws, anew into docs/pictures; a minute."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Circle, PathPatch
from matplotlib.path import Path
from rich.table import Table

import pinnray as pr
from benchmarks.tables import DOCS
from pinnray.comparison.figures import body
from pinnray.comparison.figures.canvas import Extent
from pinnray.comparison.figures.layout import arrow, axes_at
from pinnray.geometry.mesh.boundary import edge_paths
from pinnray.runtime.arrays import FloatArray
from pinnray.runtime.figure import BODY, CONTACT, INK, MEASURED, MUTED, Figure, figure

PAGE, HEAD, EXTENT = 180 / 25.4, 0.22, Extent(-9.0, 93.0, -33.0, 15.0)
"""Width of the page and height of the headings, inches, and what a panel shows, mm."""

PARTS = (
    ("base, held", (-7, 6), (0, -1), INK),
    ("front wall", (37, 6), (40, -0.5), INK),
    ("rib", (7, -13), (19, -10), INK),
    ("back wall", (48, -28), (40, -17), INK),
    ("markers", (72, -15), (80, -1.6), MEASURED),
)
"""Name of a part, where it stands, the place that it names, mm, and its colour."""


def draw_finger() -> Figure:
    """The default finger at rest, and under the cylinder with the force on it and the cylinder's stroke."""
    pressed = pr.solve("default", "fem-nonlinear", load="cylinder")
    mesh, load = pressed.problem.mesh, pressed.problem.load
    paths, size = edge_paths(mesh.boundary_edges), body.hatch_size(mesh.points)
    height, radius, (_, down) = 0.5 * PAGE * EXTENT.height / EXTENT.width, load.radius or 0.0, load.values

    def panel(side: int, title: str, points: FloatArray, markers: FloatArray) -> Axes:
        axes = axes_at(drawn, (0.5 * PAGE * side, HEAD, 0.5 * PAGE, height))
        body.prepare(axes, EXTENT)
        axes.set_title(title, weight="bold", x=0.02)
        whole = Path.make_compound_path(*(Path(points[path]) for path in paths))
        axes.add_patch(PathPatch(whole, fc=BODY, ec=INK, lw=0.8))
        body.clamp(axes, body.base_lines(mesh), size=size)
        axes.plot(*markers.T, "o", ms=3.6, mew=0, color=MEASURED, zorder=4)
        return axes

    with figure(HEAD + height, PAGE) as drawn:
        rest = panel(0, "At rest", mesh.points, mesh.markers)
        for name, place, end, colour in PARTS:
            line = {"arrowstyle": "-", "color": colour, "lw": 0.6, "shrinkA": 1, "shrinkB": 0}
            rest.annotate(name, end, place, arrowprops=line, color=colour, size=9, zorder=6)
        points, markers = mesh.points + pressed.displacement(mesh.points), mesh.markers + pressed.at_markers()
        axes = panel(1, "Pressed by a cylinder", points, markers)
        body.draw_outline(axes, [max(paths, key=len)], mesh.points, colour=MUTED, width=0.5, zorder=0)
        x = float(np.mean(mesh.points[np.unique(mesh.boundary("contact")), 0]))
        for y, style in ((0.0, ":"), (down, "-")):
            axes.add_patch(Circle((x, y + radius), radius, fill=False, ec=INK, lw=1.0, ls=style, zorder=5))
        arrow(axes, (x, 14), (x, down), colour=CONTACT, width=1.8)
        axes.text(x + 2, 12, f"force {pressed.figures.force:.1f} N", color=CONTACT, size=9)
        arrow(axes, (x + 8, 0), (x + 8, down), style="<|-|>,head_width=0.15,head_length=0.3", width=0.8)
        axes.text(x + 7, 1.5, f"stroke {-down:g} mm", size=9)
    return drawn


NOTCH = DOCS.parent / "tests" / "data" / "compliant-finray" / "Finray_9_notch_10deg_0deg10inf.stp"
PICTURES = {
    "finger": draw_finger,
    "notebook": lambda: pr.solve("slender", "fem", size=1.0).plot("von_mises"),
    "drawing-notch": lambda: pr.load_drawing(NOTCH).plot(),
}


def main() -> Table:
    """Draw every picture and write it."""
    table = Table("picture", "KiB")
    for name, draw in PICTURES.items():
        path = draw().save(DOCS / "pictures" / f"{name}.png")
        table.add_row(path.name, f"{path.stat().st_size / 1024:.0f}")
    return table
