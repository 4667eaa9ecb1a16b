"""The triangle mesh of a file in the finger's frame, with its boundaries named as every solver expects."""

from collections.abc import Mapping

import numpy as np

from pinnray.geometry.drawing.description import PartMaterial
from pinnray.geometry.drawing.formats.drawing import MeshInFile, label_of
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
    materials: Mapping[str, PartMaterial],
) -> TriangleMesh:
    """The mesh of a file as it is; edges on pieces of the section have their names.

    Args:
        found: The mesh in the drawing's frame.
        placement: Into the finger's frame.
        section: Its section in the finger's frame, with named pieces.
        markers: Places of the markers in the finger's frame, shape (m, 2), mm; each goes to the nearest node.
        contact: X of the contact's middle and its width, mm; it has the edges of the front whose middles it
            covers or, if there is none, the nearest one.
        materials: Of parts by the names of their physical surfaces.
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
        moduli=_moduli(found, materials) if materials else None,
    )


def _moduli(found: MeshInFile, materials: Mapping[str, PartMaterial]) -> FloatArray:
    """Young's modulus and Poisson's ratio of every triangle, shape (t, 2); zeros outside the parts."""
    moduli = np.zeros((len(found.triangles), 2))
    for name, part in materials.items():
        rows = found.parts.get(label_of(name))
        if rows is None:
            known = ", ".join(found.parts) or "none with a name"
            raise UserError(f"there is no physical surface {name!r} to give a material; there are {known}")
        if moduli[rows].any():
            raise UserError(f"the physical surface {name!r} overlaps another one that has a material")
        moduli[rows] = part.young, part.poisson
    return moduli
