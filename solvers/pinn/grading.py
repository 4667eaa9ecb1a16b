"""Where a network's units and quadrature points go: dense at re-entrant corners, where stress is singular."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from geometry.across import boundary_edges
from geometry.arrays import FloatArray, IntArray
from geometry.mesh import TriangleMesh
from geometry.quadrature import triangle_rule

CORNER_ANGLE = np.radians(10.0)
"""Turn of the boundary from which on it counts as a corner."""


@dataclass(frozen=True, eq=False)
class Spacing:
    """Wanted distance between neighbours: `corner + growth * d` at distance d from a singularity, or `wall`.

    Attributes:
        singular: Singular points, shape (s, 2), mm.
        wall: Largest spacing, mm.
        corner: Spacing at a singular point, mm.
        growth: Growth of the spacing per distance.
    """

    singular: FloatArray
    wall: float
    corner: float
    growth: float

    def at(self, points: FloatArray) -> FloatArray:
        """The spacing at points (n, 2), mm: (n,), mm."""
        distance, _ = cKDTree(self.singular).query(points)
        return np.asarray(np.minimum(self.wall, self.corner + self.growth * distance))


def mean_thickness(mesh: TriangleMesh) -> float:
    """Twice the area over the perimeter, mm: the thickness of a body that is all walls."""
    ends = mesh.points[boundary_edges(mesh.triangles)]
    perimeter = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1).sum()
    return float(2 * mesh.areas.sum() / perimeter)


def singular_points(mesh: TriangleMesh) -> FloatArray:
    """Re-entrant corners and the ends of the clamped base, shape (s, 2), mm."""
    edges = boundary_edges(mesh.triangles)
    follows = dict(edges.tolist())
    comes_before = {after: node for node, after in follows.items()}
    nodes = np.array(list(follows))
    into = mesh.points[nodes] - mesh.points[[comes_before[node] for node in nodes]]
    out = mesh.points[list(follows.values())] - mesh.points[nodes]
    turn = np.arctan2(into[:, 0] * out[:, 1] - into[:, 1] * out[:, 0], (into * out).sum(axis=1))
    # The body is on the left of its boundary: a right turn opens it beyond a straight angle.
    re_entrant = mesh.points[nodes[turn < -CORNER_ANGLE]]
    base, times = np.unique(mesh.boundary("base"), return_counts=True)
    return np.concatenate([re_entrant, mesh.points[base[times == 1]]])


def graded_triangles(mesh: TriangleMesh, spacing: Spacing, share: float) -> FloatArray:
    """The mesh's triangles, cut in four until no edge exceeds `share` of the spacing, shape (t, 3, 2)."""
    todo = mesh.points[mesh.triangles]
    done = []
    while len(todo):
        longest = np.linalg.norm(todo - np.roll(todo, 1, axis=1), axis=2).max(axis=1)
        cut = longest > share * spacing.at(todo.mean(axis=1))
        done.append(todo[~cut])
        corners = todo[cut]
        middles = 0.5 * (corners + np.roll(corners, -1, axis=1))
        outer = [np.stack([corners[:, k], middles[:, k], middles[:, k - 1]], axis=1) for k in range(3)]
        todo = np.concatenate([*outer, middles])
    return np.concatenate(done)


def graded_quadrature(triangles: FloatArray, degree: int) -> tuple[FloatArray, FloatArray]:
    """The element rule of `degree` in triangles (t, 3, 2): points (q, 2), mm, and weights (q,), mm^2."""
    barycentric, weights = triangle_rule(degree)
    first, second = triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]
    areas = 0.5 * (first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0])
    points = np.einsum("qc,tcx->tqx", barycentric, triangles).reshape(-1, 2)
    return points, np.outer(areas, weights).ravel()


def spread_points(triangles: FloatArray, mesh: TriangleMesh, spacing: Spacing, share: float) -> FloatArray:
    """Corners of triangles (t, 3, 2), thinned to at least `share` of the spacing apart, shape (c, 2), mm.

    The mesh's boundary nodes are taken before all others, and near singular points before those far away.
    """
    points = np.unique(np.round(triangles.reshape(-1, 2), 9), axis=0)
    distance, _ = cKDTree(spacing.singular).query(points)
    inside = _distance_from_boundary(points, mesh) > 1e-9
    tree, radius = cKDTree(points), share * spacing.at(points)
    free = np.ones(len(points), dtype=bool)
    kept: list[int] = []
    for index in np.lexsort((distance, inside)):
        if free[index]:
            kept.append(int(index))
            free[tree.query_ball_point(points[index], radius[index])] = False
    return np.asarray(points[kept])


def _distance_from_boundary(points: FloatArray, mesh: TriangleMesh) -> FloatArray:
    """Distance of points from the nearest boundary node, which is zero only at the nodes, shape (n,), mm."""
    nodes: IntArray = np.unique(boundary_edges(mesh.triangles))
    distance, _ = cKDTree(mesh.points[nodes]).query(points)
    return np.asarray(distance)
