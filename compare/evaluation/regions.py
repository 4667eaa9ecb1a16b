"""Parts of the body by which errors are told apart; together they are the whole mesh, each triangle once."""

from collections.abc import Sequence

import numpy as np
from scipy.spatial import cKDTree

from geometry.arrays import BoolArray, FloatArray, IntArray
from geometry.mesh.boundary import boundary_edges, boundary_loops, mean_thickness, singular_points
from geometry.mesh.triangle_mesh import TriangleMesh
from solvers.problem import Problem, contact_nodes

NEAR = 0.5
"""Radius of the regions around corners and contact, in mean wall thicknesses."""

REGIONS = {
    "corners": "at re-entrant corners and base ends",
    "contact": "at the contact",
    "tip": "in the tip",
    "walls": "in the walls",
    "rest": "in the rest of the body",
}
"""Every region and how to say in words what is there."""


def body_regions(problem: Problem) -> dict[str, BoolArray]:
    """The triangles of every region that the mesh has, masks of shape (t,), by the names of `REGIONS`.

    A triangle with its centroid within `NEAR` of a re-entrant corner or an end of the base belongs to the
    corners; of the others, one within `NEAR` of the contact's nodes to the contact; of the others, one beyond
    the last cavity to the tip, if the body is solid there. All others are walls, ribs included, or the
    rest of a body without cavities.
    """
    mesh = problem.mesh
    centroids = mesh.at_centroids().points
    near = NEAR * mean_thickness(mesh)
    cavities = boundary_loops(mesh)[1:]
    contact = mesh.points[contact_nodes(problem)]
    belongs = {
        "corners": cKDTree(singular_points(mesh)).query(centroids)[0] <= near,
        "contact": cKDTree(contact).query(centroids)[0] <= near,
        "tip": _solid_tip(mesh, cavities, centroids),
        "walls" if cavities else "rest": np.ones(len(centroids), dtype=bool),
    }
    regions, left = {}, np.ones(len(centroids), dtype=bool)
    for name, here in belongs.items():
        regions[name] = here & left
        left &= ~here
    return {name: here for name, here in regions.items() if here.any()}


def _solid_tip(mesh: TriangleMesh, cavities: Sequence[IntArray], centroids: FloatArray) -> BoolArray:
    """Mask of the triangles beyond the last cavity; none unless the body is as thick there as two walls."""
    last = max((mesh.points[cavity, 0].max() for cavity in cavities), default=np.inf)
    beyond = centroids[:, 0] > last
    boundary = mesh.points[np.unique(boundary_edges(mesh.triangles))]
    depth = cKDTree(boundary).query(centroids[beyond])[0]
    return np.asarray(beyond & (depth.max(initial=0.0) > mean_thickness(mesh)))
