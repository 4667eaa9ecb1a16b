"""Spacing of a network's neurons and quadrature points: dense in thin walls and at re-entrant corners."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from pinnray.geometry.mesh.boundary import boundary_widths, mean_thickness, re_entrant_points
from pinnray.geometry.mesh.quadrature import triangle_rule
from pinnray.geometry.mesh.triangle_mesh import TriangleMesh
from pinnray.runtime.arrays import FloatArray
from pinnray.solvers.pinn.finite_basis.load_conditions import contact_end_points
from pinnray.solvers.problem import Problem, contact_ends, contact_nodes

NARROW = 0.6
"""Spacing in places of less than half the largest width, relative to that by their width.

Windows beside a narrow slit reach across it, where the displacement jumps: with 1 the error of `pinn-std` on
a bar with a slit of a twenty-fifth of its height was measured to be 0.7 %, with 0.6 it was 0.1 %.
"""


@dataclass(frozen=True, eq=False)
class PointSpacing:
    """Distance between neighbouring points: that at the nearest boundary, less near singularities.

    At distance d from a singularity with spacing s it is at most s + growth * d. Places of less than half the
    largest width count as singularities too, so that the spacing has no large jumps: a wide window over many
    narrow ones would overlap them all.
    """

    boundary: FloatArray  # Points of the boundary, shape (b, 2), mm
    walls: FloatArray  # The spacing there, shape (b,), mm
    # Points, shape (s, 2), mm, where the strain is singular or nearly so, and the spacing there, (s,), mm,
    # one entry a kind
    singularities: tuple[tuple[FloatArray, FloatArray], ...]
    growth: float  # Growth of the spacing per distance from a singularity

    @classmethod
    def of(cls, problem: Problem, *, wall: float, corner: float, growth: float) -> "PointSpacing":
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
        sharp, round_, radii = re_entrant_points(mesh)
        if problem.load.kind == "patch":
            sharp = np.concatenate([sharp, contact_end_points(problem)])
        left, right = contact_ends(problem)
        walls = wall * np.minimum(widths, mean)
        contact = mesh.points[contact_nodes(problem)]
        kinds = (
            (sharp, np.full(len(sharp), corner * mean)),
            (contact, np.full(len(contact), wall * (right - left))),
            (round_, np.maximum(wall * radii, corner * mean)),
            *_by_octaves(boundary, walls),
        )
        present = tuple((points, spacing) for points, spacing in kinds if len(points))
        return cls(boundary, np.maximum(walls, 0.5 * walls.max()), present, growth)

    def at(self, points: FloatArray) -> FloatArray:
        """The spacing at points (n, 2), mm: (n,), mm."""
        _, nearest = cKDTree(self.boundary).query(points)
        found = self.walls[nearest]
        for singular, spacing in self.singularities:
            distance, which = cKDTree(singular).query(points)
            found = np.minimum(found, spacing[which] + self.growth * distance)
        return np.asarray(found)

    def distance(self, points: FloatArray) -> FloatArray:
        """Distance of points (n, 2), mm, from the nearest singularity: (n,), mm."""
        distance, _ = cKDTree(np.concatenate([singular for singular, _ in self.singularities])).query(points)
        return np.asarray(distance)


def _by_octaves(points: FloatArray, spacing: FloatArray) -> list[tuple[FloatArray, FloatArray]]:
    """Points (n, 2) of less than half the largest spacing (n,) with theirs, those of one octave together."""
    octave = np.floor(-np.log2(spacing / spacing.max())).astype(int)
    return [(points[octave == k], NARROW * spacing[octave == k]) for k in range(1, int(octave.max()) + 1)]


def graded_triangles(mesh: TriangleMesh, spacing: PointSpacing, share: float) -> FloatArray:
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


def graded_quadrature(
    triangles: FloatArray, spacing: PointSpacing, share: float
) -> tuple[FloatArray, FloatArray]:
    """Points (q, 2), mm, and weights (q,), mm^2, in triangles (t, 3, 2).

    Three points of degree 2; one point in a triangle whose edges are below a quarter of `share` of the
    spacing: sixteen of them stand for one.
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


def spread_points(
    triangles: FloatArray, mesh: TriangleMesh, spacing: PointSpacing, share: float
) -> FloatArray:
    """Corners of triangles (t, 3, 2), thinned to at least `share` of the spacing apart, shape (c, 2), mm.

    The mesh's boundary nodes are taken before all others, and near singular points before those far away.
    """
    points = np.unique(np.round(triangles.reshape(-1, 2), 9), axis=0)
    distance = spacing.distance(points)
    from_boundary, _ = cKDTree(mesh.points[np.unique(mesh.boundary_edges)]).query(points)
    inside = from_boundary > 1e-9
    tree, radius = cKDTree(points), share * spacing.at(points)
    free = np.ones(len(points), dtype=bool)
    kept: list[int] = []
    for index in np.lexsort((distance, inside)):
        if free[index]:
            kept.append(int(index))
            free[tree.query_ball_point(points[index], radius[index])] = False
    return np.asarray(points[kept])
