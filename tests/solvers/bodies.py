"""Bodies of unlike shapes, meshed, for tests that have to hold on any section."""

from collections.abc import Callable
from functools import cache
from math import cos, pi, radians, sin, tan

import gmsh
import numpy as np

from pinnray.geometry.mesh.mesher import add_section, session, triangulate
from pinnray.geometry.mesh.triangle_mesh import TriangleMesh, boundary_edges, signed_areas
from pinnray.geometry.section.loop import Loop
from pinnray.geometry.section.section import Section


def ring(radius: float = 20.0, thickness: float = 3.0, clamped: float = 60.0) -> tuple[Section, float]:
    """A ring clamped on an arc of so many degrees at its bottom, and the x of its top."""
    half = radians(clamped) / 2
    low = np.array([radius * sin(half), -radius - radius * cos(half)])
    points = np.array([low, [radius, -radius], [0, 0], [-radius, -radius], low * [-1, 1]])
    quarter = pi / 2
    angles = [quarter - half, quarter, quarter, quarter - half, 2 * half]
    # x falls along the upper half, which is the front
    outline = Loop(points, np.tan(np.array(angles) / 4), ("", "front", "front", "", "base"))
    return Section(outline, (_circle((0, -radius), radius - thickness),)), 0.0


def beam(length: float = 60.0, height: float = 4.0) -> tuple[Section, float]:
    """A rectangle without cavities, pressed near its free end."""
    corners = [(0, -height), (length, -height), (length, 0), (0, 0)]
    return Section(Loop.polygon(corners, ["", "", "front", "base"])), length - 3.0


def column(height: float = 40.0, width: float = 2.0) -> tuple[Section, float]:
    """A column clamped at its foot, whose head is the front."""
    half = width / 2
    corners = np.array([[half, -height], [half, 0.0], [-half, 0.0], [-half, -height]])
    return Section(Loop(corners, np.zeros(4), ("", "front", "", "base"))), 0.0


def tilted_wedge(tilt: float = 10.0) -> tuple[Section, float]:
    """A wedge with two cavities whose base leans by so many degrees."""
    low = np.array([30 * tan(radians(tilt)), -30.0])
    outline = Loop.polygon([(0, 0), low, (70, -4), (70, 0)], ["base", "", "", "front"])
    cavities = [[(8, -3), (28, -3), (28, -16), (10, -22)], [(32, -3), (56, -3), (56, -7), (32, -14)]]
    return Section(outline, tuple(Loop.polygon(corners) for corners in cavities)), 30.0


def feet_and_slot() -> tuple[Section, float]:
    """A finger on two feet, the gap between them open, with a T-slot cut into its back."""
    corners = [
        *[(0, 0), (0, -6), (5, -6), (5, -18), (0, -18), (0, -24), (28, -24)],  # the feet
        *[(28, -20), (25, -20), (25, -16), (36, -16), (36, -20), (32, -20), (32, -24)],  # the slot
        *[(60, -10), (60, 0)],
    ]
    names = [""] * len(corners)
    names[0] = names[4] = "base"
    names[-1] = "front"
    return Section(Loop.polygon(corners, names)), 45.0


def notched() -> tuple[Section, float]:
    """A bar with two V-notches, a round notch that leaves a thin hinge, and a narrow slit."""
    corners = [
        *[(0, 0), (0, -10), (14, -10), (15, -5), (16, -10), (26, -10), (34, -10)],
        *[(43, -10), (43, -4), (43.4, -4), (43.4, -10), (60, -10), (60, 0)],
    ]
    names = ["base", *[""] * 11, "front"]
    bulges = np.zeros(len(corners))
    bulges[5] = -1.0  # a half circle cut into the back
    return Section(Loop(np.array(corners, dtype=np.float64), bulges, tuple(names))), 52.0


def arch() -> tuple[Section, float]:
    """A half ring clamped at both ends, one of which leans, so that the base's pieces lie on two lines."""
    outer, inner, lean = 20.0, 16.0, radians(20.0)
    right = [np.array([r * cos(lean), -outer + r * sin(lean)]) for r in (outer, inner)]
    left = [np.array([-r, -outer]) for r in (outer, inner)]
    top_out, top_in = np.array([0.0, 0.0]), np.array([0.0, inner - outer])
    points = np.array([right[0], top_out, left[0], left[1], top_in, right[1]])
    turn = pi / 2 - lean
    bulges = np.tan(np.array([turn, pi / 2, 0, -pi / 2, -turn, 0]) / 4)
    return Section(Loop(points, bulges, ("front", "front", "base", "", "", "base"))), -2.0


BODIES: dict[str, Callable[[], tuple[Section, float]]] = {
    "ring": ring,
    "beam": beam,
    "tilted wedge": tilted_wedge,
    "feet and slot": feet_and_slot,
    "notched": notched,
    "arch": arch,
}
"""Section and abscissa of the contact's middle, by names."""


@cache
def body_mesh(name: str, size: float, width: float = 3.0) -> TriangleMesh:
    """The mesh of one of `BODIES` with elements of `size` mm and a contact that spans `width` mm of x."""
    section, middle = BODIES[name]()
    return mesh_of(section, middle, size, width)


def mesh_of(section: Section, middle: float, size: float, width: float) -> TriangleMesh:
    """A mesh of nearly equal triangles with nodes at the contact's ends and middle and at its markers."""
    outline = section.outline
    for x in (middle - width / 2, middle, middle + width / 2):
        which, fraction = section.front_place(x)
        if 1e-6 < fraction < 1 - 1e-6:
            outline = outline.split(which, [fraction])
            section = Section(outline, section.cavities)
    with session():
        for option, value in (("MeshSizeMin", size), ("MeshSizeMax", size), ("Smoothing", 3)):
            gmsh.option.setNumber(f"Mesh.{option}", value)
        found = triangulate(add_section(section.loops, np.zeros((0, 2))))
    points, triangles = found.points, found.triangles.copy()
    clockwise = signed_areas(points, triangles) < 0
    triangles[clockwise] = triangles[clockwise][:, [0, 2, 1]]
    edges = boundary_edges(triangles)
    keys = [len(points), 1]  # one number an edge, whichever way it runs
    boundaries = {
        name: edges[np.isin(np.sort(edges, axis=1) @ keys, np.sort(nodes, axis=1) @ keys)]
        for name, nodes in found.edges.items()
        if name
    }
    x = points[boundaries["front"]].mean(axis=1)[:, 0]
    boundaries["contact"] = boundaries["front"][np.abs(x - middle) < width / 2]
    contact = np.unique(boundaries["contact"])
    inner = np.setdiff1d(np.arange(len(points)), edges)
    spread = inner[np.argsort(points[inner, 0])][:: max(len(inner) // 7, 1)][1:7]
    return TriangleMesh(
        points=points,
        triangles=triangles,
        boundaries=boundaries,
        marker_nodes=spread,
        contact_node=int(contact[np.abs(points[contact, 0] - middle).argmin()]),
    )


def _circle(centre: tuple[float, float], radius: float) -> Loop:
    """A clockwise circle."""
    x, y = centre
    points = np.array([[x + radius, y], [x, y - radius], [x - radius, y], [x, y + radius]])
    return Loop(points, np.full(4, -tan(pi / 8)), ("",) * 4)
