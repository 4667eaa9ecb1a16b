"""The dimensioned drawing of a design."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import singledispatch

import numpy as np
import shapely
from matplotlib.lines import Line2D
from matplotlib.patches import Circle

from pinnray.comparison.figures import body
from pinnray.comparison.figures.canvas import Extent
from pinnray.comparison.figures.dimensions import CENTRE_LINE, Draughtsman, upright
from pinnray.comparison.figures.style import arrow, axes_at, write_heading
from pinnray.geometry.finger.design import Design
from pinnray.geometry.finger.finger import Finger
from pinnray.geometry.finger.picture import draw_section
from pinnray.geometry.finger.section import (
    apex_angle,
    back_line,
    base_corners,
    base_line,
    cells,
    rib_direction,
    ribs,
    tip_tangent,
)
from pinnray.geometry.section.section import Section
from pinnray.geometry.section.thickness import inner_normals
from pinnray.runtime.arrays import FloatArray
from pinnray.runtime.figure import CONTACT, MEASURED, SMALL, WIDTH, Figure, figure

POINT = 8.5 / 72 / WIDTH
"""Height of the type as a share of the drawing's width."""


@singledispatch
def draw_design(finger: Finger) -> Figure:
    """Draw the section of a finger, to scale, with its dimensions, clamp, contact and numbered markers.

    A `Design` has a dimension for each of the paper's nine parameters, any other finger its overall ones.
    """
    bounds = finger.section.bounds
    (left, bottom), (right, top) = bounds
    x, y = finger.section.front_point(finger.contact_abscissa).round(3) + 0.0
    notes = [f"contact’s middle at ({x:.4g}, {y:.4g}) mm", f"depth {finger.depth:.4g} mm"]
    with _sheet(finger, bounds, (3.0, 5.0, 6.0, 3.4), notes) as (drawn, pen):
        em = pen.em
        pen.between((left, top), (right, top), (0, 4.2 * em), f"{right - left:.4g} mm")
        pen.between((right, bottom), (right, top), (2.4 * em, 0), f"{top - bottom:.4g} mm")
    return drawn


@draw_design.register
def _(design: Design) -> Figure:
    corners = np.concatenate([design.section.bounds, base_corners(design), [(design.height, 0.0)]])
    bounds = np.stack([corners.min(axis=0), corners.max(axis=0)])
    ribs_and_depth = [
        rf"$N$ = {design.rib_count} ribs",
        rf"$W$ = {design.depth:.4g} mm (depth, out of the plane)",
    ]
    with _sheet(design, bounds, (5.2, 1.6, 7.2, 3.2), [*ribs_and_depth, *_further(design)]) as (drawn, pen):
        _lengths(pen, design)
        _thicknesses(pen, design)
        if design.rib_count:
            _ribs(pen, design)
    return drawn


