"""Parts that the pictures of the body share: colour scales, outline, clamped base, scale bar, colour bar.

A panel has a strip below the body for a note and a scale bar, so that neither lies on a body of any shape.
"""

from collections.abc import Iterable
from typing import NamedTuple

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import LineCollection
from matplotlib.colors import Colormap, Normalize
from matplotlib.image import AxesImage
from matplotlib.patches import PathPatch
from matplotlib.path import Path
from numpy.typing import NDArray

from pinnray.comparison.figures.canvas import Canvas, Extent, Pixels
from pinnray.geometry.mesh.triangle_mesh import TriangleMesh
from pinnray.runtime.arrays import FloatArray, IntArray, weighted_percentile
from pinnray.runtime.figure import INK, MUTED, SMALL

PERCENT = 99.5
"""Share of the area within a colour scale; peaks at re-entrant corners would leave the rest in one colour."""


SEQUENTIAL, DIVERGING = "viridis", "coolwarm"
"""Matplotlib's maps of fields, and of differences: blue, light grey, red, as dark on either side of zero."""


class ColourScale(NamedTuple):
    """A colour scale that several pictures share."""

    low: float  # value of the first colour
    high: float  # value of the last one
    colours: Colormap

    @property
    def mappable(self) -> ScalarMappable:
        """For a colour bar."""
        return ScalarMappable(Normalize(self.low, self.high), self.colours)

    def paint(self, values: FloatArray) -> NDArray[np.uint8]:
        """Colours of values of shape (t,): red, green and blue, shape (t, 3)."""
        rgba = self.mappable.to_rgba(values, bytes=True)
        return np.asarray(rgba, dtype=np.uint8)[:, :3]


def sequential(values: FloatArray, weights: FloatArray) -> ColourScale:
    """A scale from zero to the percentile of values, shape (t,), under area weights, shape (t,)."""
    return ColourScale(
        0.0, _positive(weighted_percentile(values, weights, PERCENT)), mpl.colormaps[SEQUENTIAL]
    )


def symmetric(values: FloatArray, weights: FloatArray) -> ColourScale:
    """A scale symmetric about zero that covers the percentile of the absolute value, as `sequential`."""
    limit = _positive(weighted_percentile(np.abs(values), weights, PERCENT))
    return ColourScale(-limit, limit, mpl.colormaps[DIVERGING])


def _positive(limit: float) -> float:
    """The limit, or the smallest scale that can be drawn where a field is zero."""
    return limit if limit > 0 else 1e-12


PIXELS = 1800
"""Pixels across a picture of the body; a printed panel has fewer, which smooths its edges."""


def panel_extent(
    points: FloatArray, width: float, *, margin: float, tallest: float = 3.0, shortest: float = 0.0
) -> Extent:
    """The extent of a panel that shows points, shape (n, 2), with a margin, mm, and its strip below them.

    Panel width and limits of its height above the strip in inches: a tall body is drawn narrower.
    """
    tight = Extent.around(points, margin=margin)
    across = max(tight.width, tight.height * width / tallest)
    inch = across / width
    beside = (across - tight.width) / 2
    above = max(shortest * inch - tight.height, 0.0) / 2
    return Extent(
        tight.left - beside, tight.right + beside, tight.bottom - above - 0.2 * inch, tight.top + above
    )


def field_extent(mesh: TriangleMesh, width: float) -> Extent:
    """The extent of a panel of a field, `width` inches wide: the undeformed body with a margin, mm."""
    margin = 0.012 * float(np.ptp(mesh.points, axis=0).max())
    return panel_extent(mesh.points, width, margin=margin, shortest=0.7)


def prepare(axes: Axes, extent: Extent) -> None:
    """Axes without a frame that show `extent` at true proportions."""
    axes.set_axis_off()
    axes.set(xlim=(extent.left, extent.right), ylim=(extent.bottom, extent.top))
    axes.set_aspect("equal", adjustable="box", anchor="W")


def show(axes: Axes, canvas: Canvas, colours: Pixels, points: FloatArray | None = None) -> None:
    """Show a canvas with triangles in `colours`, shape (t, 3), and nodes at `points` if given, mm."""
    limits = (canvas.extent.left, canvas.extent.right, canvas.extent.bottom, canvas.extent.top)
    image = AxesImage(axes, extent=limits, zorder=1, interpolation="hanning")
    image.set_data(canvas.picture(colours, points))
    axes.add_image(image)


def panel(
    axes: Axes, canvas: Canvas, mesh: TriangleMesh, colours: Pixels, title: str, note: str, bold: bool = True
) -> None:
    """The undeformed body in the colours of its triangles, shape (t, 3), with its outline, title and note."""
    prepare(axes, canvas.extent)
    show(axes, canvas, colours)
    draw_outline(axes, canvas.outline, mesh.points, width=0.35)
    axes.set_title(title, size=8.5, pad=2, y=1.0, weight="bold" if bold else "normal")
    write_note(axes, canvas.extent, note)


