"""The mesh of a finger: its section goes to Gmsh directly, without CAD."""

import tempfile
from pathlib import Path

import numpy as np

from geometry.arrays import FloatArray, IntArray
from geometry.errors import UserError
from geometry.finger.contact import CONTACT, outline_with_contact
from geometry.finger.finger import Finger
from geometry.mesh.boundary import boundary_edges, elements_through_thickness
from geometry.mesh.element_size import TRIES, contact_points, set_sizes, size_field
from geometry.mesh.gmsh_model import Triangulation, add_section, session, triangulate
from geometry.mesh.settings import MeshSettings
from geometry.mesh.triangle_mesh import TriangleMesh, signed_areas
from geometry.section.section import Section

MIN_ELEMENTS = 3
"""Least number of elements through the thickness of every wall and rib."""

TOLERANCE = 1e-7
"""Maximum distance of a node from a position that it has, mm."""

RE_ENTRANT = np.radians(10)
"""Least turn of the boundary at a re-entrant corner."""


def build_mesh(finger: Finger, settings: MeshSettings) -> TriangleMesh:
    """Mesh the section of a finger.

    The contact's ends and middle are nodes of the front face and every marker is a node. Boundary edges have
    the body on their left. The result depends on the arguments and on Gmsh's version only.

    Args:
        finger: The finger.
        settings: Element sizes.

    Returns:
        The mesh with the boundaries `base`, `front`, `contact` and every other name of the outline's pieces.

    Raises:
        UserError: If some wall or rib cannot get three elements across.
    """
    for elements in TRIES:
        mesh = _named(finger, _triangulation(finger, settings, elements))
        if (least := elements_through_thickness(mesh)) >= MIN_ELEMENTS:
            return mesh
    raise UserError(
        f"the mesh has only {least} elements through the thinnest wall or rib, {MIN_ELEMENTS} are "
        f"needed; lower the mesh size below {settings.size:g} mm"
    )


def _triangulation(finger: Finger, settings: MeshSettings, elements: float) -> Triangulation:
    section, contact = finger.section, contact_points(finger)
    grown = [(contact, min(settings.contact_size, settings.size))] if settings.contact_size else []
    if settings.corner_size is not None:
        grown.append((_corners(section), min(settings.corner_size, settings.size)))
    field = size_field(section, contact, settings, elements)
    with tempfile.TemporaryDirectory() as folder, session():
        try:
            curves = add_section((outline_with_contact(finger), *section.cavities), finger.markers)
            set_sizes(field, grown, settings, Path(folder))
            return triangulate(curves)
        except (OSError, MemoryError):
            raise
        except Exception as error:
            # Gmsh raises bare Exception with its last message, which is empty where it got no memory.
            if not str(error).strip():
                raise MemoryError from error
            raise UserError(
                f"Gmsh could not mesh design {finger.name!r}: {error}; try another mesh size"
            ) from error


def _corners(section: Section) -> FloatArray:
    """Re-entrant corners and the ends of the base, shape (k, 2), mm."""
    found = [loop.ends[which] for loop, which in section.named("base")]
    for loop in section.loops:
        along = loop.ends[:, 1] - loop.ends[:, 0]
        angle, half = np.arctan2(along[:, 1], along[:, 0]), 2 * np.arctan(loop.bulges)
        turn = (angle - half) - np.roll(angle + half, 1)
        turn = (turn + np.pi) % (2 * np.pi) - np.pi
        found.append(loop.points[turn < -RE_ENTRANT])
    return np.concatenate(found)


def _named(finger: Finger, found: Triangulation) -> TriangleMesh:
    """The mesh with its boundaries, markers and contact."""
    triangles, points = found.triangles.copy(), found.points.copy()
    clockwise = signed_areas(points, triangles) < 0
    triangles[clockwise] = triangles[clockwise][:, [0, 2, 1]]
    edges = boundary_edges(triangles)
    keys = _keys(edges, len(points))
    names = {name: list(nodes) for name, nodes in found.edges.items() if name}
    names["front"] = [*names.get("front", []), *names[CONTACT]]
    boundaries = {
        name: edges[np.isin(keys, _keys(np.array(nodes), len(points)))] for name, nodes in names.items()
    }
    middle = finger.section.front_point(finger.contact_abscissa)[None]
    contact_node = int(_nodes_at(points, middle, "middle of the contact")[0])
    return TriangleMesh(
        points=points,
        triangles=triangles,
        boundaries=boundaries,
        marker_nodes=_nodes_at(points, finger.markers, "marker"),
        contact_node=contact_node,
        depth=finger.depth,
    )


def _keys(edges: IntArray, count: int) -> IntArray:
    """One number for each edge, shape (k, 2), of a mesh of `count` nodes, whichever way it runs."""
    ordered = np.sort(edges, axis=1)
    return np.asarray(ordered[:, 0] * count + ordered[:, 1], dtype=np.int64)


def _nodes_at(points: FloatArray, wanted: FloatArray, what: str) -> IntArray:
    """The nodes at positions (m, 2), mm, moved there to the last digit."""
    nodes = np.array([((points - position) ** 2).sum(axis=1).argmin() for position in wanted], dtype=np.int64)
    if np.abs(points[nodes] - wanted).max(initial=0) > TOLERANCE:
        raise UserError(f"the mesh has no node at a {what}; this is a fault of the mesher, please report it")
    points[nodes] = wanted
    return nodes
