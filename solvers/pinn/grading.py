"""Where a network's units and quadrature points go: dense in thin walls and at re-entrant corners."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from geometry.across import boundary_edges, boundary_loops
from geometry.arrays import FloatArray, IntArray
from geometry.mesh import TriangleMesh
from geometry.quadrature import triangle_rule
from solvers.pinn.conditions import contact_end_points
from solvers.problem import Problem, contact_ends, contact_nodes

CORNER_ANGLE = np.radians(10.0)
"""Turn of the boundary from which on it counts as a corner."""
FACING = -0.9
"""Cosine of the angle between the normals of two edges below which they face each other."""


class Singularities(NamedTuple):
    """Points where the strain is singular or nearly so.

    Attributes:
        points: Shape (s, 2), mm.
        spacing: Wanted distance between neighbours there, mm.
    """

    points: FloatArray
    spacing: float


@dataclass(frozen=True, eq=False)
class Spacing:
    """Wanted distance between neighbours: that of the nearest boundary, less near singularities.

    At distance d from a singularity with spacing s it is at most s + growth * d.

    Attributes:
        boundary: Points of the boundary, shape (b, 2), mm.
        walls: The spacing there, shape (b,), mm.
        singularities: Of one kind each.
        growth: Growth of the spacing per distance from a singularity.
    """

    boundary: FloatArray
    walls: FloatArray
    singularities: tuple[Singularities, ...]
    growth: float

    @classmethod
    def of(cls, problem: Problem, *, wall: float, corner: float, growth: float) -> "Spacing":
        """The spacing for a body, in units of its own thicknesses.

        Args:
            problem: The body and its load; the ends of a rigid patch are as singular as sharp corners.
            wall: Spacing in the width of a wall, of a narrower cavity beside it, or of the contact, or in the
                radius of a fillet.
            corner: Spacing at a sharp corner in mean thicknesses.
            growth: Growth of the spacing per distance from singularities.
        """
        mesh = problem.mesh
        mean = mean_thickness(mesh)
        boundary, widths = boundary_widths(mesh)
        sharp, round_, radius = re_entrant_points(mesh)
        if problem.load.kind == "patch":
            sharp = np.concatenate([sharp, contact_end_points(problem)])
        left, right = contact_ends(problem)
        kinds = [
            Singularities(sharp, corner * mean),
            Singularities(mesh.points[contact_nodes(problem)], wall * (right - left)),
        ]
        if len(round_):
            kinds.append(Singularities(round_, max(wall * radius, corner * mean)))
        return cls(boundary, wall * np.minimum(widths, mean), tuple(kinds), growth)

    def at(self, points: FloatArray) -> FloatArray:
        """The spacing at points (n, 2), mm: (n,), mm."""
        _, nearest = cKDTree(self.boundary).query(points)
        found = self.walls[nearest]
        for kind in self.singularities:
            distance, _ = cKDTree(kind.points).query(points)
            found = np.minimum(found, kind.spacing + self.growth * distance)
        return np.asarray(found)

    def distance(self, points: FloatArray) -> FloatArray:
        """Distance of points (n, 2), mm, from the nearest singularity: (n,), mm."""
        distance, _ = cKDTree(np.concatenate([kind.points for kind in self.singularities])).query(points)
        return np.asarray(distance)


def mean_thickness(mesh: TriangleMesh) -> float:
    """Twice the area over the perimeter, mm: the thickness of a body that is all walls."""
    ends = mesh.points[boundary_edges(mesh.triangles)]
    perimeter = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1).sum()
    return float(2 * mesh.areas.sum() / perimeter)


def boundary_widths(mesh: TriangleMesh) -> tuple[FloatArray, FloatArray]:
    """Boundary points (b, 2), mm, and the width there, (b,), mm.

    That is the distance from the nearest other closed boundary, which is across the wall, or the width of the
    cavity beside it if that is less; infinite where there is neither.
    """
    loops = boundary_loops(mesh)
    edges = mesh.points[boundary_edges(mesh.triangles)]
    middles = edges.mean(axis=1)
    _, nearest = cKDTree(mesh.points[np.concatenate(loops)]).query(edges[:, 0])
    loop_of = np.repeat(np.arange(len(loops)), [len(loop) for loop in loops])[nearest]
    widths = np.full(len(middles), np.inf)
    for number in range(len(loops)):
        own = loop_of == number
        if not own.all():
            widths[own], _ = cKDTree(edges[~own, 0]).query(middles[own])
        widths[own] = np.minimum(widths[own], _open_distance(edges[own]))
    return middles, widths


def _open_distance(edges: FloatArray) -> FloatArray:
    """Distance from each edge (k, 2, 2) of a closed boundary to one that faces it outside, (k,), mm."""
    start, along = edges[:, 0], edges[:, 1] - edges[:, 0]
    middles, normals = edges.mean(axis=1), np.column_stack([along[:, 1], -along[:, 0]])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    offset = start[None] - middles[:, None]
    # middle + t normal = start + s along, for every pair of a middle and an edge
    determinant = _cross(normals[:, None], along[None])
    with np.errstate(divide="ignore", invalid="ignore"):
        t = _cross(offset, along[None]) / determinant
        s = _cross(offset, normals[:, None]) / determinant
    facing = normals @ normals.T < FACING
    hit = facing & (s >= 0) & (s <= 1) & (t > 1e-9) & np.isfinite(t)
    return np.asarray(np.where(hit, t, np.inf).min(axis=1))


def _cross(a: FloatArray, b: FloatArray) -> FloatArray:
    return np.asarray(a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0])


def singular_points(mesh: TriangleMesh) -> FloatArray:
    """Re-entrant corners, points of re-entrant arcs and the ends of the clamped base, shape (s, 2), mm."""
    sharp, round_, _ = re_entrant_points(mesh)
    return np.concatenate([sharp, round_])


def re_entrant_points(mesh: TriangleMesh) -> tuple[FloatArray, FloatArray, float]:
    """Re-entrant corners and the base's ends (s, 2), points of re-entrant arcs (a, 2), their radius, all mm.

    The radius is the median over the arcs, NaN where there are none.
    """
    edges = boundary_edges(mesh.triangles)
    follows = dict(edges.tolist())
    comes_before = {after: node for node, after in follows.items()}
    nodes = np.array(list(follows))
    after, before = (np.array([step[node] for node in nodes]) for step in (follows, comes_before))
    into, out = mesh.points[nodes] - mesh.points[before], mesh.points[after] - mesh.points[nodes]
    turn = np.arctan2(_cross(into, out), (into * out).sum(axis=1))
    # The body is on the left of its boundary: a right turn opens it beyond a straight angle.
    bent = turn < -CORNER_ANGLE
    is_bent = dict(zip(nodes.tolist(), bent.tolist(), strict=True))
    arc = bent & np.array([is_bent[a] or is_bent[b] for a, b in zip(after, before, strict=True)])
    lengths = 0.5 * (np.linalg.norm(into, axis=1) + np.linalg.norm(out, axis=1))
    radius = float(np.median(lengths[arc] / -turn[arc])) if arc.any() else float("nan")
    base, times = np.unique(mesh.boundary("base"), return_counts=True)
    sharp = np.concatenate([mesh.points[nodes[bent & ~arc]], mesh.points[base[times == 1]]])
    return sharp, mesh.points[nodes[arc]], radius


def graded_triangles(mesh: TriangleMesh, spacing: Spacing, share: float) -> FloatArray:
    """The mesh's triangles, cut in four until no edge exceeds `share` of the spacing, shape (t, 3, 2)."""
    todo = mesh.points[mesh.triangles]
    done = []
    while len(todo):
        cut = _longest_edge(todo) > share * spacing.at(todo.mean(axis=1))
        done.append(todo[~cut])
        corners = todo[cut]
        middles = 0.5 * (corners + np.roll(corners, -1, axis=1))
        outer = [np.stack([corners[:, k], middles[:, k], middles[:, k - 1]], axis=1) for k in range(3)]
        todo = np.concatenate([*outer, middles])
    return np.concatenate(done)


