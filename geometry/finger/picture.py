"""A finger's section as a picture."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Circle, PathPatch, Polygon
from matplotlib.path import Path as Outline

from geometry.arrays import FloatArray
from geometry.figure import BODY, CONTACT, INK, MEASURED, Figure, body_figure
from geometry.finger.parameters import Parameters
from geometry.finger.section import Section, corner_angles, fillet_points, finger_section, marker_positions


def plot_design(design: Parameters) -> Figure:
    """The section to scale, with its markers and the contact."""
    shape = finger_section(design)
    with body_figure(shape.outer, f"Design “{design.name}”") as (drawn, axes):
        draw_section(axes, shape)
        axes.plot(design.contact_ends, (0, 0), color=CONTACT, lw=3, solid_capstyle="butt", zorder=3)
        for place in marker_positions(design):
            axes.add_patch(Circle(tuple(place), design.marker_radius, fc=MEASURED, zorder=4))
    return drawn


def draw_section(axes: Axes, shape: Section) -> None:
    """Draw the section, in mm; cavities are white."""
    axes.add_patch(Polygon(shape.outer, fc=BODY, ec=INK, lw=0.9, zorder=1))
    for cell in shape.cavities:
        axes.add_patch(PathPatch(_rounded(cell, shape.fillet_radius), fc="white", ec=INK, lw=0.9, zorder=2))


def _rounded(corners: FloatArray, radius: float) -> Outline:
    """A convex polygon with its corners rounded: cubic curves, within 0.03 % of the radius of the arcs."""
    if radius == 0:
        return Outline(np.concatenate([corners, corners[:1]]), closed=True)
    angles = corner_angles(corners)
    pull = 4 / 3 * np.tan((np.pi - angles) / 4) * np.tan(angles / 2)
    vertices = []
    for which, corner in enumerate(corners):
        enter, _, leave = fillet_points(corners, which, radius)
        vertices += [
            enter,
            enter + (corner - enter) * pull[which],
            leave + (corner - leave) * pull[which],
            leave,
        ]
    codes = [Outline.LINETO, Outline.CURVE4, Outline.CURVE4, Outline.CURVE4] * len(corners)
    return Outline(
        np.array([*vertices, vertices[0]]), np.array([Outline.MOVETO, *codes[1:], Outline.CLOSEPOLY])
    )
