"""The boundary of a mesh, closed loops, re-entrant corners, and the walls, ribs and cavities between them."""

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from geometry.arrays import BoolArray, FloatArray, IntArray
from geometry.mesh.triangle_mesh import TriangleMesh

CORNER_ANGLE = np.radians(10.0)
"""Minimum turn of the boundary at a corner."""
FACING = -0.9
"""Maximum cosine of the angle between the normals of two edges that face each other."""


def boundary_edges(triangles: IntArray) -> IntArray:
    """Edges that belong to one triangle only, shape (k, 2), with the body on their left."""
    directed = triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
    _, first, count = np.unique(np.sort(directed, axis=1), axis=0, return_index=True, return_counts=True)
    return np.asarray(directed[np.sort(first[count == 1])], dtype=np.int64)


def boundary_loops(mesh: TriangleMesh) -> list[IntArray]:
    """The nodes of every closed boundary: the outline first, then the cavities from base to tip."""
    edges = boundary_edges(mesh.triangles)
    nodes, local = np.unique(edges, return_inverse=True)
    local = local.reshape(-1, 2)
    graph = coo_matrix((np.ones(len(local)), (local[:, 0], local[:, 1])), shape=(len(nodes), len(nodes)))
    count, label = connected_components(graph, directed=False)
    loops = [nodes[label == which] for which in range(count)]
    return sorted(loops, key=lambda loop: float(mesh.points[loop, 0].min()))


def mean_thickness(mesh: TriangleMesh) -> float:
    """Twice the area over the perimeter, mm: the thickness of a body that is all walls."""
    ends = mesh.points[boundary_edges(mesh.triangles)]
    perimeter = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1).sum()
    return float(2 * mesh.areas.sum() / perimeter)


def boundary_widths(mesh: TriangleMesh) -> tuple[FloatArray, FloatArray]:
    """Boundary points (b, 2), mm, and the width there, (b,), mm.

    The width is the distance to the nearest other closed boundary, across the wall, or the width of the
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


def walls_and_ribs(mesh: TriangleMesh) -> dict[str, BoolArray]:
    """Triangles of the `front` and `back` wall, where cavities are beside them, and of the `rib`s.

    A wall is as thick as the nearest cavity is far from its face. What remains falls into pieces: the one at
    the base and the one that reaches farthest are base and tip, the others are ribs.

    Returns:
        Masks of shape (t,), without any triangle where the finger has no such part.
    """
    inner = [mesh.points[loop] for loop in boundary_loops(mesh)[1:]]
    none = np.zeros(len(mesh.triangles), dtype=bool)
    if not inner:
        return {"front": none, "back": none, "rib": none}
    cavities = np.concatenate(inner)
    centroids = mesh.at_centroids().points
    beside = (centroids[:, 0] > cavities[:, 0].min()) & (centroids[:, 0] < cavities[:, 0].max())
    parts = {}
    for name in ("front", "back"):
        thickness = _distance(mesh, name, cavities).min()
        parts[name] = beside & (_distance(mesh, name, centroids) < thickness)
    rest = np.flatnonzero(~(parts["front"] | parts["back"]))
    corners = mesh.triangles[rest].ravel()
    touching = coo_matrix((np.ones(len(corners)), (np.repeat(np.arange(len(rest)), 3), corners))).tocsr()
    _, piece = connected_components(touching @ touching.T)
    base = np.isin(mesh.triangles[rest], mesh.boundary("base")).any(axis=1)
    ends = [*piece[base], piece[centroids[rest, 0].argmax()]]
    return parts | {"rib": np.isin(np.arange(len(none)), rest[~np.isin(piece, ends)])}


def elements_through_thickness(mesh: TriangleMesh) -> int:
    """The number of elements through the thinnest wall or rib.

    Each wall lies between the outline and a cavity and each rib between two cavities: this is the least
    number of element edges on a path from one closed boundary to another.
    """
    loop_of = np.full(len(mesh.points), -1)
    for number, loop in enumerate(boundary_loops(mesh)):
        loop_of[loop] = number
    steps = np.where(loop_of >= 0, 0, -1)
    ends = np.concatenate([mesh.edges, mesh.edges[:, ::-1]])
    level = 0
    while True:
        start, stop = loop_of[ends[:, 0]], loop_of[ends[:, 1]]
        met = (start >= 0) & (stop >= 0) & (start != stop)
        if met.any():
            return int((steps[ends[met, 0]] + steps[ends[met, 1]]).min()) + 1
        fresh = ends[(start >= 0) & (stop < 0)]
        if not len(fresh):
            return level
        level += 1
        loop_of[fresh[:, 1]] = loop_of[fresh[:, 0]]
        steps[fresh[:, 1]] = level


def _distance(mesh: TriangleMesh, face: str, points: FloatArray) -> FloatArray:
    """Distance from the straight line through a face, shape (n,), mm."""
    nodes = mesh.points[mesh.boundary(face).ravel()]
    start, end = nodes[nodes[:, 0].argmin()], nodes[nodes[:, 0].argmax()]
    along = (end - start) / np.linalg.norm(end - start)
    away = points - start
    return np.asarray(np.abs(along[0] * away[:, 1] - along[1] * away[:, 0]))
