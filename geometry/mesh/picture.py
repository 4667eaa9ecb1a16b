"""A field on the deformed mesh as a picture."""

import numpy as np
from matplotlib.collections import LineCollection
from matplotlib.colors import Normalize
from matplotlib.tri import Triangulation

from pinnray.geometry.mesh.triangle_mesh import TriangleMesh
from pinnray.runtime.arrays import FloatArray, weighted_percentile
from pinnray.runtime.figure import INK, MUTED, Figure, body_figure


def plot_field(
    mesh: TriangleMesh,
    displacement: FloatArray,
    values: FloatArray,
    *,
    title: str,
    label: str,
    signed: bool = False,
) -> Figure:
    """Draw a field on the deformed mesh, with the outline of the undeformed one.

    Args:
        mesh: The mesh.
        displacement: Of the nodes, shape (n, 2), mm, as it is to be drawn.
        values: Of the field in each triangle, shape (t,).
        title: Of the picture.
        label: Quantity and unit, for the colour bar.
        signed: Whether the colour scale is symmetric about zero; else it starts there.
    """
    # The colour scale holds 99.5 % of the area, because stress has no bound at sharp corners.
    high = weighted_percentile(np.abs(values), mesh.areas, 99.5)
    points, edges = mesh.points + displacement, mesh.boundary_edges
    with body_figure(np.concatenate([mesh.points, points]), title, foot=0.56) as (drawn, axes):
        axes.add_collection(LineCollection(list(mesh.points[edges]), colors=MUTED, linewidths=0.5))
        colours = axes.tripcolor(
            Triangulation(points[:, 0], points[:, 1], mesh.triangles),
            facecolors=values,
            norm=Normalize(-(high or 1.0) if signed else 0, high or 1.0),
            cmap="RdBu_r" if signed else None,
            antialiased=False,
        )
        axes.add_collection(LineCollection(list(points[edges]), colors=INK, linewidths=0.6))
        height = drawn.get_figheight()
        place = drawn.add_axes((0.2, 0.44 / height, 0.6, 0.09 / height))
        extend = "both" if signed else "max"
        drawn.colorbar(colours, cax=place, orientation="horizontal", label=label, extend=extend)
    return drawn
