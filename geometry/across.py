"""How many elements a mesh has across its walls and ribs."""

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from geometry.arrays import IntArray
from geometry.mesh import TriangleMesh


def boundary_edges(triangles: IntArray) -> IntArray:
    """Edges that belong to one triangle only, shape (k, 2), with the body on their left."""
    directed = triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
    _, first, count = np.unique(np.sort(directed, axis=1), axis=0, return_index=True, return_counts=True)
    return np.asarray(directed[np.sort(first[count == 1])], dtype=np.int64)


def boundary_loops(mesh: TriangleMesh) -> list[IntArray]:
    """The nodes of every closed boundary: the outline first, then the cells from base to tip."""
    edges = boundary_edges(mesh.triangles)
    nodes, local = np.unique(edges, return_inverse=True)
    local = local.reshape(-1, 2)
    graph = coo_matrix((np.ones(len(local)), (local[:, 0], local[:, 1])), shape=(len(nodes), len(nodes)))
    count, label = connected_components(graph, directed=False)
    loops = [nodes[label == which] for which in range(count)]
    return sorted(loops, key=lambda loop: float(mesh.points[loop, 0].min()))


def elements_across(mesh: TriangleMesh) -> int:
    """The fewest element edges on any way from one closed boundary to another.

    Each wall lies between the outline and a cell and each rib between two cells, so this is the number of
    elements across the thinnest place, counted along the mesh's own edges.
    """
    loop_of = np.full(len(mesh.points), -1)
    for which, loop in enumerate(boundary_loops(mesh)):
        loop_of[loop] = which
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
