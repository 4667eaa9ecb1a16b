"""A picture of the mesh: the whole, and close-ups where it is finest and where a rib meets a wall."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.patches import Rectangle

from compare.figures import body
from compare.figures.canvas import Extent
from compare.figures.style import axes_at, heading
from geometry.arrays import FloatArray
from geometry.figure import CONTACT, INK, MEASURED, WIDTH, Figure, figure
from geometry.mesh.boundary import boundary_edges
from geometry.mesh.triangle_mesh import TriangleMesh

MARGIN = 0.1
HEAD, INSET_TITLE = 0.48, 0.24
LINE = "#3d5a80"


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


def inner_corner(mesh: TriangleMesh, near: float) -> FloatArray:
    """The re-entrant corner of a cavity with the abscissa nearest to `near`, shape (2,), mm.

    Re-entrant means that the body fills more than a straight angle around the node; where there is none, any
    node of the boundary will do.
    """
    corners = mesh.points[mesh.triangles]
    angle = np.zeros(len(mesh.points))
    for i in range(3):
        ahead, behind = corners[:, (i + 1) % 3] - corners[:, i], corners[:, (i + 2) % 3] - corners[:, i]
        cross = ahead[:, 0] * behind[:, 1] - ahead[:, 1] * behind[:, 0]
        np.add.at(angle, mesh.triangles[:, i], np.arctan2(cross, (ahead * behind).sum(axis=1)))
    boundary = np.unique(boundary_edges(mesh.triangles))
    sharp = boundary[angle[boundary] > np.radians(200)]
    candidates = mesh.points[sharp if len(sharp) else boundary]
    return np.asarray(candidates[np.abs(candidates[:, 0] - near).argmin()])


def draw_mesh(mesh: TriangleMesh) -> Figure:
    """Draw the whole mesh and two close-ups: the contact, and a joint of a rib and a wall."""
    whole = Extent.around(mesh.points, margin=0.02 * float(np.ptp(mesh.points[:, 0])))
    width = WIDTH - 2 * MARGIN
    height = width * whole.height / whole.width
    inset_width, inset_height = (WIDTH - 3 * MARGIN) / 2, 1.5
    contact = mesh.points[np.unique(mesh.boundary("contact"))]
    span = max(2.6 * float(np.ptp(contact[:, 0])), 0.055 * whole.width)
    middle = contact.mean(axis=0)
    joint = inner_corner(mesh, float(middle[0]) + 2 * span)
    ratio = inset_height / inset_width
    windows = [
        ("A: contact", _window(middle - (0, 0.33 * span * ratio), span, ratio)),
        ("B: inner corner", _window(joint, 1.4 * span, ratio)),
    ]
    numbers = mesh_numbers(mesh)
    note = f"{numbers['size']}; edges {numbers['edges']}; quality: {numbers['quality']}"
    with figure(HEAD + height + INSET_TITLE + inset_height + MARGIN) as drawn:
        heading(drawn, "Mesh, shared by every solver", note)
        axes = axes_at(drawn, (MARGIN, HEAD, width, height))
        _draw(axes, mesh, whole, 0.12)
        body.clamp(axes, mesh.points[mesh.boundary("base").ravel()])
        body.scale_bar(axes, whole)
        for number, (title, window) in enumerate(windows):
            corner = (window.left, window.bottom)
            axes.add_patch(
                Rectangle(corner, window.width, window.height, fill=False, ec=MEASURED, lw=0.9, zorder=5)
            )
            crowded = window.right > whole.right - 0.04 * whole.width
            axes.annotate(
                title[0],
                (window.left if crowded else window.right, window.bottom),
                xytext=(-2 if crowded else 2, 0),
                textcoords="offset points",
                ha="right" if crowded else "left",
                color=MEASURED,
                weight="bold",
                zorder=6,
            )
            left = MARGIN + number * (inset_width + MARGIN)
            inset = axes_at(drawn, (left, HEAD + height + INSET_TITLE, inset_width, inset_height))
            _draw(inset, mesh, window, 0.4)
            inset.set_axis_on()
            inset.tick_params(bottom=False, left=False, labelbottom=False, labelleft=False)
            for spine in inset.spines.values():
                spine.set(visible=True, color=MEASURED, linewidth=0.9)
            inset.set_title(title, size=8, pad=3)
            body.scale_bar(inset, window)
    return drawn


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
    axes.add_collection(LineCollection(list(ends[inside]), colors=LINE, linewidths=width), autolim=False)
    body.outline(
        axes, boundary_edges(mesh.triangles), mesh.points, colour=INK, width=0.5 if width < 0.3 else 1.0
    )
    body.outline(axes, mesh.boundary("contact"), mesh.points, colour=CONTACT, width=2.2, zorder=4)
    axes.plot(*mesh.markers.T, "o", ms=2.5, mfc=MEASURED, mec="white", mew=0.5, zorder=4)
