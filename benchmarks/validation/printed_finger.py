"""Printed Fin Ray fingers from their published dimensions, and the points that were clicked on them.

The numbers are those of the authors' notebook; source and licence are in `printed_fingers/README.md`.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import shapely

from pinnray.runtime.arrays import FloatArray
from pinnray.runtime.atomic import write_text

FOLDER = Path(__file__).with_name("printed_fingers")
LENGTH, BASE, DEPTH = 70.0, 35.0, 35.0
"""Of the front's and the base's middle line, and of the finger along z, mm."""
FRONT, BACK, RIB = 2.0, 4.0, 3.0
"""Thicknesses, mm."""
RADIUS, FRICTION = 20.0, 0.9
"""Of the cylinder, mm, and the authors' coefficient of friction."""
BEYOND = 2.0
"""How far the tip is drawn beyond the end of the middle line, mm: how the walls meet is not known."""


@dataclass(frozen=True)
class PrintedFinger:
    """A finger, how it was pressed, and what the authors' model misses."""

    name: str
    ribs: tuple[float, ...]  # Angles of the ribs, degrees
    height: float  # Of the cylinder's centre above the base, mm
    travel: float  # Of the cylinder, mm
    authors: float  # Rms distance of the authors' fitted chain of hinges from the pressed points, mm

    @property
    def drawing(self) -> Path:
        """The drawing, beside its description."""
        return FOLDER / f"{self.name}.svg"

    @property
    def clicks(self) -> tuple[Path, Path]:
        """Points at rest and pressed."""
        return FOLDER / f"{self.name}-rest.csv", FOLDER / f"{self.name}-pressed.csv"

    @property
    def markers(self) -> FloatArray:
        """Marked points: every 10 mm up the front's middle, and down the back's from the tip, (14, 2), mm."""
        up = np.column_stack([np.arange(10.0, LENGTH + 1, 10.0), np.full(7, -FRONT / 2)])
        down = np.arange(10.0, LENGTH + 1, 10.0)[:, None] * self._back
        return np.concatenate([up, up[-1] - down])

    @property
    def body(self) -> shapely.Polygon:
        """The section with the front face on y = 0 and the body below; two feet are held at x = 0."""
        end, middle = LENGTH + BEYOND, -FRONT / 2
        tip = np.array([LENGTH, middle])
        # Long enough to be cut at the base and the tip.
        back = shapely.LineString([tip - 90 * self._back, tip + 10 * self._back])
        walls = [shapely.box(0, -FRONT, end, 0), back.buffer(BACK / 2, cap_style="flat")]
        for angle in np.radians(self.ribs):
            start = np.array([BASE + 50 * np.tan(angle), middle])
            along = np.array([np.sin(angle), -np.cos(angle)])
            reach = np.linalg.solve(np.column_stack([along, self._back]), tip - start)[0]
            rib = shapely.LineString([start - along, start + reach * along])
            walls.append(rib.buffer(RIB / 2, cap_style="flat"))
        return shapely.intersection(shapely.union_all(walls), shapely.box(0, -60, end, 0))

    @property
    def _back(self) -> FloatArray:
        """Unit vector up the back wall."""
        return np.array([LENGTH, BASE]) / np.hypot(LENGTH, BASE)

    def draw(self) -> None:
        """Write the drawing and its description."""
        paths = "".join(f'<path d="{_path(ring)}"/>' for ring in (self.body.exterior, *self.body.interiors))
        head = '<svg xmlns="http://www.w3.org/2000/svg" width="80mm" height="50mm" viewBox="0 0 80 50">'
        write_text(self.drawing, f"{head}{paths}</svg>\n")
        outer = sorted(y for x, y in self.body.exterior.coords[:-1] if x == 0)
        markers = ", ".join(f"[{x:.4f}, {y:.4f}]" for x, y in self.markers)
        description = [
            "# There is no wall at the base: the two feet are held.",
            f"clamp = [[[0, 0], [0, {-FRONT:g}]], [[0, {outer[1]:.6f}], [0, {outer[0]:.6f}]]]",
            f"contact = [{self.height:g}, 0]",
            "contact_width = 2",
            f"markers = [{markers}]",
            "marker_diameter = 0.4",
            f"depth = {DEPTH:g}",
        ]
        write_text(self.drawing.with_suffix(".toml"), "\n".join(description) + "\n")


def _path(ring: shapely.LinearRing) -> str:
    places = [f"{x:.6f} {-y:.6f}" for x, y in ring.coords[:-1]]
    return f"M {' L '.join(places)} Z"


FINGERS = (PrintedFinger("A", (15.0, 0.0, -15.0), 26.0, 16.0, 4.44), PrintedFinger("B", (), 30.0, 18.0, 1.42))

if __name__ == "__main__":
    for finger in FINGERS:
        finger.draw()
