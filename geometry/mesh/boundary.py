"""The boundary of a mesh, closed loops, re-entrant corners, and the walls, ribs and cavities between them."""

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components, depth_first_order, dijkstra
from scipy.spatial import cKDTree

from pinnray.geometry.mesh.triangle_mesh import TriangleMesh, signed_areas
from pinnray.geometry.section.loop import cross, turns
from pinnray.runtime.arrays import BoolArray, FloatArray, IntArray

CORNER_ANGLE = np.radians(10.0)
"""Minimum turn of the boundary at a corner."""


def are_among(edges: IntArray, others: IntArray) -> BoolArray:
    """Mask of the edges (k, 2) that are among others (m, 2), whichever way both run."""
    ordered = (np.sort(each.astype(np.int64), axis=1) for each in (edges, others))
    first, second = (each[:, 0] * 2**32 + each[:, 1] for each in ordered)
    return np.isin(first, second)


def counter_clockwise(points: FloatArray, triangles: IntArray) -> IntArray:
    """The triangles (t, 3), those that ran clockwise turned round."""
    turned = triangles.copy()
    clockwise = signed_areas(points, triangles) < 0
    turned[clockwise] = turned[clockwise][:, [0, 2, 1]]
    return turned


def boundary_loops(mesh: TriangleMesh) -> list[IntArray]:
    """The nodes of every closed boundary, the body on their left: the outline first, cavities by x."""
    follows = dict(mesh.boundary_edges.tolist())
    loops = []
    for start in sorted(follows):
        if start in follows:
            loop = [start]
            while (after := follows.pop(loop[-1])) != start:
                loop.append(after)
            loops.append(np.array(loop))
    outline = max(loops, key=lambda loop: cross(mesh.points[loop], mesh.points[np.roll(loop, -1)]).sum())
    return sorted(loops, key=lambda loop: (loop is not outline, mesh.points[loop, 0].min()))


def mean_thickness(mesh: TriangleMesh) -> float:
    """Twice the area over the perimeter, mm: the thickness of a body that is all walls."""
    ends = mesh.points[mesh.boundary_edges]
    perimeter = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1).sum()
    return float(2 * mesh.areas.sum() / perimeter)


def boundary_widths(mesh: TriangleMesh) -> tuple[FloatArray, FloatArray]:
    """Boundary points (b, 2), mm, and the width there, (b,), mm.

    The width is the least of three distances: to the nearest other closed boundary, across the wall; to an
    edge of the same closed boundary that faces it through the body, as beside a notch; and to one that faces
    it outside, across a narrow cavity or slot. The last two are looked for within the mean thickness. It is
    infinite where there is none.
    """
    loops = boundary_loops(mesh)
    edges = mesh.points[mesh.boundary_edges]
    middles = edges.mean(axis=1)
    _, nearest = cKDTree(mesh.points[np.concatenate(loops)]).query(edges[:, 0])
    loop_of = np.repeat(np.arange(len(loops)), [len(loop) for loop in loops])[nearest]
    widths = np.full(len(middles), np.inf)
    for number in range(len(loops)):
        own = loop_of == number
        if not own.all():
            widths[own], _ = cKDTree(edges[~own, 0]).query(middles[own])
    return middles, np.minimum(widths, _facing_distance(edges, loop_of, mean_thickness(mesh)))


def _facing_distance(edges: FloatArray, loop_of: IntArray, reach: float) -> FloatArray:
    """Distance from the middle of each edge (k, 2, 2) to one of its loop that faces it, (k,), mm.

    Both through the body and outside; infinite beyond `reach`, mm.
    """
    start, along = edges[:, 0], edges[:, 1] - edges[:, 0]
    middles, normals = edges.mean(axis=1), np.column_stack([along[:, 1], -along[:, 0]])
    lengths = np.linalg.norm(along, axis=1)
    normals /= lengths[:, None]
    tree = cKDTree(middles)
    pairs = tree.query_pairs(reach + 0.5 * float(lengths.max()), output_type="ndarray")
    one, other = np.concatenate([pairs, pairs[:, ::-1]]).T
    cosine = (normals[one] * normals[other]).sum(axis=1)
    kept = (loop_of[one] == loop_of[other]) & (cosine < -0.9)
    one, other, cosine = one[kept], other[kept], cosine[kept]
    # middle + t normal = start + s along
    offset = start[other] - middles[one]
    determinant = cross(normals[one], along[other])
    t = cross(offset, along[other]) / determinant
    s = cross(offset, normals[one]) / determinant
    through_body = (t < -1e-9) & (cosine < -np.cos(np.radians(15.0)))  # the sides of a taper are no wall
    hit = (s >= 0) & (s <= 1) & ((t > 1e-9) | through_body)
    found = np.full(len(edges), np.inf)
    np.minimum.at(found, one[hit], np.abs(t[hit]))
    return np.where(found <= reach, found, np.inf)


def singular_points(mesh: TriangleMesh) -> FloatArray:
    """Re-entrant corners, points of re-entrant arcs and the ends of the clamped base, shape (s, 2), mm."""
    sharp, round_, _ = re_entrant_points(mesh)
    return np.concatenate([sharp, round_])


