"""The mesh of a finger by Gmsh: its section goes there directly, without CAD."""

import tempfile
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

import gmsh
import numpy as np

from pinnray.geometry.finger.finger import Finger, outline_with_contact
from pinnray.geometry.mesh.boundary import are_among, counter_clockwise, elements_through_thickness
from pinnray.geometry.mesh.element_size import TRIES, contact_points, size_field
from pinnray.geometry.mesh.settings import MeshSettings
from pinnray.geometry.mesh.triangle_mesh import TriangleMesh, boundary_edges
from pinnray.geometry.section.loop import Loop
from pinnray.geometry.section.section import Section
from pinnray.geometry.section.thickness import corner_turns
from pinnray.runtime.arrays import FloatArray, IntArray
from pinnray.runtime.atomic import write_bytes
from pinnray.runtime.errors import UserError

MIN_ELEMENTS = 3
"""Least number of elements through the thickness of every wall and rib."""


class Triangulation(NamedTuple):
    """Nodes (n, 2), mm, triangles (t, 3) counter-clockwise, and edges (k, 2) on the pieces of each name."""

    points: FloatArray
    triangles: IntArray
    edges: Mapping[str, IntArray]


def build_mesh(finger: Finger, settings: MeshSettings, across: int | None = None) -> TriangleMesh:
    """Mesh the section of a finger.

    The contact's ends and middle are nodes of the front face and every marker is a node. Boundary edges have
    the body on their left. The result depends on the arguments and on Gmsh's version only. Every wall and rib
    gets at least `across` elements through its thickness.

    Returns:
        The mesh with the boundaries `base`, `front`, `contact` and every other name of the outline's pieces.
    """
    across = MIN_ELEMENTS if across is None else across
    for elements in TRIES:
        mesh = _named(finger, _triangulation(finger, settings, elements * across / MIN_ELEMENTS))
        if (least := elements_through_thickness(mesh)) >= across:
            return mesh
    raise UserError(
        f"the mesh has only {least} elements through the thinnest wall or rib, {across} are "
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
            _set_sizes(field, grown, settings, Path(folder))
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
    found += [loop.points[corner_turns(loop) < -np.radians(10)] for loop in section.loops]
    return np.concatenate(found)


def _named(finger: Finger, found: Triangulation) -> TriangleMesh:
    """The mesh with its boundaries, markers and contact."""
    points = found.points.copy()
    triangles = counter_clockwise(points, found.triangles)
    edges = boundary_edges(triangles)
    names = {name: list(nodes) for name, nodes in found.edges.items() if name}
    names["front"] = [*names.get("front", []), *names["contact"]]
    boundaries = {name: edges[are_among(edges, np.array(nodes))] for name, nodes in names.items()}
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


def _nodes_at(points: FloatArray, wanted: FloatArray, what: str) -> IntArray:
    """The nodes at positions (m, 2), mm, moved there to the last digit."""
    nodes = np.array([((points - position) ** 2).sum(axis=1).argmin() for position in wanted], dtype=np.int64)
    if np.abs(points[nodes] - wanted).max(initial=0) > 1e-7:
        raise UserError(f"the mesh has no node at a {what}; this is a fault of the mesher, please report it")
    points[nodes] = wanted
    return nodes


def _set_sizes(
    field: tuple[FloatArray, FloatArray, float],
    points: Iterable[tuple[FloatArray, float]],
    settings: MeshSettings,
    folder: Path,
) -> None:
    """Give the current Gmsh model a size field, and points (k, 2), mm, from which elements of a size grow."""
    sizes, origin, spacing = field
    path = folder / "sizes.bin"
    grid = np.array([*origin, 0.0, spacing, spacing, 1.0]), np.array([*sizes.shape, 1], dtype=np.int32)
    write_bytes(path, b"".join(array.tobytes() for array in (*grid, sizes)))
    model = gmsh.model.mesh.field
    fields = [model.add("Structured")]
    model.setString(fields[0], "FileName", str(path))
    largest = settings.size * settings.coarsening
    for places, fine in points:
        tags = [gmsh.model.geo.addPoint(x, y, 0) for x, y in places]
        gmsh.model.geo.synchronize()
        distance, threshold = model.add("Distance"), model.add("Threshold")
        model.setNumbers(distance, "PointsList", tags)
        model.setNumber(threshold, "InField", distance)
        model.setNumber(threshold, "SizeMin", fine)
        model.setNumber(threshold, "SizeMax", largest)
        model.setNumber(threshold, "DistMin", 0.0)
        model.setNumber(threshold, "DistMax", max(largest - fine, 1e-9) / settings.growth)
        fields.append(threshold)
    smallest = model.add("Min")
    model.setNumbers(smallest, "FieldsList", fields)
    model.setAsBackgroundMesh(smallest)


@contextmanager
def session() -> Iterator[None]:
    """Gmsh with this project's options: silent, one thread, the same random numbers every time.

    The PETSc in it would take options from a `.petscrc` in the working folder, which may be of others: it
    could load a library. Gmsh warns of the option against that, which is not its own, unless it is quiet.
    """
    gmsh.initialize(argv=["gmsh", "-v", "0", "-skip_petscrc"], readConfigFiles=False, interruptible=False)
    try:
        gmsh.option.setNumber("General.Verbosity", 5)
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.option.setNumber("General.NumThreads", 1)
        gmsh.option.setNumber("Mesh.Algorithm", 6)
        gmsh.option.setNumber("Mesh.RandomSeed", 1)
        gmsh.option.setNumber("Mesh.Smoothing", 1)
        gmsh.option.setNumber("Mesh.MeshSizeExtendFromBoundary", 0)
        gmsh.option.setNumber("Mesh.MeshSizeFromPoints", 0)
        gmsh.option.setNumber("Mesh.MeshSizeFromCurvature", 0)
        yield
    finally:
        gmsh.finalize()


def add_section(loops: tuple[Loop, ...], inner: FloatArray) -> dict[str, list[int]]:
    """Add a surface between curves with nodes at points (m, 2), mm; return the curves' tags by name."""
    geo = gmsh.model.geo
    named: dict[str, list[int]] = {}
    tags = []
    for loop in loops:
        pieces = _without_long_arcs(loop)
        corners = [geo.addPoint(x, y, 0) for x, y in pieces.points]
        curves = []
        for which, (start, name) in enumerate(zip(corners, pieces.names, strict=True)):
            end = corners[(which + 1) % len(corners)]
            if which in pieces.straight:
                curves.append(geo.addLine(start, end))
            else:
                centre, _ = pieces.circle(which)
                curves.append(geo.addCircleArc(start, geo.addPoint(*centre, 0), end))
            named.setdefault(name, []).append(curves[-1])
        tags.append(geo.addCurveLoop(curves))
    surface = geo.addPlaneSurface(tags)
    points = [geo.addPoint(x, y, 0) for x, y in inner]
    geo.synchronize()
    gmsh.model.mesh.embed(0, points, 2, surface)
    return named


def triangulate(named: Mapping[str, list[int]]) -> Triangulation:
    """Mesh the current model; `named` are the curves that `add_section` gave."""
    gmsh.model.mesh.generate(2)
    tags, coordinates, _ = gmsh.model.mesh.getNodes()
    _, connectivity = gmsh.model.mesh.getElementsByType(2)
    used, triangles = np.unique(connectivity, return_inverse=True)
    order = np.argsort(tags)
    position = order[np.searchsorted(tags, used, sorter=order)]
    edges = {
        name: np.concatenate([gmsh.model.mesh.getElementsByType(1, tag)[1] for tag in curves])
        for name, curves in named.items()
    }
    return Triangulation(
        points=coordinates.reshape(-1, 3)[position, :2].copy(),
        triangles=triangles.reshape(-1, 3),
        edges={name: np.searchsorted(used, nodes).reshape(-1, 2) for name, nodes in edges.items()},
    )


def _without_long_arcs(loop: Loop) -> Loop:
    """The curve with its arcs cut into equal parts of less than half a circle, the longest that Gmsh has."""
    parts = np.maximum(np.ceil(np.abs(4 * np.arctan(loop.bulges)) / (0.9 * np.pi)).astype(int), 1)
    for which in np.flatnonzero(parts > 1)[::-1]:
        loop = loop.split(int(which), list(np.arange(1, parts[which]) / parts[which]))
    return loop
