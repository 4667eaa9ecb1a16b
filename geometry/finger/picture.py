"""A finger's section as a picture."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Circle, PathPatch
from matplotlib.path import Path as Outline

from pinnray.geometry.finger.finger import Finger
from pinnray.geometry.section.section import Section
from pinnray.runtime.figure import BODY, CONTACT, INK, MEASURED, Figure, body_figure


def plot_finger(finger: Finger) -> Figure:
    """The section to scale, with its markers and the contact."""
    shape = finger.section
    with body_figure(shape.bounds, f"Design “{finger.name}”") as (drawn, axes):
        draw_section(axes, shape)
        front = np.array([shape.front_point(x) for x in np.linspace(*finger.contact_ends, 9)])
        axes.plot(*front.T, color=CONTACT, lw=3, solid_capstyle="butt", zorder=3)
        for place in finger.markers:
            axes.add_patch(Circle(tuple(place), finger.marker_radius, fc=MEASURED, zorder=4))
    return drawn


def draw_section(axes: Axes, shape: Section, *, deviation: float = 1e-3, width: float = 0.9) -> None:
    """Draw the section, in mm, with an edge of a width in points; cavities are empty."""
    rings = [loop.flattened(deviation)[0] for loop in shape.loops]
    paths = [Outline(np.concatenate([ring, ring[:1]]), closed=True) for ring in rings]
    whole = Outline.make_compound_path(*paths)
    axes.add_patch(PathPatch(whole, fc=BODY, ec=INK, lw=width, zorder=1))
