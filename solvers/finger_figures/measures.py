"""The measures of a loaded finger: force over stroke, wrap angle, extremes away from corners, thin places."""

from math import asin, degrees
from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from pinnray.geometry.mesh.boundary import mean_thickness, re_entrant_points, singular_points
from pinnray.geometry.mesh.triangle_mesh import TriangleMesh
from pinnray.geometry.section.section import Section
from pinnray.geometry.section.thickness import cavity_widths, wall_thickness
from pinnray.runtime.arrays import FloatArray
from pinnray.solvers.elasticity import strain_of
from pinnray.solvers.problem import Problem, contact_ends, contact_nodes, front_points
from pinnray.solvers.solution import SmoothField, SolidField, Solution, State, stroke_axes

RAY_SPACING = 0.5
"""Distance of the points from which wall thickness and gaps are measured, mm."""


AT_CORNER = 0.25
"""Distance of a node from a corner over the mean wall thickness up to which it is said to be at it."""


class Extreme(NamedTuple):
    """A largest value and the node where it is, shape (2,), mm; both NaN if no node counts."""

    value: float
    place: FloatArray


def force_curve(solution: Solution, depth: float) -> FloatArray:
    """Stroke of the indenter, mm, and its force for the whole depth, N, from rest on: shape (k, 2).

    The linear law has a straight line, and a solver that follows the load a point for each equilibrium. Of
    any other only the end is known, and nothing of its way: that is the one row.
    """
    load = solution.problem.load
    length, ahead = float(np.linalg.norm(load.values)), depth * stroke_axes(load)[0]
    history = solution.history
    if {"load_fraction", "reaction_x", "reaction_y"} <= history.keys():
        path = np.stack([history["reaction_x"], history["reaction_y"]], axis=1) @ ahead
        return np.array([(0.0, 0.0), *zip(length * history["load_fraction"], path, strict=True)])
    straight = solution.problem.material.law == "linear" and solution.problem.observations is None
    end = length, solution.force
    return np.array([(0.0, 0.0), end] if straight else [end])


def wrap_angle(solution: Solution) -> float:
    """By how many degrees the front face folds around the indenter.

    The front's end at the base, the contact's middle and the front's end at the tip are joined by two chords.
    The wrap angle is what the load adds to the turn from the first chord to the second: positive if the tip
    comes around the indenter, negative if it gives way more than the chord before the contact does. A finger
    that moves as a rigid body has none.
    """
    base, tip = front_ends(solution.problem)
    contact = np.array([0.5 * sum(contact_ends(solution.problem))])
    before = np.concatenate([[base], front_points(solution.problem.mesh, contact), [tip]])
    after = before + solution.displacement(before)
    return turn(after) - turn(before)


def largest_away_from_corners(solution: Solution, gradient: FloatArray) -> tuple[Extreme, Extreme]:
    """The largest von Mises stress, MPa, and principal strain at nodes away from singular points.

    At sharp corners both grow without bound as elements shrink. Nodes nearer than the body's mean wall
    thickness to a re-entrant corner, an end of the base or the contact do not count. The displacement
    gradient is that of `nodal_gradient`.
    """
    problem = solution.problem
    mesh = problem.mesh
    singular = np.concatenate([singular_points(mesh), mesh.points[contact_nodes(problem)]])
    far = cKDTree(singular).query(mesh.points)[0] > mean_thickness(mesh)
    if not far.any():
        nowhere = Extreme(np.nan, np.full(2, np.nan))
        return nowhere, nowhere
    state = State.from_gradient(gradient[far], problem)
    stress, strain = (
        Extreme(float(values.max()), mesh.points[far][values.argmax()])
        for values in (state.von_mises, _principal(state.strain))
    )
    return stress, strain


