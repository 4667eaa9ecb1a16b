"""Dimension lines, leaders and arcs, as in a technical drawing."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import shapely
from matplotlib.axes import Axes
from matplotlib.text import Annotation, Text

from pinnray.comparison.figures.style import HALO, arrow
from pinnray.runtime.arrays import FloatArray
from pinnray.runtime.figure import INK

LabelPlace = Sequence[float] | FloatArray
CENTRE_LINE = (0, (6, 2, 1, 2))
"""Dashes and dots of a line that is no edge."""


def upright(along: FloatArray) -> float:
    """Turn of a text along a direction, shape (2,), that reads from below or from the right, degrees."""
    angle = float(np.degrees(np.arctan2(along[1], along[0])))
    turned = (angle + 90) % 180 - 90
    return 90.0 if turned == -90 else turned


@dataclass(frozen=True)
class Draughtsman:
    """Draws dimensions."""

    axes: Axes  # their data coordinates are mm
    em: float  # height of the type, mm of the drawing: the measure of every gap

    def between(self, start: LabelPlace, end: LabelPlace, away: LabelPlace, text: str) -> None:
        """A length from `start` to `end` with extension lines to its dimension line, which is `away`, mm."""
        shift = np.asarray(away, dtype=np.float64)
        length = float(np.linalg.norm(shift))
        beyond = shift * (1 + 0.4 * self.em / length)
        tail, head = np.asarray(start) + shift, np.asarray(end) + shift
        for point in (start, end):
            self.line(np.asarray(point) + shift * (0.3 * self.em / length), point + beyond)
        self._arrow(tail, head, "<|-|>")
        turn = upright(head - tail)
        label = self.text((tail + head) / 2, text, rotation=turn, va="center", rotation_mode="anchor")
        label.set_bbox({"facecolor": "white", "edgecolor": "none", "pad": 1.2})

    def thickness(
        self, outer: LabelPlace, inner: LabelPlace, elbow: LabelPlace, text: str, *, side: str = "left"
    ) -> None:
        """A thickness between points on two faces, by arrows from outside and a leader from the outer one.

        The leader ends at the elbow, where the text stands with its `left`, `right` or `center`.
        """
        near, far = np.asarray(outer, dtype=np.float64), np.asarray(inner, dtype=np.float64)
        normal = (near - far) / np.linalg.norm(near - far)
        self._arrow(near + 1.3 * self.em * normal, near, "-|>")
        self._arrow(far - 1.3 * self.em * normal, far, "-|>")
        self.line(near + 1.3 * self.em * normal, elbow)
        gap = {"left": 0.25, "right": -0.25, "center": 0.0}[side] * self.em
        up = elbow[1] > near[1]
        vertical = ("bottom" if up else "top") if side == "center" else "center"
        self.text((elbow[0] + gap, elbow[1]), text, ha=side, va=vertical)

    def angle(
        self,
        corner: LabelPlace,
        first: LabelPlace,
        second: LabelPlace,
        radius: float,
        text: str,
        *,
        side: str = "center",
    ) -> None:
        """The angle between two unit vectors, as an arc of a radius, mm, around the corner where they start.

        The text stands beyond the arc with its `left`, `right` or `center`.
        """
        centre = np.asarray(corner, dtype=np.float64)
        for direction in (first, second):
            self.line(centre, centre + np.asarray(direction) * (radius + 0.8 * self.em), style=CENTRE_LINE)
        start, end = (float(np.arctan2(direction[1], direction[0])) for direction in (first, second))
        turns = np.linspace(start, end, 65)
        arc = centre[:, None] + radius * np.stack([np.cos(turns), np.sin(turns)])
        self.axes.plot(*arc, color=INK, linewidth=0.6, zorder=5)
        middle = np.asarray(first) + np.asarray(second)
        self.text(
            centre + middle / np.linalg.norm(middle) * (radius + 1.2 * self.em), text, va="top", ha=side
        )

    def text(self, where: LabelPlace, text: str, **options: Any) -> Text:
        """Text with a white halo, in the drawing's type."""
        settings: dict[str, Any] = {"ha": "center", "color": INK, "zorder": 7, "path_effects": HALO} | options
        return self.axes.text(float(where[0]), float(where[1]), text, **settings)

    def line(self, start: LabelPlace, end: LabelPlace, style: Any = "-") -> None:
        """A thin line between two points, mm."""
        self.axes.plot(
            [start[0], end[0]], [start[1], end[1]], color=INK, linewidth=0.6, linestyle=style, zorder=5
        )

    def drawn(self) -> list[shapely.Geometry]:
        """Lines, arrows and texts so far, the texts as discs, mm."""
        found: list[shapely.Geometry] = [shapely.LineString(line.get_xydata()) for line in self.axes.lines]
        for text in self.axes.texts:
            if isinstance(text, Annotation) and text.arrow_patch is not None:
                found.append(shapely.LineString([text.xyann, text.xy]))
            else:
                found.append(shapely.Point(text.get_position()).buffer(0.7 * self.em))
        return found

    def _arrow(self, tail: LabelPlace, head: LabelPlace, style: str) -> None:
        arrow(self.axes, tail, head, style=f"{style},head_width=0.12,head_length=0.3", width=0.6)
