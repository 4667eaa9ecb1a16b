"""Dimension lines in the manner of an engineering drawing, on matplotlib axes in mm."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Arc
from matplotlib.text import Text

from compare.figures.style import HALO, arrow
from geometry.arrays import FloatArray
from geometry.figure import INK

Point = Sequence[float] | FloatArray
LINE = 0.6


@dataclass(frozen=True)
class Draughtsman:
    """Draws dimensions.

    Attributes:
        axes: Where to draw; data coordinates are mm.
        em: Height of the type, mm of the drawing: the measure of every gap.
    """

    axes: Axes
    em: float

    def between(self, start: Point, end: Point, away: Point, text: str) -> None:
        """A length from `start` to `end`, drawn beside the body with extension lines.

        Args:
            start: First point, mm.
            end: Second point, mm.
            away: From the points to the dimension line, mm.
            text: Symbol and value.
        """
        shift = np.asarray(away, dtype=np.float64)
        length = float(np.linalg.norm(shift))
        beyond = shift * (1 + 0.4 * self.em / length)
        tail, head = np.asarray(start) + shift, np.asarray(end) + shift
        for point in (start, end):
            self._line(np.asarray(point) + shift * (0.3 * self.em / length), point + beyond)
        self._arrow(tail, head, "<|-|>")
        along = head - tail
        angle = float(np.degrees(np.arctan2(along[1], along[0])))
        upright = (angle + 90) % 180 - 90
        label = self.text((tail + head) / 2, text, rotation=90 if upright == -90 else upright, va="center")
        label.set_bbox({"facecolor": "white", "edgecolor": "none", "pad": 1.2})

    def thickness(self, outer: Point, inner: Point, elbow: Point, text: str, *, side: str = "left") -> None:
        """A thickness between two faces, by arrows from outside and a leader to the text.

        Args:
            outer: Point on the face next to the text, mm.
            inner: Point on the other face, mm.
            elbow: Where the leader ends and the text stands, mm.
            text: Symbol and value.
            side: Which edge of the text is at the elbow: `left`, `right` or `center`.
        """
        near, far = np.asarray(outer, dtype=np.float64), np.asarray(inner, dtype=np.float64)
        normal = (near - far) / np.linalg.norm(near - far)
        self._arrow(near + 1.3 * self.em * normal, near, "-|>")
        self._arrow(far - 1.3 * self.em * normal, far, "-|>")
        self._line(near + 1.3 * self.em * normal, elbow)
        gap = {"left": 0.25, "right": -0.25, "center": 0.0}[side] * self.em
        up = elbow[1] > near[1]
        vertical = ("bottom" if up else "top") if side == "center" else "center"
        self.text((elbow[0] + gap, elbow[1]), text, ha=side, va=vertical)

    def angle(
        self, corner: Point, first: Point, second: Point, radius: float, text: str, *, side: str = "center"
    ) -> None:
        """The angle between two directions, as an arc at a distance from their corner.

        Args:
            corner: Where both directions start, mm.
            first: Unit vector.
            second: Unit vector.
            radius: From the corner to the arc, mm.
            text: Symbol and value, set beyond the arc.
            side: Which edge of the text is there: `left`, `right` or `center`.
        """
        centre = np.asarray(corner, dtype=np.float64)
        for direction in (first, second):
            self._line(
                centre, centre + np.asarray(direction) * (radius + 0.8 * self.em), style=(0, (6, 2, 1, 2))
            )
        low, high = sorted(float(np.degrees(np.arctan2(d[1], d[0]))) for d in (first, second))
        self.axes.add_patch(
            Arc(tuple(centre), 2 * radius, 2 * radius, theta1=low, theta2=high, color=INK, lw=LINE, zorder=5)
        )
        middle = np.asarray(first) + np.asarray(second)
        self.text(
            centre + middle / np.linalg.norm(middle) * (radius + 1.2 * self.em), text, va="top", ha=side
        )

    def text(self, where: Point, text: str, **options: Any) -> Text:
        """Text with a white halo, in the drawing's type."""
        settings: dict[str, Any] = {"ha": "center", "color": INK, "zorder": 7, "path_effects": HALO} | options
        return self.axes.text(float(where[0]), float(where[1]), text, **settings)

    def _line(self, start: Point, end: Point, style: Any = "-") -> None:
        self.axes.plot(
            [start[0], end[0]], [start[1], end[1]], color=INK, linewidth=LINE, linestyle=style, zorder=5
        )

    def _arrow(self, tail: Point, head: Point, style: str) -> None:
        arrow(self.axes, tail, head, style=f"{style},head_width=0.12,head_length=0.3", width=LINE)
