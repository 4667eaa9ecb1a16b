"""Detection of discs in an image: circles of the paper's pipeline, refined by a fit of the edge or not."""

from collections.abc import Callable
from typing import Literal, NamedTuple

import cv2
import numpy as np

from pinnray.runtime.arrays import BoolArray, FloatArray, IntArray
from pinnray.vision.discs.circle_proposals import PixelBox, propose_circles
from pinnray.vision.discs.colour import Colour
from pinnray.vision.discs.disc_fit import fit_discs
from pinnray.vision.frames.frame import GreyImage, Image

DetectionMethod = Literal["precise", "hough"]
METHODS: tuple[DetectionMethod, ...] = ("precise", "hough")

FLOOR = {"precise": 0.0005, "hough": 0.45}
"""Standard deviation of a coordinate's error that a mean over frames does not reduce, pixels. Fits: as on the
virtual rig for discs that stay ellipses; beside the indenter it is more, which the frames' scatter shows.
Hough circles sit on a lattice."""

REACH = 0.8
"""Largest distance of a circle from its guess, in radii."""


class DiscDetections(NamedTuple):
    """Discs.

    Attributes:
        centres: Shape (n, 2), pixels.
        covariances: Of the centres, shape (n, 2, 2), pixels².
        radii: Shape (n,), pixels.
        contrasts: How much darker than their surroundings, shape (n,), grey levels; nan for circles.
    """

    centres: FloatArray
    covariances: FloatArray
    radii: FloatArray
    contrasts: FloatArray

    def where(self, kept: BoolArray | IntArray | slice) -> "DiscDetections":
        """Subset selected by a mask, numbers or a slice."""
        return DiscDetections(*(part[kept] for part in self))

    def numbered(self, discs: IntArray) -> "DiscDetections":
        """The discs with the numbers `discs`; nan for the number -1."""
        padded = (np.concatenate([part, np.full((1, *part.shape[1:]), np.nan)]) for part in self)
        return DiscDetections(*(part[discs] for part in padded))  # -1 is the added nan

    def together(self, others: "DiscDetections") -> "DiscDetections":
        """Union with other detections; the others' copies of these discs are left out."""
        away = np.linalg.norm(others.centres[:, None] - self.centres, axis=2)
        new = others.where((away > others.radii[:, None]).all(axis=1))
        return DiscDetections(*(np.concatenate(parts) for parts in zip(self, new, strict=True)))


def detect_discs(
    image: Image,
    colour: Colour,
    limits: tuple[float, float],
    method: DetectionMethod,
    window: PixelBox | None = None,
    radii: Callable[[FloatArray], FloatArray] | None = None,
) -> DiscDetections:
    """Detect all discs of a colour whose radii, pixels, lie between two limits.

    With `radii`, a function from points of the image, shape (n, 2), to the known radii of discs there, shape
    (n,), partly hidden discs are detected too.
    """
    circles = propose_circles(image, colour, radii=limits, window=window)
    if method == "hough":
        return _circles(circles)
    return _fitted(image, circles, radii(circles[:, :2]) if radii else None)


def detect_discs_near(
    image: Image, colour: Colour, guesses: FloatArray, radii: FloatArray, method: DetectionMethod
) -> DiscDetections:
    """Detect discs with known radii, shape (n,), near guesses, shape (n, 2), pixels; there may be fewer."""
    if not len(guesses):
        return _circles(np.empty((0, 3)))
    if method == "precise":
        return _fitted(image, np.column_stack([guesses, radii]), radii)
    low = np.floor(guesses.min(axis=0) - 2.5 * radii.max()).astype(int)
    high = np.ceil(guesses.max(axis=0) + 2.5 * radii.max()).astype(int) + 1
    limits = (0.75 * radii.min(), 1.35 * radii.max())
    found = propose_circles(image, colour, radii=limits, window=(low[0], low[1], high[0], high[1]))
    away = np.linalg.norm(found[:, None, :2] - guesses, axis=2) / radii
    return _circles(found[(away < REACH).any(axis=1)])


def luma_of(image: Image) -> GreyImage:
    """Luma, because chroma has fewer pixels in most videos."""
    return image if image.ndim == 2 else np.asarray(cv2.cvtColor(image, cv2.COLOR_BGR2GRAY), dtype=np.uint8)


def _fitted(image: Image, circles: FloatArray, radii: FloatArray | None) -> DiscDetections:
    """Fit discs at circles, shape (n, 3), and drop duplicates."""
    discs = fit_discs(luma_of(image), circles, radii=radii)
    kept = discs.found.copy()
    apart = np.linalg.norm(discs.centres[:, None] - discs.centres, axis=2)
    for number in np.nonzero(kept)[0]:
        kept[number + 1 :] &= ~(apart[number, number + 1 :] < circles[number, 2])
    return DiscDetections(discs.centres, discs.covariances, discs.radii, discs.contrast).where(kept)


def _circles(circles: FloatArray) -> DiscDetections:
    """Detections from circles, with a fixed covariance: one frame does not show their error."""
    covariances = np.repeat(FLOOR["hough"] ** 2 * np.eye(2)[None], len(circles), axis=0)
    return DiscDetections(circles[:, :2], covariances, circles[:, 2], np.full(len(circles), np.nan))