def write_note(axes: Axes, extent: Extent, note: str) -> None:
    """A note at the left of the strip below the body."""
    place = (extent.left + 0.01 * extent.width, extent.bottom)
    axes.annotate(note, place, xytext=(0, 3), textcoords="offset points", size=SMALL, color=MUTED)


def draw_outline(
    axes: Axes,
    paths: Iterable[IntArray],
    points: FloatArray,
    *,
    colour: str = INK,
    width: float = 0.5,
    zorder: float = 2,
) -> None:
    """Draw lines, each given by the numbers of its nodes, (k,), of nodes at `points`, shape (n, 2), mm."""
    lines = Path.make_compound_path(*(Path(points[path]) for path in paths))
    style = {"capstyle": "round", "joinstyle": "round", "zorder": zorder}
    axes.add_artist(PathPatch(lines, fc="none", ec=colour, lw=width, **style))


def base_lines(mesh: TriangleMesh) -> list[FloatArray]:
    """The connected parts of the clamped base, each the points of a line, (k, 2), mm, body on its left."""
    follows = dict(mesh.boundary("base").tolist())
    starts = sorted(set(follows) - set(follows.values())) or sorted(follows)[:1]
    lines = []
    for node in starts:
        nodes = [node]
        while nodes[-1] in follows and follows[nodes[-1]] not in nodes:
            nodes.append(follows[nodes[-1]])
        lines.append(mesh.points[nodes])
    return lines


def clamp(axes: Axes, lines: Iterable[FloatArray], *, size: float) -> None:
    """Hatch the clamped base on its outer side, behind the body, with strokes `size` mm apart.

    Each of its parts is given by the points of a line, shape (k, 2), mm, with the body on its left.
    """
    for line in lines:
        steps = np.diff(line, axis=0)
        reached = np.append(0.0, np.linalg.norm(steps, axis=1).cumsum())
        count = max(int(reached[-1] / size), 2)
        where = reached[-1] * np.arange(count) / count
        starts = np.stack([np.interp(where, reached, values) for values in line.T], axis=1)
        along = steps[np.searchsorted(reached, where, side="right") - 1]
        along /= np.linalg.norm(along, axis=1, keepdims=True)
        ends = starts + size * (along + along[:, ::-1] * (1, -1))
        strokes = LineCollection(
            list(np.stack([starts, ends], axis=1)), colors=INK, linewidths=0.5, zorder=0.5
        )
        axes.add_collection(strokes, autolim=False)
        axes.plot(*line.T, color=INK, linewidth=1.1, zorder=3, solid_capstyle="butt")


def hatch_size(points: FloatArray) -> float:
    """Distance of the strokes at the base of a body with points of shape (n, 2), mm."""
    return 0.0175 * float(np.ptp(points, axis=0).max())


def scale_bar(axes: Axes, extent: Extent) -> None:
    """A bar of a round length, about an eighth of the picture, at the right of the strip below the body."""
    length = round_length(extent.width / 8)
    right, y = extent.right - 0.01 * extent.width, extent.bottom + 0.005 * extent.width
    axes.plot([right - length, right], [y, y], color=INK, lw=1.6, solid_capstyle="butt", zorder=6)
    axes.annotate(
        f"{length:g} mm", (right, y), xytext=(0, 2.5), textcoords="offset points", ha="right", size=SMALL
    )


def round_length(wanted: float) -> float:
    """The largest of 1, 2, 5, 10, 20, ... that is not above `wanted`."""
    power = 10.0 ** np.floor(np.log10(wanted))
    return float(max(step * power for step in (1, 2, 5) if step * power <= wanted * (1 + 1e-9)))


def colour_bar(axes: Axes, scale: ColourScale, title: str, *, extend: str = "neither") -> None:
    """A horizontal colour bar that fills `axes`, with quantity and unit under its ticks.

    `extend` are the ends with values beyond the scale: `neither`, `min`, `max` or `both`.
    """
    figure = axes.figure
    bar = figure.colorbar(scale.mappable, cax=axes, orientation="horizontal", extend=extend, extendfrac=0.03)
    bar.outline.set_linewidth(0.4)
    bar.ax.tick_params(length=2, width=0.5, pad=1.5, labelsize=SMALL, colors=INK)
    bar.ax.locator_params(nbins=5)
    bar.ax.ticklabel_format(scilimits=(-2, 3))
    bar.ax.xaxis.get_offset_text().set(size=SMALL, color=MUTED)
    bar.set_label(title, size=SMALL, labelpad=2)
