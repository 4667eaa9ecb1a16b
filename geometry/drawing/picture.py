"""A drawn finger as a picture in the axes of its file: what is held, touched and marked."""

import numpy as np
from matplotlib.patches import Circle

from pinnray.geometry.drawing.placement import Placement
from pinnray.geometry.finger.finger import Finger
from pinnray.geometry.finger.picture import draw_section
from pinnray.geometry.section.loop import Loop
from pinnray.geometry.section.thickness import inner_normals
from pinnray.runtime.arrays import FloatArray
from pinnray.runtime.figure import CONTACT, INK, MEASURED, SMALL, Figure, body_figure


def plot_drawing(finger: Finger, placement: Placement) -> Figure:
    """The section in the file's axes, mm: the clamp hatched, an arrow at the contact, numbered markers."""
    place = placement.inverse
    section = place.section(finger.section)
    extent = float(np.ptp(section.bounds, axis=0).max())
    contact = finger.section.front_point(finger.contact_abscissa)
    tip, tail = place(np.stack([contact, contact + np.array([0.0, 0.09 * extent])]))
    hatched = section.bounds + 0.03 * extent * np.array([[-1], [1]])
    shown = _not_tall(np.concatenate([hatched, tip[None], tail[None]]))
    with body_figure(shown, f"Drawing “{finger.name}”") as (drawn, axes):
        draw_section(axes, section, deviation=0.01, width=0.7)
        for loop, which in section.named("base"):
            axes.plot(*loop.along(which, np.linspace(0, 1, 60)).T, color=INK, lw=2.2, zorder=3)
            axes.plot(*_hatches(loop, which, extent / 40), color=INK, lw=0.6, zorder=2)
        front = np.linspace(*finger.contact_ends, 30)
        touched = place(np.array([finger.section.front_point(x) for x in front]))
        axes.plot(*touched.T, color=CONTACT, lw=2.5, solid_capstyle="butt", zorder=4)
        axes.annotate("", tip, tail, arrowprops={"arrowstyle": "-|>", "color": CONTACT, "lw": 1.4}, zorder=5)
        for number, centre in enumerate(place(finger.markers), start=1):
            axes.add_patch(Circle(tuple(centre), finger.marker_radius, fc=MEASURED, ec="none", zorder=4))
            axes.annotate(
                str(number),
                centre,
                xytext=(3, 3),
                textcoords="offset points",
                fontsize=SMALL,
                color=MEASURED,
                zorder=6,
            )
    return drawn


def _not_tall(points: FloatArray) -> FloatArray:
    """Points (n, 2) with two more that make their extent at most 0.8 times as high as wide."""
    (left, bottom), (right, top) = points.min(axis=0), points.max(axis=0)
    half = max(right - left, (top - bottom) / 0.8) / 2
    middle = 0.5 * (left + right)
    return np.concatenate([points, [[middle - half, bottom], [middle + half, top]]])


def _hatches(loop: Loop, which: int, step: float) -> FloatArray:
    """Short strokes on the outer side of a piece, as coordinates (2, k) with gaps."""
    count = max(int(loop.lengths[which] / step), 2)
    share = (np.arange(count) + 0.5) / count
    start, outward = loop.along(which, share), -inner_normals(loop, which, share)
    turned = outward @ np.array([[1.0, 0.6], [-0.6, 1.0]])
    strokes = np.stack([start, start + 0.9 * step * turned, np.full_like(start, np.nan)], axis=1)
    return np.asarray(strokes.reshape(-1, 2).T)
