"""Circles that may be markers, by the paper's pipeline.

Median blur of size 3, colour detection in CIELAB, Gaussian blur, Hough circles (Wang et al., PINN-Ray, on the
experiment). Of OpenCV's two kinds of Hough circles it is the older one: it found all discs from 4 pixels of
radius on, of which `HOUGH_GRADIENT_ALT` missed a seventh. It also finds corners and gaps; they are dropped
because they are not filled with the colour, or not surrounded by another.
"""

from math import ceil

import cv2
import numpy as np

from pinnray.runtime.arrays import BoolArray, FloatArray
from pinnray.vision.discs.colour import DARK, Colour
from pinnray.vision.frames.frame import Image

PixelBox = tuple[int, int, int, int]
"""x0, y0, x1, y1, pixels; x1 and y1 are outside."""

VOTES = (5.0, 8.0)
"""Limits of the gradients that must point at a centre: twice the least radius, a third of the edge."""
EDGE = 100.0
"""Canny's higher threshold; the blurred mask's edges have 160 or more whatever the light."""
LARGEST = 25.0
"""Largest radius of a marker in the picture of a colour, pixels."""
LEAST_FILL = 0.4
"""Share of the colour within a circle minus that around it: 1 for a whole marker, about 0 for a corner."""


def propose_circles(
    image: Image, colour: Colour = DARK, *, radii: tuple[float, float], window: PixelBox | None = None
) -> FloatArray:
    """Find circles that may be markers.

    Args:
        image: Shape (h, w) or (h, w, 3).
        colour: Of the markers.
        radii: Least and largest radius, above 0, pixels.
        window: Part of the image to search, clipped to the image; all of it if not given.

    Returns:
        x, y and radius of every circle, the most disc-like first, shape (n, 3), pixels. The centres lie
        halfway between pixels, the resolution of OpenCV's accumulator.
    """
    least, largest = radii
    height, width = image.shape[:2]
    x0, y0, x1, y1 = window or (0, 0, width, height)
    x0, y0 = max(x0, 0), max(y0, 0)
    view = image[y0 : max(y1, 0), x0 : max(x1, 0)]
    if min(view.shape[:2]) < 3:
        return np.empty((0, 3))
    mask = colour.mask(np.asarray(cv2.medianBlur(view, 3), dtype=np.uint8), largest)
    circles = cv2.HoughCircles(
        cv2.GaussianBlur(mask, (0, 0), float(np.clip(0.25 * least, 1.2, 3.0))),
        cv2.HOUGH_GRADIENT,
        dp=1,
        minDist=max(least, 3.0),
        param1=EDGE,
        param2=float(np.clip(2 * least, *VOTES)),
        minRadius=int(least),
        maxRadius=ceil(largest),
    )
    if circles is None:
        return np.empty((0, 3))
    found = np.asarray(circles, dtype=np.float64).reshape(-1, circles.shape[-1])[:, :3]
    fill = _fill(mask, found)
    order = np.argsort(-fill, kind="stable")
    order = order[fill[order] >= LEAST_FILL]
    return found[order][_first_of_overlapping(found[order])] + (x0, y0, 0)


def highlight_colour(image: Image, colour: Colour) -> tuple[Image, float]:
    """Draw a picture to check a colour by eye.

    Args:
        image: Shape (h, w) or (h, w, 3).
        colour: Drawn in magenta; the rest is pale.

    Returns:
        The picture, shape (h, w, 3), and the share of its pixels that have the colour.
    """
    mask = colour.mask(np.asarray(cv2.medianBlur(image, 3), dtype=np.uint8), LARGEST)
    coloured = cv2.cvtColor(image, cv2.COLOR_GRAY2BGR) if image.ndim == 2 else image
    picture = cv2.addWeighted(coloured, 0.5, np.full_like(coloured, 255), 0.5, 0)
    picture[mask > 0] = (200, 0, 200)
    return np.asarray(picture, dtype=np.uint8), float(mask.mean()) / 255


def _fill(mask: Image, circles: FloatArray) -> FloatArray:
    """Share of the colour within each circle minus that around it, shape (n,)."""
    shares = []
    for x, y, radius in circles:
        reach = ceil(1.5 * radius) + 1
        left, top = max(int(x) - reach, 0), max(int(y) - reach, 0)
        part = mask[top : int(y) + reach + 1, left : int(x) + reach + 1]
        rows, columns = np.ogrid[: part.shape[0], : part.shape[1]]
        distance = np.hypot(columns + left - x, rows + top - y) / radius
        shares.append([part[distance < 0.8].mean(), part[(distance > 1.25) & (distance < 1.5)].mean()])
    inside, around = np.array(shares).T / 255
    return np.asarray(inside - around)


def _first_of_overlapping(circles: FloatArray) -> BoolArray:
    """Mask of circles whose centre is not within an earlier one that is kept."""
    kept = np.zeros(len(circles), dtype=bool)
    for number, (x, y, radius) in enumerate(circles):
        others = circles[kept]
        apart = np.hypot(others[:, 0] - x, others[:, 1] - y) > np.maximum(others[:, 2], radius)
        kept[number] = apart.all()
    return kept
