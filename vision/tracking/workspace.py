"""Workspaces: layouts of fiducials around the finger, at known places in its frame; JSON and print.

The fiducials are dark discs, printed or drilled, that do not move with the finger. Their layout must have no
symmetry of rotation or reflection, so that their places identify them even if some are hidden. Units: mm.
"""

from itertools import product
from pathlib import Path
from typing import Self

import numpy as np
from pydantic import model_validator

from pinnray.geometry.finger.finger import Finger
from pinnray.geometry.finger.parameters import CheckedModel, bounded
from pinnray.runtime.arrays import FloatArray
from pinnray.runtime.errors import UserError
from pinnray.runtime.text_files import read_json

MARGIN = 12.0
"""Distance of the fiducials from the finger's bounding box before loading."""
INDENTER = 0.08
"""Room for the indenter on either side of the contact, as a share of the finger's length."""
SHEET_MARGIN, RULER = 10.0, 50.0
"""White space around the printed fiducials, and length of the line to measure on the print."""

Point = tuple[float, float]


LARGEST = 1000.0
"""Largest diameter and distance of a workspace on a table, mm."""


class Workspace(CheckedModel):
    """Fiducials around the finger, in the finger's frame: x to the tip, y out of the front.

    Attributes:
        fiducials: Centres of the fiducials, in the plane z = 0.
        fiducial_diameter: Diameter of every fiducial.
        marker_plane: z of the markers' plane, positive toward the camera; 0 if the fiducials lie in it.
        simulated: True for the workspace of a film of `pinnray rig`: no camera was involved.

    Raises:
        UserError: If there are fewer than four fiducials or they nearly lie on one line.
    """

    fiducials: tuple[Point, ...]
    fiducial_diameter: float = bounded(4.0, 0.1, LARGEST, "Diameter of every fiducial", "mm")
    marker_plane: float = bounded(
        0.0, -LARGEST, LARGEST, "Height of the markers' plane toward the camera", "mm"
    )
    simulated: bool = False

    @model_validator(mode="after")
    def _determine_the_plane(self) -> Self:
        if len(self.fiducials) < 4:
            raise ValueError(f"{len(self.fiducials)} fiducials; at least 4 are needed")
        spread = np.linalg.svd(self.points - self.points.mean(axis=0), compute_uv=False)
        if spread[1] < 0.05 * spread[0]:
            raise ValueError("the fiducials lie on a line; spread them around the finger")
        return self

    @property
    def points(self) -> FloatArray:
        """The fiducials' centres, shape (n, 2), mm."""
        return np.array(self.fiducials, dtype=np.float64)


def default_workspace(finger: Finger) -> Workspace:
    """Seven fiducials around a finger: four in front of it, with room for the indenter, three behind."""
    (start, below), (end, above) = finger.section.bounds
    left, right, length = start - MARGIN, end + MARGIN, end - start
    contact, room = finger.contact_abscissa, finger.contact_width / 2 + INDENTER * length

    def beside(x: float) -> float:
        """The place, or the nearest one that the indenter leaves free."""
        return x if abs(x - contact) >= room else contact + float(np.copysign(room, x - contact))

    front = product(
        (left, beside(start + 0.15 * length), beside(start + 0.7 * length), right), (above + MARGIN,)
    )
    back = product((left, start + 0.45 * length, right), (below - MARGIN,))
    return Workspace(fiducials=(*front, *back))


def load_workspace(path: Path) -> Workspace:
    """Read a workspace from a JSON file with the fields of `Workspace`.

    Raises:
        UserError: If the file cannot be read or is no workspace.
    """
    content = read_json(path, "workspace")
    if not isinstance(content, dict):
        raise UserError(f"{path}: a workspace has fiducials, fiducial_diameter and marker_plane")
    try:
        return Workspace(**content)
    except UserError as error:
        raise UserError(f"{path}: {error}") from None


def workspace_svg(workspace: Workspace, finger: Finger) -> str:
    """SVG of the fiducials, the finger's outline between them, and a ruler; one user unit is 1 mm, y up."""
    radius = workspace.fiducial_diameter / 2
    left, bottom = workspace.points.min(axis=0) - radius - SHEET_MARGIN
    right, top = workspace.points.max(axis=0) + radius + SHEET_MARGIN
    width, height = right - left, top - bottom
    discs = "\n".join(
        f'    <circle cx="{x:.6g}" cy="{y:.6g}" r="{radius:.6g}"/>' for x, y in workspace.points
    )
    outline = " ".join(f"{x:.6f},{y:.6f}" for x, y in finger.section.outline.flattened())
    middle = (left + right) / 2
    start, end, base = middle - RULER / 2, middle + RULER / 2, bottom + 4
    return f"""<?xml version="1.0" encoding="UTF-8"?>
<svg xmlns="http://www.w3.org/2000/svg" width="{width:.6g}mm" height="{height:.6g}mm"
     viewBox="{left:.6g} {-top:.6g} {width:.6g} {height:.6g}">
  <title>fiducials of {finger.name}</title>
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