@contextmanager
def _sheet(
    finger: Finger, bounds: FloatArray, room: Sequence[float], notes: Sequence[str]
) -> Iterator[tuple[Figure, Draughtsman]]:
    """A drawing of a finger that is given its dimensions in the block, and then numbers and a legend.

    Around the bounds, smallest and largest x and y, shape (2, 2), mm, there is room on the left, the right,
    above and below, in heights of the type. Notes are further lines of the legend.
    """
    labels = [f"{len(finger.markers)} markers ({finger.marker_layout})"]
    labels += [f"contact, {finger.contact_width:.4g} mm wide", *notes]
    extent, em = _page(bounds, room)
    head, height, foot = 0.28, WIDTH * extent.height / extent.width, 0.16 * -(-len(labels) // 2) + 0.1
    with figure(head + height + foot) as drawn:
        write_heading(drawn, f"Design “{finger.name}”")
        axes = axes_at(drawn, (0, head, WIDTH, height))
        body.prepare(axes, extent)
        draw_section(axes, finger.section)
        pen = Draughtsman(axes, em)
        _directions(pen, extent)
        _clamp(pen, finger.section)
        _contact(pen, finger)
        yield drawn, pen
        _markers(pen, finger)
        handles = [
            Line2D([], [], ls="", marker="o", ms=4, color=MEASURED),
            Line2D([], [], color=CONTACT, lw=3),
            *(Line2D([], [], ls="") for _ in notes),
        ]
        drawn.legend(
            handles, labels, loc="lower center", ncols=2, columnspacing=2.5, handletextpad=0.6,
            borderaxespad=0.3,
        )  # fmt: skip


def _page(bounds: FloatArray, room: Sequence[float]) -> tuple[Extent, float]:
    """Extent of a drawing at most 5.2 inches high, and height of its type, mm, with room around."""
    left, right, above, below = room
    (width, height), (middle, _) = bounds[1] - bounds[0], bounds.mean(axis=0)
    across = max(width / (1 - (left + right) * POINT), height / (5.2 / WIDTH - (above + below) * POINT))
    em = float(across * POINT)
    start = middle - (across + (left - right) * em) / 2
    return Extent(start, start + across, bounds[0, 1] - below * em, bounds[1, 1] + above * em), em


def _directions(pen: Draughtsman, extent: Extent) -> None:
    """The directions of x and y, and so of u and v, at the lower right, below the finger."""
    em = pen.em
    corner = np.array([extent.right - 4.4 * em, extent.bottom + 0.7 * em])
    for way, word in ((np.array([1.0, 0.0]), "x, u"), (np.array([0.0, 1.0]), "y, v")):
        arrow(
            pen.axes, corner, corner + 2.0 * em * way, style="-|>,head_width=0.12,head_length=0.3", width=0.8
        )
        pen.text(
            corner + 3.2 * em * way if way[0] else corner + 2.6 * em * way, word, size=SMALL, va="center"
        )


def _clamp(pen: Draughtsman, section: Section) -> None:
    """The clamped base with hatches, and a word beside it."""
    lines = [loop.along(which, np.linspace(0, 1, 65)) for loop, which in section.named("base")]
    body.clamp(pen.axes, lines, size=0.8 * pen.em)
    ways = np.array([line[-1] - line[0] for line in lines])
    alike = np.linalg.norm(ways.sum(axis=0)) > 0.5 * np.linalg.norm(ways, axis=1).sum()
    longest = int(np.linalg.norm(ways, axis=1).argmax())
    way, points = (ways.sum(axis=0), np.concatenate(lines)) if alike else (ways[longest], lines[longest])
    along = way / np.linalg.norm(way)
    frame = np.stack([along, along[::-1] * (1, -1)])
    places = points @ frame.T
    middle = np.array([places[:, 0].min() + places[:, 0].max(), 2 * places[:, 1].max() + 3.4 * pen.em]) / 2
    pen.text(middle @ frame, "clamped", va="center", rotation=upright(along), rotation_mode="anchor")


def _contact(pen: Draughtsman, finger: Finger) -> None:
    """The touched part of the front, and an arrow along the normal in its middle."""
    section = finger.section
    touched = np.array([section.front_point(x) for x in np.linspace(*finger.contact_ends, 33)])
    pen.axes.plot(*touched.T, color=CONTACT, linewidth=3, solid_capstyle="butt", zorder=5)
    which, fraction = section.front_place(finger.contact_abscissa)
    middle, inward = touched[16], inner_normals(section.outline, which, fraction)[0]
    style = "-|>,head_width=0.25,head_length=0.5"
    arrow(pen.axes, middle - 2.8 * pen.em * inward, middle, style=style, colour=CONTACT, width=1.8, gap=2)


def _lengths(pen: Draughtsman, design: Design) -> None:
    d, em = design, pen.em
    first, second = np.array([0, 4.2 * em]), np.array([0, 6.2 * em])
    contact, tip = d.contact_abscissa, d.height - d.tip_length
    pen.between((0, 0), (contact, 0), first, f"contact at {contact:.4g} mm")
    pen.between((tip, 0), (d.height, 0), first, rf"$L_\mathrm{{tip}}$ = {d.tip_length:.4g} mm")
    pen.between((0, 0), (d.height, 0), second, rf"$H$ = {d.height:.4g} mm")
    below = base_line(d, -d.foot_height)
    start, end = below.point, below.point + d.base_width * below.direction
    pen.between(end, start, -3.8 * em * base_line(d, 1.0).point, rf"$L$ = {d.base_width:.4g} mm")
    if d.tip_radius:
        apex, rounded = np.array([d.height, 0.0]), tip_tangent(d)
        for direction in (back_line(d, 0.0).direction, (1.0, 0.0)):
            pen.line(apex - rounded * np.asarray(direction), apex, style=CENTRE_LINE)


def _further(design: Design) -> list[str]:
    """Lines of the legend for parameters that the paper does not have."""
    d, lines = design, []
    if d.base_tilt:
        lines.append(f"base tilted by {d.base_tilt:.4g}°".replace("-", "−"))
    if d.tip_radius:
        lines.append(f"tip rounded by {d.tip_radius:.4g} mm")
    if d.foot_height:
        slot = f", T-slot {d.slot_width:.4g} mm wide" if d.slot_width else ""
        lines.append(f"foot {d.foot_height:.4g} mm high{slot}")
    return lines


def _thicknesses(pen: Draughtsman, design: Design) -> None:
    """Thicknesses of the front and the back wall."""
    d, em = design, pen.em
    x = _free_abscissa(design, em)
    text = rf"$t_\mathrm{{flex}}$ = {d.front_thickness:.4g} mm"
    pen.thickness((x, 0), (x, -d.front_thickness), (x, 1.5 * em), text, side="center")
    back = back_line(d, 0.0).direction
    outward = np.array([back[1], -back[0]])
    inner = cells(d)[-1][1:3].mean(axis=0)
    face = inner + outward * d.back_thickness
    text = rf"$t_\mathrm{{back}}$ = {d.back_thickness:.4g} mm"
    pen.thickness(face, inner, face + outward * 2.6 * em + (0.8 * em, 0), text)


def _ribs(pen: Draughtsman, design: Design) -> None:
    """Thickness of a rib in the middle, and the first one's angle from the line of reference."""
    d, em = design, pen.em
    direction = rib_direction(d)
    rib = ribs(d)[d.rib_count // 2]
    along = 0.6
    left, right = (rib[a] + (rib[b] - rib[a]) * along for a, b in ((0, 1), (3, 2)))
    centre, normal = (left + right) / 2, np.array([-direction[1], direction[0]])
    half = normal * d.rib_thickness / 2
    elbow = centre + half + 1.3 * em * normal
    below = np.array([elbow[0], _back_height(d, elbow[0]) - 2.4 * em])
    text = rf"$t_\mathrm{{rib}}$ = {d.rib_thickness:.4g} mm"
    pen.thickness(centre + half, centre - half, below, text)
    foot = ribs(d)[0][[0, 3]].mean(axis=0)
    reach = float(np.linalg.norm(ribs(d)[0][[1, 2]].mean(axis=0) - foot)) + d.back_thickness + 1.2 * em
    text = rf"$L_\mathrm{{angle}}$ = {d.rib_angle:.4g}°".replace("-", "−")
    base = d.rib_reference == "base"
    text += " from the base" if base else ""
    first = base_line(d, 0.0).direction if base else (0.0, -1.0)
    side = "left" if base else "right" if d.rib_count == 1 else "center"
    pen.angle(foot, first, direction, reach, text, side=side)


def _free_abscissa(design: Design, em: float) -> float:
    """Abscissa with most room on the front wall, off contact, markers and cavities' ends, mm."""
    places = np.array([cell[[0, 3], 0] @ (1 - s, s) for cell in cells(design) for s in (0.3, 0.5, 0.7)])
    end = design.height - design.tip_length
    room = [
        np.abs(places - design.contact_abscissa) / (4.5 * em),
        np.abs(places[:, None] - design.markers[:, 0]).min(axis=1) / em,
        places / (3.8 * em),
        (end - places) / (3.8 * em),
    ]
    return float(places[np.min(room, axis=0).argmax()])


def _back_height(design: Design, x: float) -> float:
    """Y of the back face at an abscissa, mm."""
    return float((x - design.height) * np.tan(apex_angle(design)))


def _markers(pen: Draughtsman, finger: Finger) -> None:
    """The markers and their numbers, each where the most room is left by outline, dimensions and others."""
    em, radius = pen.em, finger.marker_radius
    for place in finger.markers:
        pen.axes.add_patch(Circle(tuple(place), radius, fc=MEASURED, ec="white", lw=0.4, zorder=4))
    if len(finger.markers) > 60:  # numbers would hide the drawing
        return
    drawn, numbers = [finger.section.polygon.boundary, *pen.drawn()], [shapely.Point()]
    turns = np.pi * (np.arange(24) / 12 - 0.5)
    turns = turns[np.argsort(-np.abs(np.sin(turns)).round(9), kind="stable")]  # below and above come first
    directions = np.stack([np.cos(turns), np.sin(turns)], axis=1)
    steps = np.concatenate([(radius + gap * em) * directions for gap in (0.75, 1.4)])
    others = shapely.buffer(shapely.points(finger.markers), radius)
    for number, place in enumerate(finger.markers):
        places, text = place + steps, str(number + 1)
        half = 0.25 * em * len(text)
        taken = shapely.union_all([*drawn, *np.delete(others, number)])
        room = shapely.distance(shapely.points(places), taken)
        room = np.fmin(room, shapely.distance(shapely.points(places), shapely.union_all(numbers)) - half)
        found = places[int(np.minimum(room, 0.5 * em).round(6).argmax())]
        pen.text(found, text, size=SMALL, va="center", color=MEASURED)
        numbers.append(shapely.Point(found).buffer(half))
