"""Local refinement of the shared mesh by bisection of longest edges: nested, conforming, deterministic.

A triangle to refine is cut at the middles of all its edges, the longest first; neighbours are cut as far as
conformity asks, each through its longest edge before any other. No angle gets smaller than half the smallest
one of the first mesh, however often this is repeated.

Source: M.-C. Rivara, Algorithms for refining triangular grids suitable for adaptive and multigrid techniques,
Int. J. Numer. Meth. Engng 20 (1984) 745-756; the bound is by I. G. Rosenberg, F. Stenger, A lower bound
on the angles of triangles constructed by bisecting the longest side, Math. Comp. 29 (1975) 390-395.
"""

import numpy as np

from pinnray.geometry.mesh.triangle_mesh import TriangleMesh
from pinnray.geometry.section.section import Section
from pinnray.runtime.arrays import BoolArray, FloatArray, IntArray


def refined(mesh: TriangleMesh, marked: BoolArray, section: Section | None = None) -> TriangleMesh:
    """The mesh with the marked triangles cut in four, and others as conformity requires.

    Nodes keep their numbers, new ones follow; markers, contact node and named boundaries stay where they are.

    Args:
        mesh: The mesh.
        marked: Mask of shape (t,).
        section: The section onto whose arcs new boundary nodes are moved; None leaves them on the chord.
    """
    rank = mesh.edge_lengths.argsort(kind="stable").argsort()
    sides = mesh.edge_numbers(mesh.triangles[:, [[0, 1], [1, 2], [2, 0]]])
    turn = (rank[sides].argmax(axis=1)[:, None] + np.arange(3)) % 3
    sides, corners = (np.take_along_axis(array, turn, axis=1) for array in (sides, mesh.triangles))
    cut = np.zeros(len(rank), dtype=bool)
    cut[sides[marked]] = True
    while (behind := cut[sides].any(axis=1) & ~cut[sides[:, 0]]).any():
        cut[sides[behind, 0]] = True
    middle = np.full(len(rank), -1)
    middle[cut] = len(mesh.points) + np.arange(cut.sum())
    return TriangleMesh(
        points=np.concatenate([mesh.points, _middles(mesh, cut, section)]),
        triangles=_cut_triangles(corners, middle[sides]),
        boundaries={name: _cut_edges(mesh, edges, middle) for name, edges in mesh.boundaries.items()},
        marker_nodes=mesh.marker_nodes,
        contact_node=mesh.contact_node,
        depth=mesh.depth,
    )


def _cut_triangles(corners: IntArray, middle: IntArray) -> IntArray:
    """Triangles (a, b, c), longest side ab first, cut at the middles of ab, bc and ca; -1 where not cut."""
    a, b, c = corners.T
    on_ab, on_bc, on_ca = middle.T
    whole = on_ab < 0
    pieces, parents = [corners[whole]], [np.flatnonzero(whole)]
    for start, end, between in ((c, a, on_ca), (b, c, on_bc)):
        half, quarters = ~whole & (between < 0), between >= 0
        for rows, triangle in (
            (half, (start, end, on_ab)),
            (quarters, (on_ab, start, between)),
            (quarters, (end, on_ab, between)),
        ):
            pieces.append(np.stack(triangle, axis=1)[rows])
            parents.append(np.flatnonzero(rows))
    order = np.argsort(np.concatenate(parents), kind="stable")
    return np.asarray(np.concatenate(pieces)[order], dtype=np.int64)


def _cut_edges(mesh: TriangleMesh, edges: IntArray, middle: IntArray) -> IntArray:
    """Boundary edges (k, 2), those that were cut as two halves in the same direction."""
    between = middle[mesh.edge_numbers(edges)]
    first = np.where(between < 0, edges[:, 1], between)
    halves = np.stack([edges[:, 0], first, first, edges[:, 1]], axis=1).reshape(-1, 2)
    kept = np.stack([np.ones(len(edges), dtype=bool), between >= 0], axis=1).ravel()
    return np.asarray(halves[kept], dtype=np.int64)


def _middles(mesh: TriangleMesh, cut: BoolArray, section: Section | None) -> FloatArray:
    """Middles of the edges to be cut, shape (k, 2), mm, moved onto the section's arcs."""
    ends = mesh.points[mesh.edges[cut]]
    middles = np.asarray(ends.mean(axis=1))
    if section is None:
        return middles
    outside = np.zeros(len(mesh.edges), dtype=bool)
    outside[mesh.edge_numbers(mesh.boundary_edges)] = True
    for loop in section.loops:
        for which in np.setdiff1d(np.arange(len(loop.points)), loop.straight):
            centre, radius = loop.circle(int(which))
            off = np.abs(np.linalg.norm(ends - centre, axis=2) - radius)
            chord = np.flatnonzero(outside[cut] & (off < 1e-6).all(axis=1))
            chord = chord[loop.beside_arc(int(which), middles[chord])]
            ray = middles[chord] - centre
            middles[chord] = centre + radius * ray / np.linalg.norm(ray, axis=1, keepdims=True)
    return middles
