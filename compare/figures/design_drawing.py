"""The design with the paper's nine parameters, the clamped base, the contact and the markers."""

import numpy as np
from matplotlib.lines import Line2D
from matplotlib.patches import Circle

from compare.figures import body
from compare.figures.canvas import Extent
from compare.figures.dimensions import Draughtsman
from compare.figures.style import arrow, axes_at, heading
from geometry.figure import CONTACT, MEASURED, WIDTH, Figure, figure
from geometry.finger.design import Design
from geometry.finger.picture import draw_section
from geometry.finger.section import apex_angle, back_line, cells, rib_direction, rib_pitch, ribs

POINT = 8.5 / 72 / WIDTH
"""Height of the type as a share of the drawing's width."""
LEFT, RIGHT, ABOVE, BELOW = 5.2, 1.6, 7.2, 3.2
"""Room around the body for dimensions, in heights of the type."""
HEAD, FOOT = 0.28, 0.42


def draw_design(design: Design) -> Figure:
    """Draw the section of a finger, to scale, with a dimension for each of the paper's nine parameters."""
    em = design.height * POINT / (1 - (LEFT + RIGHT) * POINT)
    (left, bottom), (right, _) = design.section.bounds
    extent = Extent(left - LEFT * em, right + RIGHT * em, bottom - BELOW * em, ABOVE * em)
    height = WIDTH * extent.height / extent.width
    with figure(HEAD + height + FOOT) as drawn:
        heading(drawn, f"Design “{design.name}”")
        axes = axes_at(drawn, (0, HEAD, WIDTH, height))
        body.prepare(axes, extent)
        shape = design.section
        draw_section(axes, shape)
        base = np.concatenate([loop.ends[which] for loop, which in shape.named("base")])
        body.clamp(axes, base, size=0.8 * em)
        pen = Draughtsman(axes, em)
        pen.text((-1.7 * em, -design.base_width / 2), "clamped", va="center", rotation=90)
        _lengths(pen, design)
        axes.plot(design.contact_ends, (0, 0), color=CONTACT, linewidth=3, solid_capstyle="butt", zorder=5)
        x, style = design.contact_abscissa, "-|>,head_width=0.25,head_length=0.5"
        arrow(axes, (x, 2.8 * em), (x, 0), style=style, colour=CONTACT, width=1.8, gap=2)
        _ribs(pen, design)
        _markers(pen, design)
        markers = f"{len(design.markers)} markers, layout “{design.marker_layout}”"
        drawn.legend(
            handles=[
                Line2D([], [], ls="", marker="o", ms=4, color=MEASURED, label=markers),
                Line2D([], [], color=CONTACT, lw=3, label=f"contact, {design.contact_width:g} mm wide"),
                Line2D([], [], ls="", label=rf"$N$ = {design.rib_count} ribs"),
                Line2D([], [], ls="", label=rf"$W$ = {design.depth:g} mm (depth, out of the plane)"),
            ],
            loc="lower center", ncols=2, columnspacing=2.5, handletextpad=0.6, borderaxespad=0.3,
        )  # fmt: skip
    return drawn


def _lengths(pen: Draughtsman, design: Design) -> None:
    d, em = design, pen.em
    first, second = np.array([0, 4.2 * em]), np.array([0, 6.2 * em])
    pen.between((0, 0), (d.contact_abscissa, 0), first, f"contact at {d.contact_abscissa:g} mm")
    pen.between(
        (d.height - d.tip_length, 0), (d.height, 0), first, rf"$L_\mathrm{{tip}}$ = {d.tip_length:g} mm"
    )
    pen.between((0, 0), (d.height, 0), second, rf"$H$ = {d.height:g} mm")
    pen.between((0, -d.base_width), (0, 0), (-3.8 * em, 0), rf"$L$ = {d.base_width:g} mm")


def _ribs(pen: Draughtsman, design: Design) -> None:
    d, em = design, pen.em
    x = _free_abscissa(design, em)
    text = rf"$t_\mathrm{{flex}}$ = {d.front_thickness:g} mm"
    pen.thickness((x, 0), (x, -d.front_thickness), (x, 1.5 * em), text, side="center")
    back = back_line(d, 0.0).direction
    outward = np.array([back[1], -back[0]])
    inner = cells(d)[-1][1:3].mean(axis=0)
    face = inner + outward * d.back_thickness
    pen.thickness(
        face,
        inner,
        face + outward * 2.6 * em + (0.8 * em, 0),
        rf"$t_\mathrm{{back}}$ = {d.back_thickness:g} mm",
    )
    if not d.rib_count:
        return
    direction = rib_direction(d)
    rib = ribs(d)[d.rib_count // 2]
    along = 0.6
    left, right = (rib[a] + (rib[b] - rib[a]) * along for a, b in ((0, 1), (3, 2)))
    centre, normal = (left + right) / 2, np.array([-direction[1], direction[0]])
    half = normal * d.rib_thickness / 2
    elbow = centre + half + 1.3 * em * normal
    below = np.array([elbow[0], _back_height(d, elbow[0]) - 2.4 * em])
    pen.thickness(centre + half, centre - half, below, rf"$t_\mathrm{{rib}}$ = {d.rib_thickness:g} mm")
    foot = ribs(d)[0][[0, 3]].mean(axis=0)
    reach = float(np.linalg.norm(ribs(d)[0][[1, 2]].mean(axis=0) - foot)) + d.back_thickness + 1.2 * em
    text = rf"$L_\mathrm{{angle}}$ = {d.rib_angle:g}°".replace("-", "−")
    pen.angle(foot, (0.0, -1.0), direction, reach, text, side="right" if d.rib_count == 1 else "center")
    if rib_pitch(d) > 5 * em:
        for number, corners in enumerate(ribs(d), start=1):
            where = 0.68 * corners[[0, 3]].mean(axis=0) + 0.32 * corners[[1, 2]].mean(axis=0)
            pen.text(where, str(number), size=6.5, va="center")


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


def _markers(pen: Draughtsman, design: Design) -> None:
    points = design.markers
    for number, (x, y) in enumerate(points, start=1):
        pen.axes.add_patch(Circle((x, y), design.marker_radius, fc=MEASURED, ec="white", lw=0.4, zorder=4))
        inward = -1 if y > _back_height(design, x) / 2 else 1
        gap = design.marker_radius + 0.75 * pen.em
        if len(points) <= 20:
            pen.text((x, y + inward * gap), str(number), size=6.5, va="center", color=MEASURED)
