"""Random drawings as programs write them: each read to 1e-6 of its area, or refused in one line.

`python -m benchmarks.reliability.drawings COUNT [SEED]` makes DXF, SVG, STEP and MSH files of random
sections: blocks, units, hidden layers, split faces, placements, short lines and gaps. What a refusal proposes
(`units`, `tolerance`) must work. Areas and distances of markers are computed here, without the readers' code.
"""

import re
import sys
import tempfile
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from benchmarks.reliability import drawing_files
from pinnray.geometry.drawing.checks import body
from pinnray.geometry.drawing.load import read_drawing
from pinnray.runtime.errors import UserError

SAME = 1e-6
"""Largest relative difference of areas and of the markers' distances."""


class Curve(NamedTuple):
    """Corners (n, 2), mm, and the bulge of the piece after each, as in DXF."""

    points: np.ndarray
    bulges: np.ndarray

    @property
    def area(self) -> float:
        """Area by the corners and the circular segments, mm^2."""
        (x, y), (z, w) = self.points.T, np.roll(self.points, -1, axis=0).T
        chord, angle = np.hypot(z - x, w - y), 4 * np.arctan(self.bulges)
        bent = np.abs(self.bulges) > 0
        radius = np.divide(chord, 2 * np.sin(angle / 2), out=np.zeros_like(chord), where=bent)
        return float(0.5 * (x * w - z * y).sum() + (0.5 * radius**2 * (angle - np.sin(angle))).sum())


class Sketch(NamedTuple):
    """A section: its outline, cavities and markers (m, 2), mm."""

    outline: Curve
    cavities: tuple[Curve, ...]
    markers: np.ndarray

    @property
    def area(self) -> float:
        """Area of the body, mm^2."""
        return self.outline.area - sum(each.area for each in self.cavities)


class Drawn(NamedTuple):
    """A file of a sketch: how it is read, and for how long a gap an end is apart, mm."""

    path: Path
    kind: str
    settings: dict[str, Any]
    gap: float = 0.0


def sketch(random: np.random.Generator, shapes: int = 3) -> Sketch:
    """A section with up to five cavities in a row and four markers above them.

    Args:
        random: Random numbers.
        shapes: 1 for straight sides alone, 2 for arcs, too, 3 for corners of fine lines, too.
    """
    wide, high, tip = random.uniform(40, 120), random.uniform(12, 30), random.uniform(11, 12)
    corners = np.array([[0, 0], [wide, high - tip], [wide, high], [0, high]])
    shape = random.integers(shapes)
    if shape == 0:
        outline = Curve(corners, np.zeros(4))
    else:
        step = random.choice([3e-4, 9e-4, 2e-3, 0.05])
        outline = _rounded(wide, high, random.uniform(0.2, 2.0) if shape == 1 else min(1.0, 200 * step))
        outline = outline if shape == 1 else _chopped(outline, step)
    count = int(random.integers(6))
    middles = (np.arange(count) + 0.5) * wide / max(count, 1)
    room = min(4.0, 0.3 * wide / max(count, 1))
    cavities = tuple(_cavity(random, x, high - 6, room, shapes == 1) for x in middles)
    markers = np.stack([wide * np.array([0.2, 0.4, 0.6, 0.85]), np.full(4, high - 1.2)], axis=1)
    return Sketch(outline, cavities, markers[: int(random.integers(5))])


def _rounded(wide: float, high: float, radius: float) -> Curve:
    x, y, r = wide, high, radius
    points = [[r, 0], [x - r, 0], [x, r], [x, y - r], [x - r, y], [r, y], [0, y - r], [0, r]]
    return Curve(np.array(points), np.tile([0.0, np.tan(np.pi / 8)], 4))


def _chopped(curve: Curve, step: float) -> Curve:
    """The first arc of a curve as short lines."""
    start, end = curve.points[1], curve.points[2]
    count = int(np.ceil(np.linalg.norm(end - start) / step)) + 1
    radius = end[0] - start[0]
    angles = np.linspace(-np.pi / 2, 0, count + 1)[:-1]
    arc = np.array([start[0], end[1]]) + radius * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    points = np.concatenate([curve.points[:1], arc, curve.points[2:]])
    return Curve(points, np.concatenate([curve.bulges[:1], np.zeros(count), curve.bulges[2:]]))


