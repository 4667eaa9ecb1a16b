"""The triangle mesh of a file in the finger's frame, with its boundaries named as every solver expects."""

import numpy as np
import shapely

from geometry.arrays import BoolArray, FloatArray
from geometry.drawing.formats.drawing import MeshInFile
from geometry.drawing.placement import Placement
from geometry.errors import UserError
from geometry.mesh.boundary import are_among, boundary_edges, counter_clockwise
from geometry.mesh.triangle_mesh import TriangleMesh
from geometry.section.section import Section


def ready_mesh(
    found: MeshInFile, placement: Placement, section: Section, markers: FloatArray, contact: float
) -> TriangleMesh:
    """The mesh of a file as it is.

    Args:
        found: The mesh in the drawing's frame.
        placement: Into the finger's frame.
        section: Its section in the finger's frame, with named pieces.
        markers: Places of the markers in the finger's frame, shape (m, 2), mm; each goes to the nearest node.
        contact: X of the contact's middle, mm; the contact's node is the one nearest to it.
    """
    points = placement(found.points)
    triangles = counter_clockwise(points, found.triangles)
    rim = boundary_edges(triangles)
    boundaries = {}
    for name in ("base", "front", "back", "contact"):
        if name not in found.edges:
            boundaries[name] = rim[_on_pieces(points[rim].mean(axis=1), section, name)]
        elif not are_among(found.edges[name], rim).all():
            raise UserError(f"an edge of the physical group {name!r} is not on the boundary of the mesh")
        else:
            boundaries[name] = rim[are_among(rim, found.edges[name])]
    if "front" not in found.edges:
        inside = are_among(boundaries["contact"], boundaries["front"])
        boundaries["front"] = np.concatenate([boundaries["front"], boundaries["contact"][~inside]])
    nodes = np.linalg.norm(points[:, None] - markers, axis=2).argmin(axis=0)
    if len(np.unique(nodes)) < len(nodes):
        raise UserError("two markers are nearest to one node of the mesh; give markers further apart")
    touched = np.unique(boundaries["contact"])
    return TriangleMesh(
        points=points,
        triangles=triangles,
        boundaries={name: edges for name, edges in boundaries.items() if len(edges)},
        marker_nodes=nodes,
        contact_node=int(touched[np.abs(points[touched, 0] - contact).argmin()]),
    )


def _on_pieces(middles: FloatArray, section: Section, name: str) -> BoolArray:
    """Mask of the points (k, 2) on the pieces of a name."""
    near = np.zeros(len(middles), dtype=bool)
    for loop, which in section.named(name):
        line = shapely.LineString(loop.along(which, np.linspace(0, 1, 200)))
        near |= shapely.distance(shapely.points(middles), line) <= 1e-3
    return near
