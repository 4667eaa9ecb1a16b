"""Reads a Gmsh mesh: a plane triangle mesh as it is, or the section of an extruded body's mesh."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from itertools import pairwise
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
from pinnray.runtime.arrays import FloatArray, IntArray
from pinnray.runtime.errors import UserError

FACES = {
    4: [[0, 1, 2], [0, 1, 3], [0, 2, 3], [1, 2, 3]],
    5: [[0, 1, 2, 3], [0, 1, 3], [0, 1, 4], [1, 2, 4]],
    6: [[0, 1, 2], [3, 4, 5], [0, 1, 4, 3], [1, 2, 5, 4], [0, 2, 5, 3]],
    8: [[0, 1, 2, 3], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]],
}
"""Faces of tetrahedra, pyramids, prisms and hexahedra, by the number of corners."""

TRIANGLE = 2
"""Gmsh's number of the triangle of first order."""

FLAT = 1e-4
"""Largest distance of a corner from the straight line that replaces it, and from a plane, mm."""

SAME = 0.01
"""Largest relative difference of an extruded body's two ends, and of its volume: curved sides have facets."""


Close = Callable[[Sequence[Piece]], Closed]
"""Makes closed curves of pieces."""


class RawMesh(NamedTuple):
    """Nodes and elements of a file."""

    points: FloatArray  # (n, 3), mm
    cells: Mapping[int, IntArray]  # of the highest dimension by the number of corners, (k, corners) each
    dimension: int  # 2 or 3
    edges: Mapping[str, IntArray]  # of the physical curves by name, (k, 2) each
    nodes: Mapping[str, IntArray]  # of the physical points by name
    parts: Mapping[str, IntArray]  # of the physical surfaces by name, rows of the triangles of first order

    @property
    def used(self) -> IntArray:
        """Numbers of the nodes that are corners of an element."""
        return np.asarray(np.unique(np.concatenate([cells.ravel() for cells in self.cells.values()])))


def read_msh(path: Path, units: str | None = None, tolerance: float | None = None) -> Drawing:
    """The section of a Gmsh mesh, of any version of the format.

    A plane mesh gives its boundary, with the physical groups as labels; a triangle mesh with the groups
    `base` (or `clamp`) and `contact` is kept as it is. The mesh of an extruded body gives the boundary of its
    end face; sides in one line are joined. Elements are of first order.

    Args:
        path: The file.
        units: Unit of its coordinates; None means mm.
        tolerance: Largest gap between two ends that is closed, mm; None means 0.001 mm.
    """
    scale = Scale(UNITS[units], units, "given") if units else Scale()
    raw = _raw(path, scale.length)
    drawing = _plane_mesh if raw.dimension == 2 else _extruded_mesh
    return drawing(raw, lambda pieces: closed_loops(pieces, scale=scale, tolerance=tolerance), scale.length)


def _plane_mesh(raw: RawMesh, close: Close, unit: float) -> Drawing:
    extent = np.ptp(raw.points[raw.used], axis=0)
    across = int(extent.argmin())
    if extent[across] > FLAT:
        raise UserError("its surface is not plane; give a mesh of a plane section or of a solid")
    axes = axes_across(np.eye(3)[across])
    points = raw.points @ axes.T
    groups = sorted(raw.edges, key=lambda name: name in ("base", "contact"))  # these win over `front`
    named = {tuple(sorted(edge)): name for name in groups for edge in raw.edges[name].tolist()}
    sides = [edge for count, cells in raw.cells.items() for edge in _sides(cells, count)]
    pieces = [line(*points[list(side)], named.get(side, "")) for side in _once(sides)]
    loops, gaps = close(pieces)
    markers = raw.nodes.get("markers", np.empty(0, dtype=np.int64))
    contact = raw.nodes.get("contact", np.empty(0, dtype=np.int64))
    ready = None
    if set(raw.cells) == {3} and {"base", "contact"} <= set(raw.edges):
        used, triangles = np.unique(raw.cells[3], return_inverse=True)
        number = np.full(len(points), -1)
        number[used] = np.arange(len(used))
        ready = MeshInFile(
            points=points[used],
            triangles=triangles.reshape(-1, 3),
            edges={name: number[edges] for name, edges in raw.edges.items()},
            parts=raw.parts,
        )
    return Drawing(
        loops=tuple(straightened(loop, FLAT) for loop in loops),
        unit=unit,
        note=f"MSH, {'triangles as they are' if ready else 'boundary of a plane mesh'}{gaps}",
        markers=points[markers],
        contact=points[contact[0]] if len(contact) else None,
        mesh=ready,
    )


