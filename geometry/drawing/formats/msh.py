"""Reads a Gmsh mesh: a plane triangle mesh as it is, or the section of an extruded body's mesh."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from itertools import combinations
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple

import gmsh
import numpy as np

from pinnray.geometry.drawing.formats.closed_loops import Closed, closed_loops, straightened
from pinnray.geometry.drawing.formats.drawing import LABELS, UNITS, Drawing, MeshInFile, Scale, label_of
from pinnray.geometry.drawing.formats.pieces import Piece, line
from pinnray.geometry.drawing.formats.planes import axes_across, plane_text
from pinnray.geometry.mesh.mesher import session
from pinnray.geometry.mesh.triangle_mesh import boundary_edges
from pinnray.runtime.arrays import FloatArray, IntArray
from pinnray.runtime.errors import UserError

CORNERS = {15: 1, 1: 2, 2: 3, 4: 4}
"""Corners of points, lines, triangles and tetrahedra of first order, by Gmsh's number of the type."""

TRIANGLE, TETRAHEDRON = 2, 4

FLAT = 1e-4
"""Largest distance of a corner from the straight line that replaces it, and from a plane, mm."""

SAME = 0.01
"""Largest relative difference of an extruded body's two ends, and of its volume: curved sides have facets."""


Close = Callable[[Sequence[Piece]], Closed]
"""Makes closed curves of pieces."""


class RawMesh(NamedTuple):
    """Nodes and elements of a file."""

    points: FloatArray  # (n, 3), mm
    cells: IntArray  # tetrahedra (k, 4), or triangles (k, 3) of a file without them
    edges: Mapping[str, IntArray]  # of the physical curves by name, (k, 2) each
    nodes: Mapping[str, IntArray]  # of the physical points by name


def read_msh(path: Path, units: str | None = None, tolerance: float | None = None) -> Drawing:
    """The section of a Gmsh mesh of triangles or tetrahedra of first order, of any version of the format.

    A plane mesh gives its boundary, with the physical groups as labels; one with the groups `base` (or
    `clamp`) and `contact` is kept as it is. The mesh of a body that is extruded along an axis gives the
    boundary of its end face; sides in one line are joined.

    Args:
        path: The file.
        units: Unit of its coordinates; None means mm.
        tolerance: Largest gap between two ends that is closed, mm; None means 0.001 mm.
    """
    scale = Scale(UNITS[units], units, "given") if units else Scale()
    raw = _raw(path, scale.length)
    drawing = _plane_mesh if raw.cells.shape[1] == 3 else _extruded_mesh
    return drawing(raw, lambda pieces: closed_loops(pieces, scale=scale, tolerance=tolerance), scale.length)


def _plane_mesh(raw: RawMesh, close: Close, unit: float) -> Drawing:
    used, triangles = np.unique(raw.cells, return_inverse=True)
    triangles = triangles.reshape(-1, 3)
    extent = np.ptp(raw.points[used], axis=0)
    across = int(extent.argmin())
    if extent[across] > FLAT:
        raise UserError("its surface is not plane; give a mesh of a plane section or of a solid")
    points = raw.points @ axes_across(np.eye(3)[across]).T
    groups = sorted(raw.edges, key=lambda name: name in ("base", "contact"))  # these win over `front`
    named = {tuple(sorted(edge)): name for name in groups for edge in raw.edges[name].tolist()}
    sides = np.sort(boundary_edges(raw.cells), axis=1)
    loops, gaps = close([line(points[a], points[b], named.get((a, b), "")) for a, b in sides.tolist()])
    contact = raw.nodes.get("contact")
    ready = None
    if {"base", "contact"} <= set(raw.edges):
        ready = MeshInFile(points[used], triangles)
    return Drawing(
        loops=tuple(straightened(loop, FLAT) for loop in loops),
        unit=unit,
        note=f"MSH, {'triangles as they are' if ready else 'boundary of a plane mesh'}{gaps}",
        markers=points[raw.nodes.get("markers", np.empty(0, dtype=np.int64))],
        contact=None if contact is None else points[contact[0]],
        mesh=ready,
    )


