"""The section as a drawing in true scale: a path for every named piece of the outline, and the markers."""

import numpy as np

from pinnray.geometry.finger.finger import Finger, outline_with_contact
from pinnray.geometry.section.loop import Loop
from pinnray.runtime.arrays import FloatArray

LABELLED = {"base": "#0072b2", "contact": "#d55e00"}
"""Paths that name parts of the outline, with their colours."""


def section_svg(finger: Finger) -> str:
    """The section in SVG, with the groups `outline` and `markers`; one user unit is 1 mm, y points up.

    The paths `base` and `contact` lie on the outline and name its parts.
    """
    shape, named = finger.section, outline_with_contact(finger)
    parts = "\n".join(
        f'  <path id="{label}" fill="none" stroke="{colour}" stroke-width="0.4" d="{_parts(named, label)}"/>'
        for label, colour in LABELLED.items()
    )
    circles = "\n".join(
        f'    <circle cx="{x!r}" cy="{y!r}" r="{finger.marker_radius!r}"/>'
        for x, y in finger.markers.tolist()
    )
    (left, bottom), (right, top) = shape.bounds + np.array([[-2.0], [2.0]])  # a margin, mm
    width, height = right - left, top - bottom
    return f"""<?xml version="1.0" encoding="UTF-8"?>
<svg xmlns="http://www.w3.org/2000/svg" width="{width:g}mm" height="{height:g}mm"
     viewBox="{left:g} {-top:g} {width:g} {height:g}">
  <title>{finger.name}</title>
  <g transform="scale(1 -1)">
  <g id="outline" fill="#3a3a40" fill-rule="evenodd">
    <path d="{" ".join(_path(loop) for loop in shape.loops)}"/>
  </g>
  <g id="markers" fill="#f2401a">
{circles}
  </g>
{parts}
  </g>
</svg>
"""


def _path(loop: Loop) -> str:
    """A closed curve as lines and arcs, every coordinate in full."""
    steps = [_step(loop, which) for which in range(len(loop.points))]
    return " ".join([f"M {_point(loop.points[0])}", *steps, "Z"])


def _parts(loop: Loop, name: str) -> str:
    """The pieces of a name, each by itself."""
    return " ".join(f"M {_point(loop.points[which])} {_step(loop, which)}" for which in loop.pieces(name))


def _step(loop: Loop, which: int) -> str:
    end = loop.ends[which, 1]
    if which in loop.straight:
        return f"L {_point(end)}"
    _, radius = loop.circle(which)
    bulge = float(loop.bulges[which])
    return f"A {radius!r} {radius!r} 0 {int(abs(bulge) > 1)} {int(bulge > 0)} {_point(end)}"


def _point(point: FloatArray) -> str:
    return ",".join(repr(float(value)) for value in point)
