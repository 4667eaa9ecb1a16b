"""The triangle mesh that every solver shares."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from pinnray.geometry.mesh.point_location import LocatedPoints, Locator
from pinnray.runtime.arrays import FloatArray, IntArray, frozen_array
from pinnray.runtime.atomic import write_arrays
from pinnray.runtime.content_hash import content_hash
from pinnray.runtime.errors import UserError
from pinnray.runtime.notebook import fact_table

if TYPE_CHECKING:
    from pinnray.runtime.figure import Figure

BOUNDARY_PREFIX = "boundary_"


@dataclass(frozen=True, eq=False)
class TriangleMesh:
    """A conforming triangulation of the finger's section.

    Attributes:
        points: Nodes, shape (n, 2), mm.
        triangles: Node numbers, shape (t, 3), counter-clockwise.
        boundaries: Named boundary edges as node numbers, each of shape (k, 2): `base` (clamped),
            `front` (the whole contact face y = 0), `back`, and `contact` (the part of `front` that the
            indenter touches).
        marker_nodes: The node of every marker, shape (m,), ordered from base to tip.
        contact_node: The node in the middle of `contact`, where a point load acts.
        depth: Depth of the extruded body, out of the plane, mm; plane solvers need none.

    Raises:
        ShapeError: If an array has the wrong shape.
        UserError: If a triangle is degenerate or clockwise, or a node number is out of range.
    """

    points: FloatArray
    triangles: IntArray
    boundaries: Mapping[str, IntArray]
    marker_nodes: IntArray
    contact_node: int
    depth: float = 20.0

    def __repr__(self) -> str:
        nodes, triangles, markers = len(self.points), len(self.triangles), len(self.marker_nodes)
        return f"TriangleMesh({nodes} nodes, {triangles} triangles, {markers} markers)"

    def __post_init__(self) -> None:
        edges = {
            name: frozen_array(nodes, dtype=np.int64, shape=(None, 2), name=f"boundary {name!r}")
            for name, nodes in self.boundaries.items()
        }
        for name, values in {
            "points": frozen_array(self.points, dtype=np.float64, shape=(None, 2), name="points"),
            "triangles": frozen_array(self.triangles, dtype=np.int64, shape=(None, 3), name="triangles"),
            "marker_nodes": frozen_array(
                self.marker_nodes, dtype=np.int64, shape=(None,), name="marker_nodes"
            ),
            "boundaries": MappingProxyType(edges),
            "contact_node": int(self.contact_node),
            "depth": float(self.depth),
        }.items():
            object.__setattr__(self, name, values)
        if not 0 < self.depth < np.inf:
            raise UserError(f"a body is {self.depth:g} mm deep; give a depth above 0 mm")
        numbers = [self.triangles, self.marker_nodes, np.array([self.contact_node]), *edges.values()]
        if any(nodes.size and (nodes.min() < 0 or nodes.max() >= len(self.points)) for nodes in numbers):
            raise UserError(f"the mesh names a node outside 0..{len(self.points) - 1}")
        if (self.areas <= 0).any():
            raise UserError(
                f"{int((self.areas <= 0).sum())} of {len(self.triangles)} triangles are flat or clockwise"
            )

    @cached_property
    def areas(self) -> FloatArray:
        """Area of every triangle, shape (t,), mm^2."""
        return signed_areas(self.points, self.triangles)

    @property
    def markers(self) -> FloatArray:
        """Marker positions, shape (m, 2), mm."""
        return self.points[self.marker_nodes]

    @cached_property
    def edges(self) -> IntArray:
        """Every edge once, as sorted node numbers, shape (e, 2)."""
        first, second = np.sort(self.triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1).T
        numbers = np.unique(first * len(self.points) + second)  # many times faster than unique pairs
        return np.stack(np.divmod(numbers, len(self.points)), axis=1)

    @property
    def edge_lengths(self) -> FloatArray:
        """Length of every edge, shape (e,), mm."""
        return np.asarray(np.linalg.norm(np.diff(self.points[self.edges], axis=1)[:, 0], axis=1))

    @cached_property
    def boundary_edges(self) -> IntArray:
        """The edges of the whole boundary, shape (k, 2), with the body on their left."""
        return boundary_edges(self.triangles)

    def edge_numbers(self, pairs: IntArray) -> IntArray:
        """Rows of `edges` of edges given as node pairs, shape (..., 2), in any order: shape (...)."""
        count, ordered = len(self.points), np.sort(pairs, axis=-1)
        keys = self.edges[:, 0] * count + self.edges[:, 1]
        return np.asarray(np.searchsorted(keys, ordered[..., 0] * count + ordered[..., 1]), dtype=np.int64)

    @cached_property
    def digest(self) -> str:
        """SHA-256 over every array, in hexadecimal; equal for equal meshes."""
        return content_hash(self.arrays())

    def boundary(self, name: str) -> IntArray:
        """Edges of the boundary called `name`, shape (k, 2).

        Raises:
            UserError: If the mesh has no boundary of that name.
        """
        if name not in self.boundaries:
            raise UserError(f"the mesh has no boundary {name!r}; it has {', '.join(self.boundaries)}")
        return self.boundaries[name]

    def boundary_length(self, name: str) -> float:
        """Length of a named boundary, mm."""
        ends = self.points[self.boundary(name)]
        return float(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1).sum())

    def locate(self, points: ArrayLike) -> LocatedPoints:
        """The triangle and the barycentric coordinates of points in the body, shape (n, 2), mm.

        Raises:
            OutsideBodyError: If a point lies outside the body.
        """
        return self._locator.locate(points)

    def locate_on(self, other: "TriangleMesh", points: ArrayLike) -> LocatedPoints:
        """Locates points of this mesh on another mesh of one body.

        Both meshes replace arcs by chords, so that a point may lie beyond the other's boundary: up to a tenth
        of the longest boundary edge of either it counts to the nearest triangle.

        Raises:
            OutsideBodyError: If a point lies farther outside.
        """
        return other._locator.locate(points, 0.1 * max(self._longest_edge, other._longest_edge))

    @cached_property
    def _longest_edge(self) -> float:
        """Of the boundary, mm."""
        ends = self.points[np.concatenate(list(self.boundaries.values()))]
        return float(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1).max())

    @cached_property
    def _locator(self) -> Locator:
        return Locator(self.points, self.triangles)

    def at_centroids(self) -> LocatedPoints:
        """The location of every triangle's centroid, in the order of the triangles."""
        return self.at_barycentric(np.full((1, 3), 1 / 3))

    def at_barycentric(self, barycentric: ArrayLike) -> LocatedPoints:
        """The points of one barycentric rule (q, 3) in every triangle: t * q points, triangle by triangle."""
        rule = frozen_array(barycentric, dtype=np.float64, shape=(None, 3), name="barycentric")
        points = np.einsum("qc,tcx->tqx", rule, self.points[self.triangles]).reshape(-1, 2)
        return LocatedPoints(
            points=points,
            cells=np.repeat(np.arange(len(self.triangles)), len(rule)),
            barycentric=np.tile(rule, (len(self.triangles), 1)),
        )

    def at_nodes(self) -> LocatedPoints:
        """The location of every node, in the order of the nodes."""
        last = np.zeros(len(self.points), dtype=np.int64)
        last[self.triangles.T.ravel()] = np.arange(self.triangles.size)
        corners, cells = np.divmod(last, len(self.triangles))
        return LocatedPoints(points=self.points, cells=cells, barycentric=np.eye(3)[corners])

    def __reduce__(self) -> tuple[object, ...]:
        """Pickle the arrays only, not the derived values."""
        numbers = self.marker_nodes, self.contact_node, self.depth
        return TriangleMesh, (self.points, self.triangles, dict(self.boundaries), *numbers)

    def plot(self, width: float | None = None) -> "Figure":
        """Every triangle, the contact and the markers, as a matplotlib figure.

        Args:
            width: Of the figure, inches; a journal's column if None.
        """
        from pinnray.runtime.figure import COLUMN, CONTACT, INK, MEASURED, body_figure

        lengths = self.edge_lengths
        title = (
            f"Mesh, {len(self.points)} nodes, {len(self.triangles)} triangles, edges of {lengths.min():.3g} "
            f"to {lengths.max():.3g} mm"
        )
        touched = self.points[np.unique(self.boundary("contact"))]
        with body_figure(self.points, title, page=width or COLUMN) as (drawn, axes):
            axes.triplot(*self.points.T, self.triangles, color=INK, lw=0.15)
            axes.plot(*touched.T, color=CONTACT, lw=2.5, label="contact")
            axes.plot(*self.markers.T, "o", ms=3, color=MEASURED, label="markers")
            axes.legend(loc="lower right")
        return drawn

    def _repr_html_(self) -> str:
        """Counts, sizes and the picture, in a notebook."""
        lengths = self.edge_lengths
        facts = {
            "nodes": len(self.points),
            "triangles": len(self.triangles),
            "markers": len(self.marker_nodes),
            "edges": f"{lengths.min():.3g} to {lengths.max():.3g} mm",
            "area": f"{self.areas.sum():.5g} mm²",
        }
        return fact_table("Triangle mesh", facts, self.plot()._repr_png_())

    def save(self, path: Path) -> None:
        """Write the mesh as a NumPy archive, atomically."""
        write_arrays(path, self.arrays())

    @classmethod
    def load(cls, path: Path) -> "TriangleMesh":
        """Read a mesh that `save` wrote."""
        with np.load(path) as archive:
            return cls.from_arrays(archive)

    @classmethod
    def from_arrays(cls, arrays: Mapping[str, ArrayLike]) -> "TriangleMesh":
        """The mesh of the arrays that `arrays` gave."""
        values = dict(arrays)
        names = [name for name in arrays if name.startswith(BOUNDARY_PREFIX)]
        edges = {name.removeprefix(BOUNDARY_PREFIX): values.pop(name) for name in names}
        return cls(**values, boundaries=edges)  # type: ignore[arg-type]

    def arrays(self) -> dict[str, FloatArray | IntArray]:
        """Every array by name, for a file; `from_arrays` makes the mesh of them."""
        return {
            "points": self.points,
            "triangles": self.triangles,
            "marker_nodes": self.marker_nodes,
            "contact_node": np.asarray(self.contact_node),
            "depth": np.asarray(self.depth),
        } | {BOUNDARY_PREFIX + name: nodes for name, nodes in sorted(self.boundaries.items())}


def boundary_edges(triangles: IntArray) -> IntArray:
    """Edges that belong to one triangle only, shape (k, 2), with the body on their left."""
    directed = triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
    low, high = directed.min(axis=1), directed.max(axis=1)
    keys = low * (int(triangles.max()) + 1) + high  # many times faster than unique pairs
    _, first, count = np.unique(keys, return_index=True, return_counts=True)
    return np.asarray(directed[np.sort(first[count == 1])], dtype=np.int64)


def signed_areas(points: FloatArray, triangles: IntArray) -> FloatArray:
    """Areas of triangles, shape (t,), mm^2; negative for a clockwise one."""
    a, b, c = (points[triangles[:, corner]] for corner in range(3))
    return np.asarray(0.5 * ((b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]))
