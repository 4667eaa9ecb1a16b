"""Pictures of discs, exact but for the quadrature: light, then blur, then the mean over every pixel.

A blurred disc is a sum over its chords: along a chord the Gaussian integrates to a difference of normal
distributions, across the chords the trapezoidal rule in the angle converges beyond double precision. The mean
over a pixel is by Gauss and Legendre's rule. Units: pixels, grey levels.
"""

from dataclasses import dataclass

import numpy as np
from scipy.special import ndtr

from pinnray.runtime.arrays import FloatArray
from pinnray.vision.frames.frame import GreyImage

CHORDS = 16
"""A pixel of radius."""

NODES, WEIGHTS = np.polynomial.legendre.leggauss(4)


@dataclass(frozen=True)
class Edge:
    """A half-plane `normal` · p > `offset` of reflectance `level`; in front of the disc or behind all.

    One behind all may bend along its normal: `curvature`, 1/pixel, about the point nearest to (20, 20).
    """

    angle: float
    offset: float
    level: float
    occludes: bool = False
    curvature: float = 0.0

    @property
    def normal(self) -> tuple[float, float]:
        """Out of the disc's side, into the half-plane."""
        return float(np.cos(self.angle)), float(np.sin(self.angle))


@dataclass(frozen=True)
class DiscImage:
    """A dark disc, possibly elliptic, on a light ground.

    Attributes:
        centre: x, y; the centre of the first pixel is (0, 0).
        radius: The square root of the product of the semi-axes.
        stretch: Ratio of the semi-axes.
        turn: Angle of the longer one, rad.
        light, dark: Grey levels around and in the disc.
        blur: Standard deviation of the optics' blur; the pixels' own width comes on top.
        gradient: Relative change of the light per pixel along x and y, about the centre.
        edges: What else is in the picture; edges behind the disc must not overlap one another.
        size: Width and height.
    """

    centre: tuple[float, float] = (20.0, 20.0)
    radius: float = 8.0
    stretch: float = 1.0
    turn: float = 0.0
    light: float = 180.0
    dark: float = 60.0
    blur: float = 0.8
    gradient: tuple[float, float] = (0.0, 0.0)
    edges: tuple[Edge, ...] = ()
    size: tuple[int, int] = (41, 41)

    def exact(self) -> FloatArray:
        """Expected grey levels without noise, shape (height, width)."""
        x, y = (
            (np.arange(count)[:, None] + NODES / 2).ravel() for count in self.size
        )  # four points across every pixel
        scene = np.zeros((3, len(y), len(x)))  # blurred reflectance and its derivatives along x and y
        scene[0] += self.light
        hidden = [edge for edge in self.edges if edge.occludes]
        scene += (self.dark - self.light) * self._disc(x, y, hidden)
        for edge in self.edges:
            scene += (edge.level - self.light) * self._half_plane(edge, x, y)
        gx, gy = self.gradient
        shade = 1 + gx * (x - self.centre[0]) + gy * (y - self.centre[1])[:, None]
        seen = shade * scene[0] + self.blur**2 * (
            gx * scene[1] + gy * scene[2]
        )  # the light is blurred as well
        width, height = self.size
        across = seen.reshape(-1, width, 4) @ (WEIGHTS / 2)
        return np.asarray((WEIGHTS / 2) @ across.reshape(height, 4, width))

    def noisy(self, noise: float, rng: np.random.Generator) -> GreyImage:
        """The picture with normal noise of that standard deviation, in eight bits."""
        exact = self.exact()
        return np.clip(np.rint(exact + rng.normal(0, noise, exact.shape)), 0, 255).astype(np.uint8)

    def _disc(self, x: FloatArray, y: FloatArray, hidden: list[Edge]) -> FloatArray:
        count = int(np.ceil(CHORDS * self.radius))
        angle = (np.arange(count) + 0.5) * np.pi / count - np.pi / 2
        long, short = self.radius * self.stretch**0.5, self.radius * self.stretch**-0.5
        cosine, sine = np.cos(self.turn), np.sin(self.turn)
        across = np.hypot(long * sine, short * cosine)  # half of the height
        chord_y = self.centre[1] + across * np.sin(angle)
        middle = (long**2 - short**2) * sine * cosine / across * np.sin(angle)
        half = long * short / across * np.cos(angle)
        left, right = self.centre[0] + middle - half, self.centre[0] + middle + half
        for edge in hidden:
            normal = edge.normal
            bound = (edge.offset - normal[1] * chord_y) / normal[0]
            left, right = (
                (left, np.minimum(right, bound)) if normal[0] > 0 else (np.maximum(left, bound), right)
            )
        right = np.maximum(left, right)
        weights = across * np.cos(angle) * np.pi / count
        down = (y[:, None] - chord_y) / self.blur
        ends = [(x - end[:, None]) / self.blur for end in (left, right)]
        rows = _bell(down) / self.blur * weights
        inside = ndtr(ends[0]) - ndtr(ends[1])
        slopes = (_bell(ends[0]) - _bell(ends[1])) / self.blur
        return np.stack([rows @ inside, rows @ slopes, (-down / self.blur * rows) @ inside])

    def _half_plane(self, edge: Edge, x: FloatArray, y: FloatArray) -> FloatArray:
        nx, ny = edge.normal
        along = nx * (y[:, None] - 20) - ny * (x - 20)
        bend = edge.curvature * (along**2 + self.blur**2) / 2  # to the first order, as the lens blurs it
        distance = (nx * x + ny * y[:, None] - edge.offset - bend) / self.blur
        slope, turn = _bell(distance) / self.blur, edge.curvature * along
        return np.stack([ndtr(distance), (nx + ny * turn) * slope, (ny - nx * turn) * slope])


def _bell(x: FloatArray) -> FloatArray:
    return np.asarray(np.exp(-(x**2) / 2) / np.sqrt(2 * np.pi))
