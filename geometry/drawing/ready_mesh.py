"""The triangle mesh of a file in the finger's frame, with its boundaries named as every solver expects."""

import numpy as np
import shapely

from geometry.arrays import BoolArray, FloatArray, IntArray
from geometry.drawing.formats.drawing import MeshInFile
from geometry.drawing.placement import Placement
from geometry.errors import UserError
from geometry.mesh.boundary import boundary_edges
from geometry.mesh.triangle_mesh import TriangleMesh
from geometry.section.section import Section

ON_PIECE = 1e-3
"""Largest distance of a boundary edge's middle from the piece that names it, mm."""


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

    Raises:
        UserError: If a triangle is flat, two markers share a node, or a named edge is not on the boundary.
    """
    points = placement(found.points)
    triangles = found.triangles.copy()
    corners = points[triangles]
    first, second = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    clockwise = first[:, 0] * second[:, 1] < first[:, 1] * second[:, 0]
    triangles[clockwise] = triangles[clockwise][:, [0, 2, 1]]
    rim = boundary_edges(triangles)
    named = {name: _directed(edges, rim, name) for name, edges in found.edges.items() if name in _NAMES}
    boundaries = {
        name: rim[_on_pieces(points[rim].mean(axis=1), section, name)] for name in _NAMES if name != "contact"
    } | named
    if "front" not in named:
        inside = np.isin(_keys(boundaries["contact"]), _keys(boundaries["front"]))
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


_NAMES = ("base", "front", "back", "contact")


def _keys(edges: IntArray) -> IntArray:
    """One number for each edge, whatever its direction."""
    ordered = np.sort(edges, axis=1).astype(np.int64)
    return np.asarray(ordered[:, 0] * 2**32 + ordered[:, 1])


def _directed(edges: IntArray, rim: IntArray, name: str) -> IntArray:
    """The edges of a group as they run along the rim."""
    keys = _keys(rim)
    wanted = _keys(edges)
    if not np.isin(wanted, keys).all():
        raise UserError(f"an edge of the physical group {name!r} is not on the boundary of the mesh")
    return np.asarray(rim[np.isin(keys, wanted)])


def _on_pieces(middles: FloatArray, section: Section, name: str) -> BoolArray:
    """Mask of the points (k, 2) on the pieces of a name."""
    near = np.zeros(len(middles), dtype=bool)
    for loop, which in section.named(name):
        line = shapely.LineString(loop.along(which, np.linspace(0, 1, 200)))
        near |= shapely.distance(shapely.points(middles), line) <= ON_PIECE
    return near
