"""Range of a marker's colour from a click into it."""

from collections.abc import Sequence

import cv2
import numpy as np

from pinnray.runtime.arrays import BoolArray, FloatArray
from pinnray.runtime.errors import UserError
from pinnray.vision.discs.colour import HIGHEST, LOWEST, ColourRange
from pinnray.vision.frames.frame import Image

ALIKE = 12.0
"""Largest difference in L*, a* and b* between a click and other pixels of the same marker."""
LEAST_WIDTH, USUAL_WIDTH = 6.0, 25.0
"""Width of the range to either side: at least for noise; with no similar surroundings, for other light."""
FEWEST = 9
"""Smallest number of pixels of an example."""
NEAR, FAR = 3.0, 9.0
"""Smallest and largest distance of the surroundings from an example, pixels."""
NOTABLE = 0.1
"""Share of the surroundings that must have another colour for the range to exclude it."""


def pick_colour(image: Image, place: Sequence[float]) -> ColourRange:
    """Range of the colours of the marker at a place.

    It reaches half way to the colours around the marker, and at most 25 in L*, a* or b*.

    Args:
        image: Shape (h, w), for L* alone, or (h, w, 3).
        place: x, y of a point in the marker, pixels.

    Raises:
        UserError: If the place is not in the image, or there is no patch of one colour.
    """
    lab = _lab(np.asarray(cv2.medianBlur(image, 3), dtype=np.uint8))
    example = _example(lab, place)
    values = lab[example]
    middle = np.median(values, axis=0)
    spread = 1.4826 * np.median(np.abs(values - middle), axis=0)
    away = cv2.distanceTransform(np.where(example, 0, 255).astype(np.uint8), cv2.DIST_L2, 5)
    around = lab[(away > NEAR) & (away <= FAR)]
    least = np.maximum(3 * spread, LEAST_WIDTH)
    low, high = middle - _width(middle - around, least), middle + _width(around - middle, least)
    channels = 1 if image.ndim == 2 else 3
    low = np.maximum(np.append(low[:channels], LOWEST[channels:]), LOWEST)
    high = np.minimum(np.append(high[:channels], HIGHEST[channels:]), HIGHEST)
    return ColourRange(_rounded(low), _rounded(high))


def _lab(image: Image) -> FloatArray:
    coloured = cv2.cvtColor(image, cv2.COLOR_GRAY2BGR) if image.ndim == 2 else image
    return np.asarray((cv2.cvtColor(coloured, cv2.COLOR_BGR2LAB) - (0.0, 128.0, 128.0)) / (2.55, 1, 1))


def _example(lab: FloatArray, place: Sequence[float]) -> BoolArray:
    """Mask of similar pixels that are connected to the place, shape (h, w)."""
    height, width = lab.shape[:2]
    where = ",".join(f"{value:g}" for value in place)
    if len(place) != 2 or not np.isfinite(place).all():
        raise UserError(f"a place is x,y in pixels, not {where}")
    x, y = np.rint(place).astype(int).tolist()
    if not (0 <= x < width and 0 <= y < height):
        raise UserError(f"{where} is not within the image of {width}x{height} pixels")
    chosen = np.s_[max(y - 1, 0) : y + 2, max(x - 1, 0) : x + 2]
    alike = (np.abs(lab - np.median(lab[chosen], axis=(0, 1))) <= ALIKE).all(axis=2)
    _, patches = cv2.connectedComponents(alike.astype(np.uint8), connectivity=4)
    example = alike & np.isin(patches, patches[chosen])
    if example.sum() < FEWEST:
        raise UserError(
            f"at {where} there are {example.sum()} pixels of one colour; "
            f"choose the middle of a marker, with at least {FEWEST}"
        )
    return np.asarray(example)


def _width(beyond: FloatArray, least: FloatArray) -> FloatArray:
    """Width of the range, shape (3,), to a side with the surroundings `beyond`; `least` is the noise."""
    widths = np.full(3, USUAL_WIDTH)
    for channel in range(3):
        other = beyond[beyond[:, channel] > least[channel], channel]
        if len(other) > NOTABLE * len(beyond):
            widths[channel] = min(USUAL_WIDTH, np.quantile(other, NOTABLE) / 2)
    return np.asarray(np.maximum(widths, least))


def _rounded(values: FloatArray) -> tuple[float, float, float]:
    lightness, a, b = np.round(values, 1).tolist()
    return lightness, a, b
