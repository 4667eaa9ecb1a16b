"""Pictures of printed dots by the virtual rig: irregular outlines, specks, lens and camera."""

from dataclasses import dataclass, field
from functools import cached_property
from math import ceil

import numpy as np

from pinnray.runtime.arrays import FloatArray
from pinnray.vision.calibration.camera import Camera, Pose
from pinnray.vision.frames.frame import GreyImage
from pinnray.vision.rig.exposure import Exposure
from pinnray.vision.rig.render import render
from pinnray.vision.rig.shapes import Scene, Shape, blot, circle, closed

PAPER, INK = 0.75, 0.2
"""Reflectances."""
SPECK = 0.1
"""Radius of a speck over that of the dot."""


@dataclass(frozen=True)
class PrintedDots:
    """Dots in rows of `across`, each on a tile of its own, at random places within a pixel.

    Attributes:
        radius: Of discs of the same area, pixels.
        irregular: Root mean square deviation of the outline, over the radius.
        mottle: Share of the area that specks cover.
        count: Number of dots.
        exposure: Light, lens and camera.
        seed: Of places, outlines and noise.
    """

    radius: float
    irregular: float = 0.0
    mottle: float = 0.0
    count: int = 24
    exposure: Exposure = field(default_factory=lambda: Exposure(noise=1.0, gradient=0.0, monochrome=True))
    seed: int = 0
    across: int = 12

    @cached_property
    def centres(self) -> FloatArray:
        """Centroids of the outlines, shape (n, 2), pixels."""
        row, column = np.divmod(np.arange(self.count), self.across)
        shifts = np.random.default_rng(self.seed).uniform(-0.5, 0.5, (self.count, 2))
        return self.side * (np.column_stack([column, row]) + 0.5) + shifts

    @property
    def side(self) -> int:
        """Of a tile, pixels."""
        return 2 * ceil(self.radius + 10)

    def picture(self) -> GreyImage:
        """The dots, as a grey image."""
        shapes: list[Shape] = []
        for number, centre in enumerate(self.centres):
            rng = np.random.default_rng((self.seed, number))
            shapes.append(Shape(closed(blot(centre, self.radius, self.irregular, rng)), (INK,) * 3, 1.0))
            for _ in range(round(self.mottle / SPECK**2)):
                away, angle = self.radius * 0.8 * rng.uniform() ** 0.5, rng.uniform(0, 2 * np.pi)
                place = centre + away * np.array([np.cos(angle), np.sin(angle)])
                speck = circle(place, SPECK * self.radius)[::32]
                shapes.append(Shape(closed(speck), ((PAPER + INK) / 2,) * 3, 1.0))
        rows = -(-self.count // self.across)
        flat = Camera(self.across * self.side, rows * self.side, 1.0, 1.0, 0.0, 0.0)  # a mm is a pixel
        pose = Pose(np.zeros(3), np.zeros(3))
        return render(Scene((PAPER,) * 3, shapes), flat, pose, self.exposure, seed=self.seed)


def darkness_centroids(grey: GreyImage, dots: PrintedDots) -> FloatArray:
    """Plain centroids of the darkness around the dots, from their true places on, shape (n, 2), pixels."""
    half = dots.side // 2 - 1
    y, x = np.mgrid[-half : half + 1, -half : half + 1]
    found = []
    for column, row in np.rint(dots.centres).astype(int):
        tile = grey[row - half : row + half + 1, column - half : column + half + 1].astype(float)
        darkness = np.median(tile[np.hypot(x, y) > 1.25 * dots.radius + 2]) - tile
        at = np.zeros(2)
        for _ in range(3):
            near = darkness * (np.hypot(x - at[0], y - at[1]) < 1.2 * dots.radius + 2)
            at = np.array([(near * x).sum(), (near * y).sum()]) / near.sum()
        found.append(np.add(at, (column, row)))
    return np.array(found)
