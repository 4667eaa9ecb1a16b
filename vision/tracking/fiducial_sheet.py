"""Drawing of the fiducials in true scale, to print and put under a finger."""

from geometry.finger.parameters import Parameters
from geometry.finger.section import finger_section
from vision.tracking.workspace import Workspace

MARGIN = 10.0
"""White space around the fiducials, mm."""
RULER = 50.0
"""Length of the line to measure on the print, mm."""


def workspace_svg(workspace: Workspace, parameters: Parameters) -> str:
    """The fiducials in SVG, the finger's outline between them, and a ruler; one user unit is 1 mm, y up."""
    radius = workspace.fiducial_diameter / 2
    left, bottom = workspace.points.min(axis=0) - radius - MARGIN
    right, top = workspace.points.max(axis=0) + radius + MARGIN
    width, height = right - left, top - bottom
    discs = "\n".join(
        f'    <circle cx="{x:.6g}" cy="{y:.6g}" r="{radius:.6g}"/>' for x, y in workspace.points
    )
    outline = " ".join(f"{x:.6f},{y:.6f}" for x, y in finger_section(parameters).outer)
    middle = (left + right) / 2
    start, end, base = middle - RULER / 2, middle + RULER / 2, bottom + 4
    return f"""<?xml version="1.0" encoding="UTF-8"?>
<svg xmlns="http://www.w3.org/2000/svg" width="{width:.6g}mm" height="{height:.6g}mm"
     viewBox="{left:.6g} {-top:.6g} {width:.6g} {height:.6g}">
  <title>fiducials of {parameters.name}</title>
  <g transform="scale(1 -1)">
  <g id="fiducials" fill="black">
{discs}
  </g>
  <g fill="none" stroke="#909090" stroke-width="0.2">
    <polygon id="finger" points="{outline}"/>
    <line id="ruler" x1="{start:.6g}" x2="{end:.6g}" y1="{base:.6g}" y2="{base:.6g}"/>
  </g>
  </g>
  <text x="{middle:.6g}" y="{-bottom - 5:.6g}" font-size="3" text-anchor="middle"
        fill="#606060">print at 100 %: this line is {RULER:g} mm long</text>
</svg>
"""
