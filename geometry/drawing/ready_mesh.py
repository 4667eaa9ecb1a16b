"""The triangle mesh of a file in the finger's frame, with its boundaries named as every solver expects."""

import numpy as np

from pinnray.geometry.drawing.formats.drawing import MeshInFile
from pinnray.geometry.drawing.placement import Placement
from pinnray.geometry.mesh.boundary import counter_clockwise
from pinnray.geometry.mesh.triangle_mesh import TriangleMesh, boundary_edges
from pinnray.geometry.section.section import Section
from pinnray.runtime.arrays import FloatArray
from pinnray.runtime.errors import UserError


def ready_mesh(
    found: MeshInFile,
    placement: Placement,
    section: Section,
    markers: FloatArray,
    contact: tuple[float, float],
) -> TriangleMesh:
    """The mesh of a file as it is; edges on pieces of the section have their names.

    Args:
        found: The mesh in the drawing's frame.
        placement: Into the finger's frame.
        section: Its section in the finger's frame, with named pieces.
        markers: Places of the markers in the finger's frame, shape (m, 2), mm; each goes to the nearest node.
        contact: X of the contact's middle and its width, mm; it has the edges of the front whose middles it
            covers or, if there is none, the nearest one.
    """
    points = placement(found.points)
    triangles = counter_clockwise(points, found.triangles)
    rim = boundary_edges(triangles)
    places = section.outline.places(points[rim].mean(axis=1))
    names = np.where(places.distances <= 1e-3, np.array(section.outline.names)[places.pieces], "")
    boundaries = {name: rim[names == name] for name in ("base", "front", "back")}
    off = np.abs(points[boundaries["front"]].mean(axis=1)[:, 0] - contact[0])
    boundaries["contact"] = boundaries["front"][off <= max(contact[1] / 2, off.min())]
    nodes = np.linalg.norm(points[:, None] - markers, axis=2).argmin(axis=0)
    if len(np.unique(nodes)) < len(nodes):
        raise UserError("two markers are nearest to one node of the mesh; give markers further apart")
    touched = np.unique(boundaries["contact"])
    return TriangleMesh(
        points=points,
        triangles=triangles,
        boundaries={name: edges for name, edges in boundaries.items() if len(edges)},
        marker_nodes=nodes,
        contact_node=int(touched[np.abs(points[touched, 0] - contact[0]).argmin()]),
    )