def _extruded_mesh(raw: RawMesh, close: Close, unit: float) -> Drawing:
    faces = _once(
        [part for count, cells in raw.cells.items() for face in FACES[count] for part in _rows(cells, face)]
    )
    if not faces:
        raise UserError("its elements have no outer face; is each there twice?")
    normals, areas = _normals(raw.points, faces)
    volume = _volume(raw)
    for normal in _main_directions(normals, areas):
        slope, heights = np.abs(normals @ normal), raw.points @ normal
        low, high = float(heights[raw.used].min()), float(heights[raw.used].max())
        caps = [
            [
                number
                for number, face in enumerate(faces)
                if slope[number] > 0.999 and np.abs(heights[list(face)] - end).max() < FLAT
            ]
            for end in (low, high)
        ]
        area = float(areas[caps[0]].sum())
        same = abs(areas[caps[1]].sum() - area) <= SAME * area
        if not (area and same and abs(area * (high - low) - volume) <= SAME * volume):
            continue
        points = raw.points @ axes_across(normal).T
        sides = [side for which in caps[0] for side in _sides(np.array([faces[which]]), len(faces[which]))]
        loops, gaps = close([line(*points[list(side)], "") for side in _once(sides)])
        return Drawing(
            loops=tuple(straightened(loop, FLAT) for loop in loops),
            unit=unit,
            note=f"MSH, extruded by {high - low:.6g} mm, at {plane_text(normal, low)}{gaps}",
            depth=high - low,
        )
    raise UserError("its body is not extruded; give a mesh of the plane section")


def _main_directions(normals: FloatArray, areas: FloatArray) -> list[FloatArray]:
    """Directions that many faces share, by falling area; of equal ones, z before y before x."""
    rounded = normals * np.sign(np.take_along_axis(normals, np.abs(normals).argmax(axis=1)[:, None], axis=1))
    _, first, group = np.unique(np.round(rounded, 4), axis=0, return_index=True, return_inverse=True)
    shares = np.bincount(group.ravel(), weights=areas)
    order = np.argsort(-shares)[:12]
    return [rounded[first[which]] for which in order]


def _normals(points: FloatArray, faces: Sequence[tuple[int, ...]]) -> tuple[FloatArray, FloatArray]:
    """Unit normals (f, 3) and areas (f,) of triangles and quadrilaterals."""
    corners = points[np.array([[*face, face[-1]][:4] for face in faces])]
    cross = np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1])  # of the diagonals
    length = np.linalg.norm(cross, axis=1)
    return cross / np.where(length > 0, length, 1)[:, None], length / 2


def _volume(raw: RawMesh) -> float:
    """Volume of the solid elements, mm^3, each taken as convex."""
    volume = 0.0
    for count, cells in raw.cells.items():
        middle = raw.points[cells].mean(axis=1)
        for face in FACES[count]:
            for second, third in pairwise(face[1:]):
                corners = [raw.points[cells[:, which]] - middle for which in (face[0], second, third)]
                volume += float(np.abs(np.linalg.det(np.stack(corners, axis=1))).sum()) / 6
    return volume


def _sides(cells: IntArray, corners: int) -> list[tuple[int, ...]]:
    """Edges of triangles or quadrilaterals (k, corners)."""
    return [side for which in range(corners) for side in _rows(cells, [which, (which + 1) % corners])]


def _rows(cells: IntArray, corners: list[int]) -> list[tuple[int, ...]]:
    return list(map(tuple, cells[:, corners].tolist()))


