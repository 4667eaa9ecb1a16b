"""Fingers without parameters: a ring and a plain beam, as if from drawings."""

import numpy as np

from pinnray.geometry.drawing.drawn_finger import DrawnFinger
from pinnray.geometry.drawing.placement import Placement
from pinnray.geometry.section.loop import Loop
from pinnray.geometry.section.section import Section
from pinnray.runtime.arrays import FloatArray


def drawn(name: str, section: Section, markers: FloatArray, contact_abscissa: float) -> DrawnFinger:
    """A finger from a drawing of its section in the finger's frame."""
    return DrawnFinger(
        name=name,
        section=section,
        markers=markers,
        contact_abscissa=contact_abscissa,
        contact_width=4.0,
        depth=20.0,
        marker_diameter=1.6,
        marker_height=0.6,
        file=f"{name}.dxf",
        sha256=section.digest,
        note="DXF",
        placement=Placement(np.eye(2), np.zeros(2)),
        sources={"markers": "given"},
    )


def beam() -> DrawnFinger:
    """A solid beam of 100 mm by 10 mm, clamped at its left end; seven markers in two rows."""
    names = ("back", "tip", "front", "base")
    outline = Loop.polygon([(0, -10), (100, -10), (100, 0), (0, 0)], names)
    x = np.linspace(15, 90, 7)
    markers = np.column_stack([x, np.where(np.arange(7) % 2, -7.0, -3.0)])
    return drawn("beam", Section(outline), markers, contact_abscissa=70.0)


RADIUS, WALL = 30.0, 3.0
"""Of the ring: outer radius and thickness, mm."""


def ring(count: int = 9) -> DrawnFinger:
    """A ring, clamped along 60 degrees below, touched at its top; markers evenly along its middle line.

    The markers are ordered by x and have a symmetry: they look the same from the left and from the right.
    """
    centre = np.array([RADIUS * np.sin(np.pi / 6), -RADIUS])
    corners = np.radians([10, 170, 240, 300])
    spans = np.diff([*corners, corners[0] + 2 * np.pi])
    points = centre + RADIUS * np.column_stack([np.cos(corners), np.sin(corners)])
    outline = Loop(points, np.tan(spans / 4), ("front", "side", "base", "side"))
    inner = (RADIUS - WALL) * np.array([(1, 0), (-1, 0)]) + centre
    angles = np.radians(np.linspace(-35, 215, count))
    markers = centre + (RADIUS - WALL / 2) * np.column_stack([np.cos(angles), np.sin(angles)])
    order = np.lexsort((-markers[:, 1], markers[:, 0].round(9)))
    return drawn(
        "ring",
        Section(outline, (Loop(inner, np.array([-1.0, -1.0]), ("", "")),)),
        markers[order],
        contact_abscissa=float(centre[0]),
    )