def _cavity(random: np.random.Generator, x: float, y: float, room: float, straight: bool) -> Curve:
    size = random.uniform(0.3, 1) * room
    if random.random() < 0.5 and not straight:
        return Curve(np.array([[x + size, y], [x - size, y]]), np.ones(2))
    corners = [[x - size, y - size], [x + size, y - size], [x + size, y], [x, y + size]]
    return Curve(np.array(corners), np.zeros(4))


WRITERS: dict[str, Callable[[np.random.Generator, Sketch, Path], Drawn]] = {
    "dxf": drawing_files.dxf,
    "svg": drawing_files.svg,
    "step": drawing_files.step,
    "msh": drawing_files.msh,
}


def outcome(drawn: Drawn, expected: Sketch) -> tuple[str, str]:
    """`read`, `read as proposed`, `refused` or `wrong`, and the refusal or what is wrong."""
    settings, said = dict(drawn.settings), ""
    for _ in range(4):
        try:
            drawing = read_drawing(drawn.path, **settings)
            found = body(drawing.loops)
        except UserError as error:
            said = str(error)
            remedy = re.search(r'(units|tolerance) = "?([a-z]+|[0-9.e-]+)', said)
            if "\n" in said or (remedy and remedy[1] in settings):
                return "wrong", f"after {settings}: {said}"
            if not remedy:
                return "refused", said
            settings[remedy[1]] = float(remedy[2]) if remedy[1] == "tolerance" else remedy[2]
            continue
        except Exception as error:
            return "wrong", f"{type(error).__name__}: {error}"
        fault = _difference(found.area, drawing.markers, expected, drawn.gap)
        if fault:
            return "wrong", f"{fault}; {drawing.note}"
        return ("read as proposed" if said else "read"), said
    return "wrong", said


def _difference(area: float, markers: np.ndarray, expected: Sketch, gap: float) -> str:
    """What differs, in words; empty if nothing does."""
    perimeter = 2 * float(np.ptp(expected.outline.points, axis=0).sum())
    if abs(area - expected.area) > SAME * expected.area + gap * perimeter:
        return f"area {area:.9g} for {expected.area:.9g} mm2"
    found, right = (
        np.sort(np.linalg.norm(each[:, None] - each, axis=2).ravel()) for each in (markers, expected.markers)
    )
    if found.shape != right.shape:
        return f"{len(markers)} markers for {len(expected.markers)}"
    if np.abs(found - right).max(initial=0) > SAME * 100:
        return "markers elsewhere"
    return ""


def tried(count: int, seed: int = 0) -> tuple[Counter[tuple[str, str]], list[str]]:
    """Numbers of drawings by format and outcome, and the wrong ones in words."""
    counts, wrong = Counter[tuple[str, str]](), list[str]()
    with tempfile.TemporaryDirectory() as folder:
        for number in range(count):
            random = np.random.default_rng([seed, number])
            suffix = list(WRITERS)[number % len(WRITERS)]
            one = sketch(random, {"msh": 1, "step": 2}.get(suffix, 3))
            drawn = WRITERS[suffix](random, one, Path(folder) / f"{number}.{suffix}")
            expected = one if suffix != "msh" else one._replace(markers=np.empty((0, 2)))
            state, said = outcome(drawn, expected)
            counts[suffix, state] += 1
            if state == "wrong" or (state == "refused"):
                wrong += [f"{suffix} {number} ({drawn.kind}): {said}"] * (state == "wrong")
                print(f"{suffix} {number} ({drawn.kind}) {state}: {said}", flush=True)
    return counts, wrong


if __name__ == "__main__":
    found, _ = tried(int(sys.argv[1]), *map(int, sys.argv[2:]))
    for (suffix, state), number in sorted(found.items()):
        print(suffix, state, number)
