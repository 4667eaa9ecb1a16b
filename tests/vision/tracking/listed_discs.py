"""Pictures that are lists of discs, and a detector that reads the list: what happens after the detection."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from pinnray.runtime.arrays import FloatArray
from pinnray.vision.calibration.camera import Camera, Pose
from pinnray.vision.discs.colour import Colour
from pinnray.vision.discs.disc_detector import DetectionMethod, DiscDetections
from pinnray.vision.frames.frame import Image

NOISE = 0.05
"""Standard deviation of a coordinate, pixels."""


def seen(points: FloatArray, camera: Camera, pose: Pose, height: float = 0.0) -> FloatArray:
    """Pixels of points of the finger's plane, mm, at a height."""
    return camera.project(np.column_stack([points, np.full(len(points), height)]), pose)


def middles(points: FloatArray, radius: float, camera: Camera, pose: Pose, height: float = 0.0) -> FloatArray:
    """Centroids of the images of circles, by polygons of many corners."""
    angles = np.linspace(0, 2 * np.pi, 400, endpoint=False)
    around = points[:, None] + radius * np.column_stack([np.cos(angles), np.sin(angles)])
    pixels = seen(around.reshape(-1, 2), camera, pose, height)
    x, y = pixels.reshape(len(points), -1, 2).transpose(2, 0, 1)
    turns = x * np.roll(y, -1, axis=1) - y * np.roll(x, -1, axis=1)
    parts = [((of + np.roll(of, -1, axis=1)) * turns).sum(axis=1) for of in (x, y)]
    return np.column_stack(parts) / (3 * turns.sum(axis=1))[:, None]


def discs_at(
    centres: FloatArray,
    *,
    hidden: Sequence[int] = (),
    variance: FloatArray | float = NOISE**2,
    radius: FloatArray | float = 16.0,
    contrast: float = 100.0,
) -> DiscDetections:
    """Discs at centres, shape (n, 2), pixels, but for the hidden ones; `variance` may differ in x and y."""
    numbers = np.arange(len(centres))
    covariances = np.tile(variance * np.eye(2), (len(centres), 1, 1))
    radii, contrasts = (np.broadcast_to(np.asarray(of, float), len(centres)) for of in (radius, contrast))
    every = DiscDetections(centres.copy(), covariances, radii.copy(), contrasts.copy())
    return every.numbered(np.where(np.isin(numbers, hidden), -1, numbers))


class Request(NamedTuple):
    """What was asked of the detector: all discs of a colour and size in a window, or those near guesses."""

    colour: Colour
    limits: tuple[float, float] | None
    window: tuple[int, int, int, int] | None
    guesses: FloatArray
    radii: FloatArray


@dataclass
class ListedDiscs:
    """The detector. A picture is an image whose grey level is its number in the list."""

    size: tuple[int, int] = (1280, 720)
    pictures: list[list[tuple[Colour, DiscDetections]]] = field(default_factory=list)
    requests: list[Request] = field(default_factory=list)

    def picture(self, *discs: tuple[Colour, FloatArray, FloatArray | float, float]) -> Image:
        """An image of discs of some colours: their centres (n, 2), radii and contrast."""
        parts = []
        for colour, centres, radii, contrast in discs:
            found = discs_at(centres, radius=radii, contrast=contrast)
            parts.append((colour, found.where(np.isfinite(centres).all(axis=1))))
        self.pictures.append(parts)
        width, height = self.size
        return np.full((height, width), len(self.pictures) - 1, dtype=np.uint8)

    def all_of(self, image: Image, colour: Colour) -> DiscDetections:
        """The discs of a colour in an image."""
        found = [discs for own, discs in self.pictures[int(image.flat[0])] if own is colour]
        empty = DiscDetections(np.empty((0, 2)), np.empty((0, 2, 2)), np.empty(0), np.empty(0))
        return DiscDetections(*(np.concatenate(part) for part in zip(empty, *found, strict=True)))

    def detect(
        self,
        image: Image,
        colour: Colour,
        limits: tuple[float, float],
        method: DetectionMethod,
        window: tuple[int, int, int, int] | None = None,
        radii: Callable[[FloatArray], FloatArray] | None = None,
    ) -> DiscDetections:
        """In place of `detect_discs`."""
        discs = self.all_of(image, colour)
        x, y = discs.centres.T
        kept = (discs.radii >= limits[0]) & (discs.radii <= limits[1])
        if window is not None:
            kept &= (x >= window[0]) & (x < window[2]) & (y >= window[1]) & (y < window[3])
        found = discs.where(kept)
        known = radii(found.centres) if radii else np.empty(0)
        self.requests.append(Request(colour, limits, window, np.empty((0, 2)), known))
        return found

    def detect_near(
        self, image: Image, colour: Colour, guesses: FloatArray, radii: FloatArray, method: DetectionMethod
    ) -> DiscDetections:
        """In place of `detect_discs_near`: discs of about the radius, less than that away from a guess."""
        self.requests.append(Request(colour, None, None, guesses.copy(), radii.copy()))
        discs = self.all_of(image, colour)
        away = np.linalg.norm(discs.centres[:, None] - guesses, axis=2) / radii
        size = discs.radii[:, None] / radii
        return discs.where(((away < 0.8) & (size < 1.35) & (size > 0.75)).any(axis=1))