def largest_strain(solution: Solution, gradient: FloatArray) -> tuple[Extreme, float]:
    """The largest principal strain of all nodes, and the radius of the corner there, mm.

    The radius is zero at a sharp corner, an end of the clamp and a contact that is no cylinder's, where the
    strain has no limit as elements shrink, and NaN away from corners. The displacement gradient is that of
    `nodal_gradient`.
    """
    problem, mesh = solution.problem, solution.problem.mesh
    strain: FloatArray = np.moveaxis(np.array(strain_of(problem.material.law, gradient)), -1, 0)
    principal = _principal(strain[:, :2, :2])
    peak = Extreme(float(principal.max()), mesh.points[principal.argmax()])
    sharp, arcs, radii = re_entrant_points(mesh)
    edges = contact_nodes(problem)[: 0 if problem.load.kind == "cylinder" else None]
    corners = np.concatenate([sharp, mesh.points[edges], arcs])
    distance, nearest = cKDTree(corners).query(peak.place)
    known = np.concatenate([np.zeros(len(sharp) + len(edges)), radii])
    at_corner = distance <= AT_CORNER * mean_thickness(mesh)
    return peak, float(known[nearest]) if at_corner else np.nan


def contact_arc(solution: Solution) -> tuple[float, float]:
    """Angle of a cylinder over which the finger touches it, degrees, and deformed length that touches, mm.

    Both NaN of other loads, and zero where the cylinder does not touch.
    """
    problem, contact = solution.problem, solution.contact
    if problem.load.kind != "cylinder" or not problem.load.radius:
        return np.nan, np.nan
    if contact is None:
        return 0.0, 0.0
    ends = front_points(problem.mesh, np.array([contact.start, contact.end]))
    chord = float(np.linalg.norm(np.diff(ends + solution.displacement(ends), axis=0)))
    angle = 2 * degrees(asin(min(1.0, chord / (2 * problem.load.radius))))
    return angle, float(solution.stats.get("contact_width_mm", np.nan))


def thinnest_wall(section: Section) -> float:
    """Thickness of the thinnest wall or rib, mm; see `pinnray.geometry.section.thickness`."""
    return float(wall_thickness(section, RAY_SPACING)[1].min(initial=np.inf))


def narrowest_gap(section: Section) -> float:
    """Smallest clear width of a cavity, mm, by the same rays across the cavity; infinite without cavities."""
    return float(cavity_widths(section, RAY_SPACING)[1].min(initial=np.inf))


def front_ends(problem: Problem) -> FloatArray:
    """The front's ends at base and tip, shape (2, 2), mm."""
    nodes = problem.mesh.points[np.unique(problem.mesh.boundary("front"))]
    return nodes[[nodes[:, 0].argmin(), nodes[:, 0].argmax()]]


def turn(points: FloatArray) -> float:
    """Angle from the chord between the first two of three points to that between the last two, degrees."""
    (x0, y0), (x1, y1) = np.diff(points, axis=0)
    return float(np.degrees(np.arctan2(x0 * y1 - y0 * x1, x0 * x1 + y0 * y1)))


def _principal(strain: FloatArray) -> FloatArray:
    """Largest principal values of strains in the plane, (n, 2, 2): shape (n,)."""
    return np.asarray(np.linalg.eigvalsh(strain)[:, -1])


def nodal_gradient(solution: Solution) -> FloatArray:
    """The displacement gradient at the mesh's nodes, shape (n, 2, 2) or (n, 3, 3).

    It is the mean over the node's triangles, weighted by their areas, so that numbers depend little on where
    the mesher puts its nodes.
    """
    mesh: TriangleMesh = solution.problem.mesh
    field = solution.field
    if isinstance(field, SmoothField):
        return field.gradient(mesh.at_nodes())
    corners = mesh.at_barycentric(np.eye(3))
    found = field.solid_gradient(corners) if isinstance(field, SolidField) else field.gradient(corners)
    nodes, weights = mesh.triangles.ravel(), np.repeat(mesh.areas, 3)
    count, shape = len(mesh.points), found.shape[1:]
    sums = [np.bincount(nodes, weights * column, count) for column in found.reshape(len(found), -1).T]
    means = np.stack(sums, axis=1) / np.bincount(nodes, weights, count)[:, None]
    return np.asarray(means.reshape(-1, *shape))
