"""The motion of a drawn mesh when its walls are thicker or thinner than drawn.

A thicker wall takes its place from the cavities: the outline stays, an inner face of a wall moves by the
whole change into its cavity, each of the two faces of a rib by half of it. Corners and fillets move with the
faces beside them. Between the boundaries the motion is harmonic.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import shapely
from scipy.sparse import coo_matrix, diags

from pinnray.geometry.mesh.boundary import CORNER_ANGLE, boundary_loops, mean_thickness, walls_and_ribs
from pinnray.geometry.mesh.extension import Extension, barycentric_gradients
from pinnray.geometry.mesh.point_location import LocatedPoints
from pinnray.geometry.mesh.triangle_mesh import TriangleMesh
from pinnray.geometry.section.loop import cross, turns
from pinnray.runtime.arrays import BoolArray, FloatArray, IntArray


@dataclass(frozen=True, eq=False)
class WallMotion:
    """Motions of a mesh by the thickness of each of its k walls.

    The walls are called `front_thickness`, `back_thickness`, `rib_thickness` and `base_thickness`; a body
    without cavities or without a boundary called `back` has none.
    """

    mesh: TriangleMesh  # as drawn
    names: tuple[str, ...]  # of the walls that the body has
    thickness: FloatArray  # as drawn, (k,), mm: where the wall is thinnest, for ribs their mean
    nodal: FloatArray  # motion of the nodes per mm of change, (k, N, 2), mm

    @classmethod
    def of(cls, mesh: TriangleMesh) -> "WallMotion":
        """The motions of a mesh."""
        parts = {name: mask for name, mask in walls_and_ribs(mesh).items() if mask.any()}
        loops = boundary_loops(mesh)[1:]
        mean, names, thickness, boundary = mean_thickness(mesh), [], [], []
        for name, mask in parts.items():
            moved = np.zeros((len(mesh.points), 2))
            for loop in loops:
                moved[loop] = _loop_motion(mesh, loop, mask, 0.5 if name == "rib" else 1.0, mean)
            if not moved.any():
                continue
            names.append(f"{name}_thickness")
            thickness.append(_thickness(mesh, name, mask, loops))
            boundary.append(moved)
        nodal = np.array(boundary).reshape(-1, len(mesh.points), 2)
        return cls(mesh, tuple(names), np.array(thickness), harmonic(mesh, nodal))

    def changes(self, thickness: Mapping[str, float]) -> FloatArray:
        """Changes, shape (k,), mm, from thicknesses by name, mm; those that are not given are as drawn."""
        drawn = zip(self.names, self.thickness, strict=True)
        return np.array([thickness.get(name, value) - value for name, value in drawn], dtype=np.float64)

    def shifts(self, location: LocatedPoints, changes: FloatArray) -> FloatArray:
        """Motion of points of the drawn body, shape (n, 2), mm, by changes of shape (k,), mm."""
        moved = np.einsum("k,knx->nx", changes, self.nodal)[self.mesh.triangles[location.cells]]
        return np.asarray(np.einsum("nc,ncx->nx", location.barycentric, moved))

    @cached_property
    def gradients(self) -> FloatArray:
        """Gradients dV_i/dX_j of the motions per mm of change in every triangle, shape (k, t, 2, 2), 1/mm."""
        corners = self.nodal[:, self.mesh.triangles]
        return np.asarray(np.einsum("ktci,tcj->ktij", corners, barycentric_gradients(self.mesh)))

    def moved(self, changes: FloatArray) -> FloatArray:
        """Nodes of the moved mesh, shape (N, 2), mm."""
        return np.asarray(self.mesh.points + np.einsum("k,knx->nx", changes, self.nodal))


def _loop_motion(
    mesh: TriangleMesh, loop: IntArray, mask: BoolArray, share: float, mean: float
) -> FloatArray:
    """Motion of a cavity's nodes (n, 2) when the wall of the masked triangles thickens.

    `share` is the part of the change by which the cavity's face moves, `mean` the body's mean thickness, mm.
    """
    along = mesh.points[np.roll(loop, -1)] - mesh.points[loop]
    lengths = np.linalg.norm(along, axis=1)
    normals = np.column_stack([along[:, 1], -along[:, 0]]) / lengths[:, None]  # out of the body
    owned = _beside(mesh, loop, mask)
    breaks = _breaks(along, lengths, mean)
    if not breaks.any():
        pushed = normals * (share * owned)[:, None]
        return np.asarray(0.5 * (pushed + np.roll(pushed, 1, axis=0)))
    first = int(np.flatnonzero(breaks & ~np.roll(breaks, 1))[0]) if not breaks.all() else 0
    order = np.roll(np.arange(len(loop)), -first)
    faces = _faces(order, breaks)
    speeds = [share * (lengths[face] @ owned[face] > 0.5 * lengths[face].sum()) for face in faces]
    motion = np.zeros((len(loop), 2))
    corners = [
        _corner(normals[faces[number - 1][-1]], normals[face[0]], speeds[number - 1], speeds[number])
        for number, face in enumerate(faces)
    ]
    for number, face in enumerate(faces):
        left, right = corners[number], corners[(number + 1) % len(faces)]
        place = np.append(0.0, lengths[face].cumsum()) / lengths[face].sum()
        nodes = np.append(face, (face[-1] + 1) % len(loop))
        between = (1 - place)[:, None] * left + place[:, None] * right
        outward = np.concatenate([normals[face], normals[face[-1:]]])
        outward += np.concatenate([normals[face[:1]], normals[face]])
        outward /= np.linalg.norm(outward, axis=1)[:, None]
        normal_part = (between * outward).sum(axis=1)
        inside = between + (speeds[number] - normal_part)[:, None] * outward
        motion[nodes[1:-1]] = inside[1:-1]
        motion[_bend(face[-1], faces[(number + 1) % len(faces)][0], len(loop))] = right
    return motion


def _beside(mesh: TriangleMesh, loop: IntArray, mask: BoolArray) -> FloatArray:
    """One for each edge of a loop whose triangle is in a mask, else zero, shape (n,)."""
    count = len(mesh.points)
    edges = mesh.triangles[mask][:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
    wanted = loop * count + np.roll(loop, -1)
    return np.isin(wanted, edges[:, 0] * count + edges[:, 1]).astype(np.float64)


def _breaks(along: FloatArray, lengths: FloatArray, thickness: float) -> BoolArray:
    """Mask of the nodes that are corners, or points of an arc tighter than a thickness, shape (n,)."""
    turn = np.abs(turns(np.roll(along, 1, axis=0), along))
    mean_length = 0.5 * (lengths + np.roll(lengths, 1))
    tight = (turn > np.radians(1.0)) & (mean_length < turn * thickness)
    return np.asarray((turn > CORNER_ANGLE) | tight)


def _faces(order: IntArray, breaks: BoolArray) -> list[IntArray]:
    """The edges of every face, in order; an edge between two breaks belongs to an arc, and to no face.

    Where no edge would be left, as between corners of a coarse mesh, every such edge is a face.
    """
    arcs = breaks & np.roll(breaks, -1)
    kept = order if arcs.all() else order[~arcs[order]]
    return np.split(kept, np.flatnonzero(breaks[kept])[1:])  # every face begins at a break


def _bend(last: int, first: int, count: int) -> IntArray:
    """Nodes from the end of a face to the start of the next one."""
    return np.arange(last + 1, last + 1 + (first - last - 1) % count + 1) % count


def _corner(one: FloatArray, other: FloatArray, speed: float, next_speed: float) -> FloatArray:
    """Motion of the corner of two faces with outer normals, each moved along its own: shape (2,)."""
    if abs(cross(one, other)) < np.sin(np.radians(15.0)):  # almost parallel
        return np.asarray(0.5 * (speed * one + next_speed * other))
    return np.linalg.solve(np.stack([one, other]), np.array([speed, next_speed]))


def _thickness(mesh: TriangleMesh, name: str, mask: BoolArray, loops: list[IntArray]) -> float:
    """The drawn thickness of a wall, mm."""
    if name == "rib":
        length = 0.0
        for loop in loops:
            steps = np.linalg.norm(mesh.points[np.roll(loop, -1)] - mesh.points[loop], axis=1)
            length += float(steps @ _beside(mesh, loop, mask))
        return float(2 * mesh.areas[mask].sum() / length)
    cavities = mesh.points[np.concatenate(loops)]
    wall = shapely.MultiLineString(list(mesh.points[mesh.boundary(name)]))
    return float(wall.distance(shapely.MultiPoint(cavities)))


def harmonic(mesh: TriangleMesh, boundary: FloatArray) -> FloatArray:
    """Harmonic extension (k, N, 2), by linear elements, of values on the boundary."""
    count, gradients = len(mesh.points), barycentric_gradients(mesh)
    columns = mesh.triangles.ravel()
    rows = np.repeat(np.arange(len(mesh.triangles)), 3)
    along = [
        coo_matrix((gradients[..., axis].ravel(), (rows, columns)), (len(mesh.triangles), count)).tocsr()
        for axis in range(2)
    ]
    stiffness = sum(matrix.T @ diags(mesh.areas) @ matrix for matrix in along).tocsr()
    values = boundary.transpose(1, 0, 2).reshape(count, -1)
    return Extension(mesh, stiffness).of(values).reshape(count, -1, 2).transpose(1, 0, 2)