def _once(parts: Sequence[tuple[int, ...]]) -> list[tuple[int, ...]]:
    """Edges or faces that belong to one element only, edges with their nodes sorted."""
    times: dict[tuple[int, ...], int] = {}
    first: dict[tuple[int, ...], tuple[int, ...]] = {}
    for part in parts:
        key = tuple(sorted(part))
        times[key] = times.get(key, 0) + 1
        first.setdefault(key, part)
    return [key if len(key) == 2 else first[key] for key, count in times.items() if count == 1]


def _raw(path: Path, unit: float) -> RawMesh:
    with _opened(path) as mesh:
        tags, coordinates, _ = mesh.getNodes()
        number = np.full(int(tags.max(initial=0)) + 1, -1)
        number[tags.astype(np.int64)] = np.arange(len(tags))
        points = unit * coordinates.reshape(-1, 3)
        by_dimension: dict[int, dict[int, list[IntArray]]] = {2: {}, 3: {}}
        for dimension in (2, 3):
            for kind in mesh.getElementTypes(dimension):
                name, _, order, _, _, corners = mesh.getElementProperties(kind)
                if order > 1 or corners not in ((3, 4) if dimension == 2 else FACES):
                    raise UserError(
                        f"it holds elements of type {name}; there may be triangles, quadrilaterals, "
                        "tetrahedra, pyramids, prisms and hexahedra of first order"
                    )
                _, nodes = mesh.getElementsByType(kind)
                cells = _numbers(number, nodes.reshape(-1, int(corners)))
                by_dimension[dimension].setdefault(int(corners), []).append(cells)
        dimension = 3 if by_dimension[3] else 2
        if not by_dimension[dimension]:
            raise UserError("it holds no triangles, quadrilaterals or solid elements")
        return RawMesh(
            points=points,
            cells={count: np.concatenate(parts) for count, parts in by_dimension[dimension].items()},
            dimension=dimension,
            edges={name: _numbers(number, nodes.reshape(-1, 2)) for name, nodes in _groups(1)},
            nodes={name: _numbers(number, nodes.ravel()) for name, nodes in _groups(0)},
            parts=_parts(mesh),
        )


def _parts(mesh: Any) -> dict[str, IntArray]:
    """Rows, among the triangles of first order, of those of every named physical surface."""
    tags, _ = mesh.getElementsByType(TRIANGLE)
    order = np.argsort(tags)
    parts: dict[str, list[IntArray]] = {}
    for _, group in gmsh.model.getPhysicalGroups(2):
        name = label_of(gmsh.model.getPhysicalName(2, group))
        for entity in gmsh.model.getEntitiesForPhysicalGroup(2, group):
            own, _ = mesh.getElementsByType(TRIANGLE, int(entity))
            parts.setdefault(name, []).append(order[np.searchsorted(tags, own, sorter=order)])
    return {name: np.concatenate(rows) for name, rows in parts.items() if name}


def _numbers(number: IntArray, tags: IntArray) -> IntArray:
    """Numbers of nodes by their tags; `number` has -1 for a tag that no node has."""
    tags = tags.astype(np.int64)
    if tags.max(initial=0) >= len(number) or number[tags].min(initial=0) < 0:
        raise UserError("an element has a node that the file lacks")
    return np.asarray(number[tags])


def _groups(dimension: int) -> Iterator[tuple[str, IntArray]]:
    """Known physical groups of curves or points: name and node tags of the elements' corners."""
    found: dict[str, list[IntArray]] = {}
    for _, tag in gmsh.model.getPhysicalGroups(dimension):
        label = label_of(gmsh.model.getPhysicalName(dimension, tag))
        for entity in gmsh.model.getEntitiesForPhysicalGroup(dimension, tag):
            for kind, nodes in zip(*gmsh.model.mesh.getElements(dimension, entity)[::2], strict=True):
                whole = int(gmsh.model.mesh.getElementProperties(kind)[3])
                corners = nodes.astype(np.int64).reshape(-1, whole)[:, : dimension + 1]
                found.setdefault(LABELS.get(label, label), []).append(corners)
    return ((name, np.concatenate(parts)) for name, parts in found.items())


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
