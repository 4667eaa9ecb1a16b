"""The section as a drawing in true scale: one path and a circle for every marker."""

from geometry.arrays import FloatArray
from geometry.finger.parameters import Parameters
from geometry.finger.section import fillet_points, finger_section, marker_positions

MARGIN = 2.0
"""White space around the section, mm."""


def section_svg(parameters: Parameters) -> str:
    """The section in SVG, with the groups `outline` and `markers`; one user unit is 1 mm, y points up."""
    p = parameters
    shape = finger_section(p)
    paths = [_polygon(shape.outer), *(_cavity(cavity, shape.fillet_radius) for cavity in shape.cavities)]
    circles = "\n".join(
        f'    <circle cx="{x:.6f}" cy="{y:.6f}" r="{p.marker_radius:.6g}"/>' for x, y in marker_positions(p)
    )
    width, height = p.height + 2 * MARGIN, p.base_width + 2 * MARGIN
    return f"""<?xml version="1.0" encoding="UTF-8"?>
<svg xmlns="http://www.w3.org/2000/svg" width="{width:g}mm" height="{height:g}mm"
     viewBox="{-MARGIN:g} {-MARGIN:g} {width:g} {height:g}">
  <title>{p.name}</title>
  <g transform="scale(1 -1)">
  <g id="outline" fill="#3a3a40" fill-rule="evenodd">
    <path d="{" ".join(paths)}"/>
  </g>
  <g id="markers" fill="#f2401a">
{circles}
  </g>
  </g>
</svg>
"""


def _point(point: FloatArray) -> str:
    return f"{point[0]:.6f},{point[1]:.6f}"


def _polygon(corners: FloatArray) -> str:
    return "M " + " L ".join(_point(corner) for corner in corners) + " Z"


def _cavity(corners: FloatArray, radius: float) -> str:
    if radius == 0:
        return _polygon(corners)
    pieces = []
    for which in range(len(corners)):
        start, _, end = fillet_points(corners, which, radius)
        pieces.append(f"{_point(start)} A {radius:.6g} {radius:.6g} 0 0 1 {_point(end)}")
    return "M " + " L ".join(pieces) + " Z"
