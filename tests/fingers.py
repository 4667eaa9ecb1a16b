"""Fingers without parameters: a ring and a plain beam, with what the protocol `Finger` asks for."""

from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from geometry.arrays import FloatArray
from geometry.content_hash import content_hash
from geometry.figure import Figure
from geometry.finger.finger import Finger
from geometry.finger.picture import plot_finger
from geometry.section.loop import Loop
from geometry.section.section import Section


@dataclass(frozen=True, eq=False)
class SectionFinger:
    """A finger that is its section, its contact and its markers."""

    name: str
    section: Section
    markers: FloatArray
    contact_abscissa: float
    contact_width: float = 4.0
    depth: float = 20.0
    marker_layout: str = "given"
    marker_diameter: float = 1.6
    marker_height: float = 0.6

    @property
    def marker_radius(self) -> float:
        return self.marker_diameter / 2

    @property
    def contact_ends(self) -> tuple[float, float]:
        half = self.contact_width / 2
        return self.contact_abscissa - half, self.contact_abscissa + half

    @property
    def digest(self) -> str:
        return content_hash({**self.definition(), "name": None})

    def at_contact(self, position: float) -> Finger:
        self.section.front_place(position)
        return replace(self, contact_abscissa=position)

    def definition(self) -> dict[str, Any]:
        plain = {key: value for key, value in asdict(self).items() if key != "section"}
        return {**plain, "markers": self.markers.tolist(), "section": self.section.digest}

    def facts(self) -> list[tuple[str, str, str]]:
        width, height = np.ptp(self.section.bounds, axis=0)
        return [
            ("Drawing", "", f"{self.name}.dxf"),
            ("SHA-256 of the drawing", "", self.section.digest),
            ("Extent", "", f"{width:.5g} mm by {height:.5g} mm"),
            ("Depth", "", f"{self.depth:g} mm"),
        ]

    def plot(self) -> Figure:
        return plot_finger(self)


def beam() -> SectionFinger:
    """A solid beam of 100 mm by 10 mm, clamped at its left end; seven markers in two rows."""
    names = ("back", "tip", "front", "base")
    outline = Loop.polygon([(0, -10), (100, -10), (100, 0), (0, 0)], names)
    x = np.linspace(15, 90, 7)
    markers = np.column_stack([x, np.where(np.arange(7) % 2, -7.0, -3.0)])
    return SectionFinger("beam", Section(outline), markers, contact_abscissa=70.0)


RADIUS, WALL = 30.0, 3.0
"""Of the ring: outer radius and thickness, mm."""


def ring(count: int = 9) -> SectionFinger:
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
    return SectionFinger(
        "ring",
        Section(outline, (Loop(inner, np.array([-1.0, -1.0]), ("", "")),)),
        markers[order],
        contact_abscissa=float(centre[0]),
    )