def re_entrant_points(mesh: TriangleMesh) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Re-entrant corners and ends of the base's pieces (s, 2), points of re-entrant arcs (a, 2), their radii.

    All in mm. A point of an arc is one whose neighbour turns too. Arcs in finer steps than `CORNER_ANGLE`
    count where their radius is below the mean thickness.
    """
    edges = mesh.boundary_edges
    follows = dict(edges.tolist())
    comes_before = {after: node for node, after in follows.items()}
    nodes = np.array(list(follows))
    after, before = (np.array([step[node] for node in follows]) for step in (follows, comes_before))
    into, out = mesh.points[nodes] - mesh.points[before], mesh.points[after] - mesh.points[nodes]
    # The body is on the left of its boundary: a right turn opens it beyond a straight angle.
    turn = -turns(into, out)
    row = dict(zip(nodes.tolist(), range(len(nodes)), strict=True))
    beside = np.array([[row[a], row[b]] for a, b in zip(after.tolist(), before.tolist(), strict=True)])
    lengths = 0.5 * (np.linalg.norm(into, axis=1) + np.linalg.norm(out, axis=1))
    bent = turn > CORNER_ANGLE
    arc = bent & (turn < np.radians(60.0)) & bent[beside].any(axis=1)
    radii = lengths / np.where(turn > 0, turn, np.nan)
    tight = ~bent & (radii < mean_thickness(mesh)) & (turn[beside].min(axis=1) > 0.5 * turn)
    base, times = np.unique(mesh.boundary("base"), return_counts=True)
    sharp = np.concatenate([mesh.points[nodes[bent & ~arc]], mesh.points[base[times == 1]]])
    return sharp, mesh.points[nodes[arc | tight]], radii[arc | tight]


def walls_and_ribs(mesh: TriangleMesh) -> dict[str, BoolArray]:
    """Triangles of the `front` and `back` wall, where cavities are beside them, of the `rib`s and the `base`.

    A wall is as thick as the nearest cavity is far from its face. What remains falls into pieces: the one at
    the base and the one that reaches farthest are base and tip, the others are ribs.

    Returns:
        Masks of shape (t,), empty where the finger has no such part: no cavities, or no boundary `back`.
    """
    inner = [mesh.points[loop] for loop in boundary_loops(mesh)[1:]]
    none = np.zeros(len(mesh.triangles), dtype=bool)
    if not inner or "back" not in mesh.boundaries:
        return {"front": none, "back": none, "rib": none, "base": none}
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
    for name, chosen in (("rib", ~np.isin(piece, ends)), ("base", np.isin(piece, piece[base]))):
        parts[name] = np.isin(np.arange(len(none)), rest[chosen])
    return parts


def elements_through_thickness(mesh: TriangleMesh) -> int:
    """The number of elements through the thinnest wall or rib.

    It is the least number of element edges on a path from one closed boundary to another.
    """
    loops = boundary_loops(mesh)
    loop_of = np.empty(len(mesh.points), dtype=np.int64)
    for number, loop in enumerate(loops):
        loop_of[loop] = number
    one, other = mesh.edges.T
    graph = coo_matrix((np.ones(len(one)), (one, other)), shape=(len(loop_of), len(loop_of))).tocsr()
    options = {"unweighted": True, "min_only": True, "return_predecessors": True}
    steps, _, nearest = dijkstra(graph, directed=False, indices=np.concatenate(loops), **options)
    met = loop_of[nearest[one]] != loop_of[nearest[other]]
    if not met.any():
        return int(steps.max())
    return int((steps[one] + steps[other])[met].min()) + 1


def _distance(mesh: TriangleMesh, face: str, points: FloatArray) -> FloatArray:
    """Distance from the straight line through a face, shape (n,), mm; from its nodes where it is curved."""
    nodes = mesh.points[mesh.boundary(face).ravel()]
    start, end = nodes[nodes[:, 0].argmin()], nodes[nodes[:, 0].argmax()]
    along = (end - start) / np.linalg.norm(end - start)
    if np.abs(cross(along, nodes - start)).max() > 1e-6 * np.linalg.norm(end - start):
        return np.asarray(cKDTree(nodes).query(points)[0])
    return np.asarray(np.abs(cross(along, points - start)))


def evenly_spaced_points(mesh: TriangleMesh, name: str, count: int) -> FloatArray:
    """Points at equal distances along all pieces of a named boundary, both ends included, (count, 2), mm."""
    places, corners, travelled = [], [], 0.0
    for path in edge_paths(mesh.boundary(name)):
        points = mesh.points[path]
        steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
        places.append(travelled + np.append(0.0, steps.cumsum()))
        corners.append(points)
        travelled = places[-1][-1]
    along, points = np.concatenate(places), np.concatenate(corners)
    wanted = np.linspace(0.0, travelled, count)
    return np.column_stack([np.interp(wanted, along, points[:, axis]) for axis in range(2)])


def edge_paths(edges: IntArray) -> list[IntArray]:
    """The nodes along every connected piece of edges (k, 2); a closed piece ends where it starts."""
    nodes, local, degree = np.unique(edges, return_inverse=True, return_counts=True)
    one, other = local.reshape(-1, 2).T
    graph = coo_matrix((np.ones(len(one)), (one, other)), shape=(len(nodes), len(nodes))).tocsr()
    pieces, label = connected_components(graph, directed=False)
    paths = []
    for piece in range(pieces):
        here = np.flatnonzero(label == piece)
        ends = here[degree[here] == 1]
        order, _ = depth_first_order(graph, (ends if len(ends) else here)[0], directed=False)
        paths.append(nodes[order if len(ends) else np.append(order, order[0])])
    return paths