def graded_quadrature(triangles: FloatArray, spacing: Spacing, share: float) -> tuple[FloatArray, FloatArray]:
    """Points (q, 2), mm, and weights (q,), mm^2, in triangles (t, 3, 2).

    Three points of degree 2, but one in a triangle whose edges are below a quarter of `share` of the spacing:
    of such there are sixteen where one would do.
    """
    small = _longest_edge(triangles) <= 0.25 * share * spacing.at(triangles.mean(axis=1))
    parts = [_element_rule(triangles[small], 1), _element_rule(triangles[~small], 2)]
    points, weights = (np.concatenate(part) for part in zip(*parts, strict=True))
    return points, weights


def _element_rule(triangles: FloatArray, degree: int) -> tuple[FloatArray, FloatArray]:
    barycentric, weights = triangle_rule(degree)
    first, second = triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]
    areas = 0.5 * (first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0])
    points = np.einsum("qc,tcx->tqx", barycentric, triangles).reshape(-1, 2)
    return points, np.outer(areas, weights).ravel()


def _longest_edge(triangles: FloatArray) -> FloatArray:
    return np.asarray(np.linalg.norm(triangles - np.roll(triangles, 1, axis=1), axis=2).max(axis=1))


def spread_points(triangles: FloatArray, mesh: TriangleMesh, spacing: Spacing, share: float) -> FloatArray:
    """Corners of triangles (t, 3, 2), thinned to at least `share` of the spacing apart, shape (c, 2), mm.

    The mesh's boundary nodes are taken before all others, and near singular points before those far away.
    """
    points = np.unique(np.round(triangles.reshape(-1, 2), 9), axis=0)
    distance = spacing.distance(points)
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
