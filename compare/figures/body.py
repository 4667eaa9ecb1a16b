"""Parts that the pictures of the body share: pixels, outline, clamped base, scale bar, colour bar."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection

from compare.figures.canvas import Canvas, Extent, Pixels
from compare.figures.colours import Scale
from compare.figures.style import HALO
from geometry.arrays import FloatArray, IntArray
from geometry.figure import INK, MUTED
from geometry.mesh.boundary import boundary_edges
from geometry.mesh.triangle_mesh import TriangleMesh

PIXELS = 1800
"""Pixels across a picture of the body; a printed panel has fewer, which smooths its edges."""


def field_extent(mesh: TriangleMesh) -> Extent:
    """The extent of a panel of a field: the undeformed body with a margin, mm."""
    return Extent.around(mesh.points, margin=0.012 * float(np.ptp(mesh.points[:, 0])))


def prepare(axes: Axes, extent: Extent) -> None:
    """Axes without a frame that show `extent` at true proportions."""
    axes.set_axis_off()
    axes.set_xlim(extent.left, extent.right)
    axes.set_ylim(extent.bottom, extent.top)
    axes.set_aspect("equal", adjustable="box", anchor="W")


def show(axes: Axes, canvas: Canvas, colours: Pixels, points: FloatArray | None = None) -> None:
    """Show a canvas with triangles in `colours`, shape (t, 3), and nodes at `points` if given, mm."""
    picture = canvas.picture(colours, points)
    axes.imshow(picture, extent=canvas.extent, interpolation="hanning", zorder=1, aspect="equal")


def panel(
    axes: Axes,
    canvas: Canvas,
    mesh: TriangleMesh,
    colours: Pixels,
    title: str,
    note: str,
    *,
    bold: bool = True,
) -> None:
    """The undeformed body in the colours of its triangles, shape (t, 3), with its outline, title and note."""
    prepare(axes, canvas.extent)
    show(axes, canvas, colours)
    outline(axes, boundary_edges(mesh.triangles), mesh.points, width=0.35)
    axes.set_title(title, size=8.5, pad=2, weight="bold" if bold else "normal")
    # In the corner below the tip, which no finger fills, above the scale bar.
    axes.text(0.99, 0.33, note, ha="right", size=7, color=MUTED, transform=axes.transAxes)


def outline(
    axes: Axes,
    edges: IntArray,
    points: FloatArray,
    *,
    colour: str = INK,
    width: float = 0.5,
    zorder: float = 2,
) -> None:
    """Draw edges, shape (b, 2), of nodes at `points`, shape (n, 2), mm."""
    lines = LineCollection(
        list(points[edges]), colors=colour, linewidths=width, capstyle="round", zorder=zorder
    )
    axes.add_collection(lines, autolim=False)


def clamp(axes: Axes, base: FloatArray, *, size: float = 1.6) -> None:
    """Hatch the clamped base.

    Args:
        axes: Where to draw.
        base: Nodes of the base, shape (k, 2), mm.
        size: Length of the hatching, mm.
    """
    x, low, high = float(base[:, 0].min()), float(base[:, 1].min()), float(base[:, 1].max())
    starts = np.linspace(low + size, high, max(int((high - low) / size), 2))
    strokes = [((x, y), (x - size, y - size)) for y in starts]
    axes.add_collection(LineCollection(strokes, colors=INK, linewidths=0.5, zorder=2), autolim=False)
    axes.plot([x, x], [low, high], color=INK, linewidth=1.1, zorder=3, solid_capstyle="butt")


def scale_bar(axes: Axes, extent: Extent, *, corner: str = "lower right") -> None:
    """A bar of a round length, about an eighth of the picture, in a corner.

    Args:
        axes: Where to draw.
        extent: What the axes show, mm.
        corner: `lower right` or `lower left`.
    """
    length = round_length(extent.width / 8)
    inset = 0.02 * extent.width
    left = extent.right - inset - length if corner == "lower right" else extent.left + inset
    y = extent.bottom + inset
    ends = ([left, left + length], [y, y])
    axes.plot(*ends, color=INK, lw=1.6, solid_capstyle="butt", path_effects=HALO, zorder=6)
    axes.annotate(
        f"{length:g} mm",
        (left + length, y),
        xytext=(0, 2.5),
        textcoords="offset points",
        ha="right",
        va="bottom",
        size=7.5,
        path_effects=HALO,
        zorder=6,
    )


def round_length(wanted: float) -> float:
    """The largest of 1, 2, 5, 10, 20, ... that is not above `wanted`."""
    power = 10.0 ** np.floor(np.log10(wanted))
    return float(max(step * power for step in (1, 2, 5) if step * power <= wanted * (1 + 1e-9)))


def colour_bar(axes: Axes, scale: Scale, title: str, *, extend: str = "neither") -> None:
    """A horizontal colour bar that fills `axes`.

    Args:
        axes: Axes for the bar alone.
        scale: The shared scale.
        title: Quantity and unit, set under the ticks.
        extend: Which ends hold values beyond the scale: `neither`, `min`, `max` or `both`.
    """
    figure = axes.figure
    bar = figure.colorbar(scale.mappable, cax=axes, orientation="horizontal", extend=extend, extendfrac=0.03)
    bar.outline.set_linewidth(0.4)
    bar.ax.tick_params(length=2, width=0.5, pad=1.5, labelsize=7.5, colors=INK)
    if not scale.log:
        bar.ax.locator_params(nbins=5)
        bar.ax.ticklabel_format(scilimits=(-2, 3), useMathText=True)
    bar.ax.xaxis.get_offset_text().set(size=7, color=MUTED)
    bar.set_label(title, size=8, labelpad=2)