def _extruded_mesh(raw: RawMesh, close: Close, unit: float) -> Drawing:
    faces = np.concatenate([raw.cells[:, corners] for corners in combinations(range(4), 3)])
    _, first, times = np.unique(np.sort(faces, axis=1), axis=0, return_index=True, return_counts=True)
    faces = faces[np.sort(first[times == 1])]
    if not len(faces):
        raise UserError("its elements have no outer face; is each there twice?")
    across = np.cross(*(raw.points[faces[:, corner]] - raw.points[faces[:, 0]] for corner in (1, 2)))
    length = np.linalg.norm(across, axis=1)
    normals, areas = across / np.where(length > 0, length, 1)[:, None], length / 2
    corners = raw.points[raw.cells]
    volume = float(np.abs(np.linalg.det(corners[:, 1:] - corners[:, :1])).sum()) / 6
    for normal in np.eye(3)[::-1]:
        heights = raw.points @ normal
        low, high = (float(end) for end in (heights[raw.cells].min(), heights[raw.cells].max()))
        flat = np.abs(normals @ normal) > 0.999
        caps = [flat & (np.abs(heights[faces] - end).max(axis=1) < FLAT) for end in (low, high)]
        area, other = (float(areas[cap].sum()) for cap in caps)
        fits = abs(other - area) <= SAME * area and abs(area * (high - low) - volume) <= SAME * volume
        if not (area and fits):
            continue
        points = raw.points @ axes_across(normal).T
        sides = np.sort(boundary_edges(faces[caps[0]]), axis=1)
        loops, gaps = close([line(points[a], points[b], "") for a, b in sides.tolist()])
        return Drawing(
            loops=tuple(straightened(loop, FLAT) for loop in loops),
            unit=unit,
            note=f"MSH, extruded by {high - low:.6g} mm, at {plane_text(normal, low)}{gaps}",
            depth=high - low,
        )
    raise UserError("its body is not extruded along an axis; give a mesh of the plane section")


def _raw(path: Path, unit: float) -> RawMesh:
    with _opened(path) as mesh:
        for kind in mesh.getElementTypes():
            if kind not in CORNERS:
                name = mesh.getElementProperties(kind)[0]
                raise UserError(
                    f"it holds elements of type {name}; there may be triangles and tetrahedra of first order"
                )
        tags, coordinates, _ = mesh.getNodes()
        number = np.full(int(tags.max(initial=0)) + 1, -1)
        number[tags.astype(np.int64)] = np.arange(len(tags))
        tetrahedra, triangles = (mesh.getElementsByType(kind)[1] for kind in (TETRAHEDRON, TRIANGLE))
        cells = tetrahedra.reshape(-1, 4) if len(tetrahedra) else triangles.reshape(-1, 3)
        if not len(cells):
            raise UserError("it holds neither triangles nor tetrahedra")
        return RawMesh(
            points=unit * coordinates.reshape(-1, 3),
            cells=_numbers(number, cells),
            edges={name: _numbers(number, nodes) for name, nodes in _groups(1, 1)},
            nodes={name: _numbers(number, nodes.ravel()) for name, nodes in _groups(0, 15)},
        )


def _numbers(number: IntArray, tags: IntArray) -> IntArray:
    """Numbers of nodes by their tags; `number` has -1 for a tag that no node has."""
    tags = tags.astype(np.int64)
    if tags.max(initial=0) >= len(number) or number[tags].min(initial=0) < 0:
        raise UserError("an element has a node that the file lacks")
    return np.asarray(number[tags])


def _groups(dimension: int, kind: int) -> Iterator[tuple[str, IntArray]]:
    """Physical groups: name, and tags of the nodes of the elements of a type, (k, corners)."""
    found: dict[str, list[IntArray]] = {}
    for _, group in gmsh.model.getPhysicalGroups(dimension):
        label = label_of(gmsh.model.getPhysicalName(dimension, group))
        for entity in gmsh.model.getEntitiesForPhysicalGroup(dimension, group):
            _, nodes = gmsh.model.mesh.getElementsByType(kind, int(entity))
            found.setdefault(LABELS.get(label, label), []).append(nodes.reshape(-1, CORNERS[kind]))
    for name, arrays in found.items():
        yield name, np.concatenate(arrays)


@contextmanager
def _opened(path: Path) -> Iterator[Any]:
    """Gmsh's mesh of a file. Gmsh gets a copy, because it runs a script FILE.opt that lies beside a mesh."""
    with session(), TemporaryDirectory() as folder:
        copy = Path(folder) / "mesh.msh"
        content = path.read_bytes().removeprefix(b"\xef\xbb\xbf").lstrip()
        # Gmsh runs any other file as a script, which may start programs.
        if not content.startswith((b"$MeshFormat", b"$Comments", b"$NOD\n", b"$NOD\r")):
            raise UserError("it is no Gmsh mesh: its first line is not $MeshFormat or $NOD; save it as .msh")
        end = b"$ENDELM" if content.startswith(b"$NOD") else b"$EndElements"
        if end not in content:
            raise UserError(
                "it cannot be read as a Gmsh mesh: it ends before "
                f"{end.decode()}, so that it was cut off; save it again"
            )
        copy.write_bytes(content)
        try:
            gmsh.merge(str(copy))
        except Exception as error:  # Gmsh raises no narrower class
            reason = str(error).replace(str(copy), path.name)
            raise UserError(f"it cannot be read as a Gmsh mesh: {reason}") from None
        try:
            yield gmsh.model.mesh
        except UnicodeDecodeError:  # from Gmsh's Python layer
            raise UserError("the name of a physical group is not in UTF-8; rename it") from None
