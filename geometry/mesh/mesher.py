"""Mesh the finger with Gmsh, from the section that CadQuery wrote as BREP."""

import tempfile
from pathlib import Path

import gmsh
import numpy as np

from geometry.arrays import FloatArray, IntArray
from geometry.cad import section_brep
from geometry.errors import UserError
from geometry.finger.design import Design
from geometry.finger.section import finger_section, marker_positions
from geometry.mesh.boundary import boundary_edges, elements_through_thickness
from geometry.mesh.element_size import refinements, set_sizes
from geometry.mesh.settings import MeshSettings
from geometry.mesh.triangle_mesh import TriangleMesh, signed_areas

MIN_ELEMENTS = 3
"""Least number of elements through the thickness of every wall and rib."""

TRIES = (3.6, 4.8, 6.4)
"""Thickness over element size: the first that gives `MIN_ELEMENTS` is taken."""

TOLERANCE = 1e-7
"""Maximum distance of a node from a line or a position that it lies on, mm."""


def build_mesh(design: Design, settings: MeshSettings) -> TriangleMesh:
    """Mesh the section of a finger.

    The contact's ends and middle are nodes of the front face and every marker is a node. Boundary edges have
    the body on their left. The result depends on the arguments and on Gmsh's version only.

    Args:
        design: The finger.
        settings: Element sizes.

    Returns:
        The mesh with the boundaries `base`, `front`, `back` and `contact`.

    Raises:
        UserError: If some wall or rib cannot get three elements across.
    """
    with tempfile.TemporaryDirectory() as folder:
        brep = section_brep(design, Path(folder) / "section.brep")
        for elements in TRIES:
            points, triangles = _triangulate(design, settings, brep, elements)
            mesh = _named(design, points, triangles)
            if (least := elements_through_thickness(mesh)) >= MIN_ELEMENTS:
                return mesh
    raise UserError(
        f"the mesh has only {least} elements through the thinnest wall or rib, {MIN_ELEMENTS} are "
        f"needed; lower the mesh size below {settings.size:g} mm"
    )


def _triangulate(
    design: Design, settings: MeshSettings, brep: Path, elements: float
) -> tuple[FloatArray, IntArray]:
    """Run Gmsh once: points (n, 2), mm, and counter-clockwise triangles (t, 3)."""
    gmsh.initialize(argv=[], readConfigFiles=False, interruptible=False)
    try:
        for option, value in (
            ("General.Terminal", 0),
            ("General.NumThreads", 1),
            ("Mesh.Algorithm", 6),
            ("Mesh.RandomSeed", 1),
            ("Mesh.Smoothing", 3),
        ):
            gmsh.option.setNumber(option, value)
        faces = gmsh.model.occ.importShapes(str(brep))
        contact = [gmsh.model.occ.addPoint(x, 0, 0) for x in _contact_abscissae(design)]
        markers = [gmsh.model.occ.addPoint(x, y, 0) for x, y in marker_positions(design)]
        gmsh.model.occ.fragment(faces, [(0, tag) for tag in contact + markers])
        gmsh.model.occ.synchronize()
        shape = finger_section(design)
        corners = _points_at(np.concatenate([shape.outer[:2], *shape.cavities]))
        ends = _points_at(np.array([[x, 0.0] for x in _contact_abscissae(design)]))
        set_sizes(refinements(design, settings, elements, corners, ends), settings)
        gmsh.model.mesh.generate(2)
        tags, coordinates, _ = gmsh.model.mesh.getNodes()
        _, connectivity = gmsh.model.mesh.getElementsByType(2)
    except Exception as error:
        # Gmsh raises bare Exception with its last message.
        raise UserError(
            f"Gmsh could not mesh design {design.name!r}: {error}; try another mesh size"
        ) from error
    finally:
        gmsh.finalize()
    number = np.full(int(tags.max()) + 1, -1, dtype=np.int64)
    triangles = connectivity.reshape(-1, 3)
    used = np.unique(triangles)
    number[used] = np.arange(len(used))
    position = np.argsort(tags)[np.searchsorted(np.sort(tags), used)]
    points = coordinates.reshape(-1, 3)[position, :2].copy()
    triangles = number[triangles]
    clockwise = signed_areas(points, triangles) < 0
    triangles[clockwise] = triangles[clockwise][:, [0, 2, 1]]
    return points, triangles


def _named(design: Design, points: FloatArray, triangles: IntArray) -> TriangleMesh:
    """The mesh with its boundaries, markers and contact found by their coordinates."""
    points[np.abs(points) < TOLERANCE] = 0.0
    edges = boundary_edges(triangles)
    x, y = points[:, 0], points[:, 1]
    low, high = design.contact_ends
    slope = design.base_width / design.height
    front = np.abs(y) < TOLERANCE
    on = {
        "base": np.abs(x) < TOLERANCE,
        "front": front,
        "back": np.abs(y - slope * x + design.base_width) < TOLERANCE * np.hypot(1, slope),
        "contact": front & (x > low - TOLERANCE) & (x < high + TOLERANCE),
    }
    boundaries = {name: edges[nodes[edges].all(axis=1)] for name, nodes in on.items()}
    middle = np.array([[design.contact_abscissa, 0.0]])
    return TriangleMesh(
        points=points,
        triangles=triangles,
        boundaries=boundaries,
        marker_nodes=_nodes_at(points, marker_positions(design), "marker"),
        contact_node=int(_nodes_at(points, middle, "middle of the contact")[0]),
    )


def _nodes_at(points: FloatArray, wanted: FloatArray, what: str) -> IntArray:
    """The nodes at positions (m, 2), mm, moved there to the last digit."""
    nodes = np.array([((points - position) ** 2).sum(axis=1).argmin() for position in wanted], dtype=np.int64)
    if np.abs(points[nodes] - wanted).max() > TOLERANCE:
        raise UserError(f"the mesh has no node at a {what}; this is a fault of the mesher, please report it")
    points[nodes] = wanted
    return nodes


def _contact_abscissae(design: Design) -> tuple[float, float, float]:
    low, high = design.contact_ends
    return low, design.contact_abscissa, high


def _points_at(wanted: FloatArray) -> list[int]:
    """Tags of the current Gmsh model's points at positions (m, 2), mm, as far as they exist."""
    found = []
    for _, tag in gmsh.model.getEntities(0):
        x, y, _ = gmsh.model.getValue(0, tag, [])
        if (np.hypot(wanted[:, 0] - x, wanted[:, 1] - y) < TOLERANCE).any():
            found.append(tag)
    return found
