"""The section as a drawing in true scale: a path for every named piece of the outline, and the markers."""

import numpy as np

from geometry.arrays import FloatArray
from geometry.finger.finger import Finger
from geometry.section.loop import Loop

MARGIN = 2.0
"""White space around the section, mm."""


def section_svg(finger: Finger) -> str:
    """The section in SVG, with the groups `outline` and `markers`; one user unit is 1 mm, y points up."""
    shape = finger.section
    circles = "\n".join(
        f'    <circle cx="{x!r}" cy="{y!r}" r="{finger.marker_radius!r}"/>'
        for x, y in finger.markers.tolist()
    )
    (left, bottom), (right, top) = shape.bounds + np.array([[-MARGIN], [MARGIN]])
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
  </g>
</svg>
"""


def _path(loop: Loop) -> str:
    """A closed curve as lines and arcs, every coordinate in full."""
    steps = [f"M {_point(loop.points[0])}"]
    for which, end in enumerate(loop.ends[:, 1]):
        if which in loop.straight:
            steps.append(f"L {_point(end)}")
        else:
            _, radius = loop.circle(which)
            bulge = float(loop.bulges[which])
            steps.append(f"A {radius!r} {radius!r} 0 {int(abs(bulge) > 1)} {int(bulge > 0)} {_point(end)}")
    return " ".join([*steps, "Z"])


def _point(point: FloatArray) -> str:
    return ",".join(repr(float(value)) for value in point)
