"""A picture of the mesh: the whole, and close-ups at the contact and at a re-entrant corner."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.patches import Rectangle

from pinnray.comparison.figures import body
from pinnray.comparison.figures.canvas import Extent
from pinnray.comparison.figures.style import HALO, axes_at, write_heading
from pinnray.geometry.mesh.boundary import edge_paths, singular_points
from pinnray.geometry.mesh.triangle_mesh import TriangleMesh
from pinnray.runtime.arrays import FloatArray
from pinnray.runtime.figure import CONTACT, INK, MEASURED, SMALL, WIDTH, Figure, figure

HEAD, INSET_TITLE, MARGIN = 0.48, 0.24, 0.1
"""Heights of the headings, and the margin, inches."""


def mesh_numbers(mesh: TriangleMesh) -> dict[str, str]:
    """Size of a mesh, range of its edge lengths and quality of its triangles (`quality`), as text."""
    ends = mesh.points[mesh.edges]
    length = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    good = quality(mesh)
    return {
        "size": f"{len(mesh.points)} nodes, {len(mesh.triangles)} triangles",
        "edges": f"{length.min():.3g} to {length.max():.3g} mm",
        "quality": f"worst {good.min():.2f}, mean {good.mean():.2f}",
    }


def quality(mesh: TriangleMesh) -> FloatArray:
    """Twice the inscribed over the circumscribed radius of every triangle, shape (t,).

    One for an equilateral triangle, zero for a flat one.
    """
    corners = mesh.points[mesh.triangles]
    a, b, c = (np.linalg.norm(corners[:, i] - corners[:, (i + 1) % 3], axis=1) for i in range(3))
    return np.asarray((b + c - a) * (c + a - b) * (a + b - c) / (a * b * c))


def draw_mesh(mesh: TriangleMesh) -> Figure:
    """Draw the whole mesh and two close-ups: the contact, and a re-entrant corner or an end of the base."""
    width = WIDTH - 2 * MARGIN
    size = float(np.ptp(mesh.points, axis=0).max())
    whole = body.panel_extent(mesh.points, width, margin=0.025 * size, tallest=4.2)
    height = width * whole.height / whole.width
    inset_width, inset_height = (WIDTH - 3 * MARGIN) / 2, 1.5
    windows = _close_ups(mesh, inset_height / inset_width)
    numbers = mesh_numbers(mesh)
    note = f"{numbers['size']}; edges {numbers['edges']}; quality: {numbers['quality']}"
    with figure(HEAD + height + INSET_TITLE + inset_height + MARGIN) as drawn:
        write_heading(drawn, "Mesh, shared by every solver", note)
        axes = axes_at(drawn, (MARGIN, HEAD, width, height))
        _draw(axes, mesh, whole, 0.12)
        body.clamp(axes, body.base_lines(mesh), size=body.hatch_size(mesh.points))
        body.scale_bar(axes, whole)
        for number, (letter, (title, window)) in enumerate(zip("AB", windows.items(), strict=True)):
            _frame(axes, whole, window, letter)
            left = MARGIN + number * (inset_width + MARGIN)
            inset = axes_at(drawn, (left, HEAD + height + INSET_TITLE, inset_width, inset_height))
            _draw(inset, mesh, window, 0.4)
            inset.set_axis_on()
            inset.tick_params(bottom=False, left=False, labelbottom=False, labelleft=False)
            for spine in inset.spines.values():
                spine.set(visible=True, color=MEASURED, linewidth=0.9)
            inset.set_title(f"{letter}: {title}, {window.width:.2g} mm across", size=SMALL, pad=3)
    return drawn


def _close_ups(mesh: TriangleMesh, ratio: float) -> dict[str, Extent]:
    """The windows of the close-ups, `ratio` times as high as wide, by their titles."""
    contact = mesh.points[np.unique(mesh.boundary("contact"))]
    span = max(2.6 * float(np.ptp(contact[:, 0])), 0.055 * float(np.ptp(mesh.points, axis=0).max()))
    middle = contact.mean(axis=0)
    corners = singular_points(mesh)
    joint = corners[np.linalg.norm(corners - middle - (2 * span, 0), axis=1).argmin()]
    return {
        "contact": _window(middle - (0, 0.33 * span * ratio), span, ratio),
        "corner": _window(_inward(mesh, joint, 1.4 * span, ratio), 1.4 * span, ratio),
    }


def _inward(mesh: TriangleMesh, middle: FloatArray, width: float, ratio: float) -> FloatArray:
    """The middle of a window, moved so that at most a tenth of it lies beyond the body's bounds."""
    room = 0.4 * np.array([width, width * ratio])
    low, high = mesh.points.min(axis=0) + room, mesh.points.max(axis=0) - room
    return np.where(low < high, np.clip(middle, low, high), (low + high) / 2)


def _frame(axes: Axes, whole: Extent, window: Extent, letter: str) -> None:
    """A frame around a window, with its letter beside it."""
    corner = (window.left, window.bottom)
    axes.add_patch(Rectangle(corner, window.width, window.height, fill=False, ec=MEASURED, lw=0.9, zorder=5))
    crowded = window.right > whole.right - 0.04 * whole.width
    axes.annotate(
        letter,
        (window.left if crowded else window.right, window.bottom),
        xytext=(-2 if crowded else 2, 0),
        textcoords="offset points",
        ha="right" if crowded else "left",
        color=MEASURED,
        weight="bold",
        path_effects=HALO,
        zorder=6,
    )


def _window(middle: FloatArray, width: float, ratio: float) -> Extent:
    """A rectangle around a point, `ratio` times as high as wide, mm."""
    half = np.array([width, width * ratio]) / 2
    return Extent.around(np.stack([middle - half, middle + half]), margin=0.0)


def _draw(axes: Axes, mesh: TriangleMesh, window: Extent, width: float) -> None:
    body.prepare(axes, window)
    ends = mesh.points[mesh.edges]
    beyond = (ends.max(axis=1) < (window.left, window.bottom)) | (
        ends.min(axis=1) > (window.right, window.top)
    )
    inside = ~beyond.any(axis=1)
    axes.add_collection(LineCollection(list(ends[inside]), colors="#3d5a80", linewidths=width), autolim=False)
    boundary = edge_paths(mesh.boundary_edges)
    body.draw_outline(axes, boundary, mesh.points, colour=INK, width=0.5 if width < 0.3 else 1.0)
    contact = edge_paths(mesh.boundary("contact"))
    body.draw_outline(axes, contact, mesh.points, colour=CONTACT, width=2.2, zorder=4)
    axes.plot(*mesh.markers.T, "o", ms=2.5, mfc=MEASURED, mec="white", mew=0.5, zorder=4)
