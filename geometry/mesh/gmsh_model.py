"""The section as a Gmsh model of lines and arcs, and the triangles that Gmsh gives it.

The only module that imports Gmsh, besides `element_size`; import it where it is used.
"""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass

import gmsh
import numpy as np

from geometry.arrays import FloatArray, IntArray
from geometry.section.loop import Loop

LONGEST_ARC = 0.9 * np.pi
"""Gmsh's arcs are shorter than half a circle; longer ones are cut, radians."""


@dataclass(frozen=True, eq=False)
class Triangulation:
    """What Gmsh made of a section.

    Attributes:
        points: Nodes, shape (n, 2), mm.
        triangles: Counter-clockwise node numbers, shape (t, 3).
        edges: Edges on the pieces of each name, as node numbers, each of shape (k, 2).
    """

    points: FloatArray
    triangles: IntArray
    edges: Mapping[str, IntArray]


@contextmanager
def session() -> Iterator[None]:
    """Gmsh with this project's options: silent, one thread, the same random numbers every time.

    The PETSc in it would take options from a `.petscrc` in the working folder, which may be of others: it
    could load a library. Gmsh warns of the option against that, which is not its own, unless it is quiet.
    """
    gmsh.initialize(argv=["gmsh", "-v", "0", "-skip_petscrc"], readConfigFiles=False, interruptible=False)
    try:
        for option, value in (
            ("General.Verbosity", 5),
            ("General.Terminal", 0),
            ("General.NumThreads", 1),
            ("Mesh.Algorithm", 6),
            ("Mesh.RandomSeed", 1),
            ("Mesh.Smoothing", 1),
            ("Mesh.MeshSizeExtendFromBoundary", 0),
            ("Mesh.MeshSizeFromPoints", 0),
            ("Mesh.MeshSizeFromCurvature", 0),
        ):
            gmsh.option.setNumber(option, value)
        yield
    finally:
        gmsh.finalize()


def add_section(loops: tuple[Loop, ...], inner: FloatArray) -> dict[str, list[int]]:
    """Add a surface between curves, with points inside (m, 2), mm, that become nodes.

    Returns:
        Tags of the curves by the name of their piece.
    """
    geo = gmsh.model.geo
    named: dict[str, list[int]] = {}
    tags = []
    for loop in loops:
        pieces = _without_long_arcs(loop)
        corners = [geo.addPoint(x, y, 0) for x, y in pieces.points]
        curves = []
        for which, (start, name) in enumerate(zip(corners, pieces.names, strict=True)):
            end = corners[(which + 1) % len(corners)]
            if which in pieces.straight:
                curves.append(geo.addLine(start, end))
            else:
                centre, _ = pieces.circle(which)
                curves.append(geo.addCircleArc(start, geo.addPoint(*centre, 0), end))
            named.setdefault(name, []).append(curves[-1])
        tags.append(geo.addCurveLoop(curves))
    surface = geo.addPlaneSurface(tags)
    points = [geo.addPoint(x, y, 0) for x, y in inner]
    geo.synchronize()
    gmsh.model.mesh.embed(0, points, 2, surface)
    return named


def triangulate(named: Mapping[str, list[int]]) -> Triangulation:
    """Mesh the current model; `named` are the curves that `add_section` gave."""
    gmsh.model.mesh.generate(2)
    tags, coordinates, _ = gmsh.model.mesh.getNodes()
    _, connectivity = gmsh.model.mesh.getElementsByType(2)
    triangles = connectivity.reshape(-1, 3)
    used = np.unique(triangles)
    number = np.full(int(tags.max()) + 1, -1, dtype=np.int64)
    number[used] = np.arange(len(used))
    order = np.argsort(tags)
    position = order[np.searchsorted(tags, used, sorter=order)]
    edges = {
        name: number[np.concatenate([gmsh.model.mesh.getElementsByType(1, tag)[1] for tag in curves])]
        for name, curves in named.items()
    }
    return Triangulation(
        points=coordinates.reshape(-1, 3)[position, :2].copy(),
        triangles=number[triangles],
        edges={name: nodes.reshape(-1, 2) for name, nodes in edges.items()},
    )


def _without_long_arcs(loop: Loop) -> Loop:
    """The curve with its long arcs cut into equal parts."""
    parts = np.maximum(np.ceil(np.abs(4 * np.arctan(loop.bulges)) / LONGEST_ARC).astype(int), 1)
    for which in np.flatnonzero(parts > 1)[::-1]:
        loop = loop.split(int(which), list(np.arange(1, parts[which]) / parts[which]))
    return loop
