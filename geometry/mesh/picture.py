"""A mesh, or a field on the deformed mesh, as a picture."""

import numpy as np
from matplotlib.collections import LineCollection
from matplotlib.colors import Normalize
from matplotlib.tri import Triangulation

from geometry.arrays import FloatArray
from geometry.figure import CONTACT, INK, MEASURED, MUTED, Figure, body_figure
from geometry.mesh.boundary import boundary_edges
from geometry.mesh.triangle_mesh import TriangleMesh

SHARE = 0.995
"""Share of the area within the colour scale: stress has no bound at sharp corners."""

FOOT = 0.5
"""Height of the colour bar with its label, inches."""


def plot_mesh(mesh: TriangleMesh) -> Figure:
    """Draw every triangle, the contact and the markers."""
    title = f"Mesh, {len(mesh.points)} nodes, {len(mesh.triangles)} triangles"
    with body_figure(mesh.points, title) as (drawn, axes):
        axes.triplot(*mesh.points.T, mesh.triangles, color=INK, lw=0.2)
        axes.plot(*mesh.points[np.unique(mesh.boundary("contact"))].T, color=CONTACT, lw=2.5, label="contact")
        axes.plot(*mesh.markers.T, "o", ms=3, color=MEASURED, label="markers")
        axes.legend(loc="lower right")
    return drawn


def plot_field(
    mesh: TriangleMesh, displacement: FloatArray, values: FloatArray, *, title: str, label: str
) -> Figure:
    """Draw a field on the deformed mesh, with the outline of the undeformed one.

    Args:
        mesh: The mesh.
        displacement: Of the nodes, shape (n, 2), mm, as it is to be drawn.
        values: Of the field in each triangle, shape (t,), not negative.
        title: Of the picture.
        label: Quantity and unit, for the colour bar.
    """
    order = np.argsort(values)
    area = np.cumsum(mesh.areas[order])
    high = float(values[order][np.searchsorted(area, SHARE * area[-1])])
    points, edges = mesh.points + displacement, boundary_edges(mesh.triangles)
    with body_figure(np.concatenate([mesh.points, points]), title, foot=FOOT) as (drawn, axes):
        axes.add_collection(LineCollection(list(mesh.points[edges]), colors=MUTED, linewidths=0.5))
        colours = axes.tripcolor(
            Triangulation(points[:, 0], points[:, 1], mesh.triangles),
            facecolors=values,
            norm=Normalize(0, high or 1.0),
            antialiased=False,
        )
        axes.add_collection(LineCollection(list(points[edges]), colors=INK, linewidths=0.6))
        height = drawn.get_figheight()
        place = drawn.add_axes((0.2, 0.38 / height, 0.6, 0.09 / height))
        drawn.colorbar(colours, cax=place, orientation="horizontal", label=label, extend="max")
    return drawn
