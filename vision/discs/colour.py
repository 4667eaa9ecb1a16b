"""Markers that are darker, or lighter, than their surroundings, by the lightness L* of CIELAB.

Lightness is rounded to 8 bits: 255 is L* 100.
"""

from dataclasses import dataclass
from functools import cache

import cv2
import numpy as np

from pinnray.vision.frames.frame import Image

HALF = 0.45
"""Threshold over the greatest difference nearby: about at a blurred edge, and darker than a grey wall."""
CONTRAST = 15.0
"""Least difference in L* of a disc from its surroundings."""


@dataclass(frozen=True)
class Colour:
    """Darker, or lighter, than the surroundings, by about half as much as the darkest pixel nearby.

    A morphological closing estimates the brightness of the surroundings, so the light may be uneven: the
    black-hat transform (F. Meyer, "Iterative image transformations for an automatic screening of cervical
    smears", J. Histochem. Cytochem. 27, 1979). An opening does for lighter discs.
    """

    light: bool = False

    def mask(self, image: Image, radius: float) -> Image:
        """255 where a disc of at most `radius` pixels may be, 0 elsewhere, shape (h, w)."""
        side = 2 * int(np.ceil(1.5 * radius)) + 1
        box = cv2.getStructuringElement(cv2.MORPH_RECT, (side, side))
        transform = cv2.MORPH_TOPHAT if self.light else cv2.MORPH_BLACKHAT
        apart = cv2.morphologyEx(lightness_of(image), transform, box)
        half = cv2.convertScaleAbs(cv2.dilate(apart, box), alpha=HALF)
        threshold = cv2.max(half, np.rint(2.55 * CONTRAST))
        return np.asarray(cv2.compare(apart, threshold, cv2.CMP_GT), dtype=np.uint8)


DARK, LIGHT = Colour(), Colour(light=True)


def lightness_of(image: Image) -> Image:
    """L* of a grey or coloured image in 8 bits."""
    if image.ndim == 2:
        return np.asarray(cv2.LUT(image, _lightness_of_grey()), dtype=np.uint8)
    return np.asarray(cv2.extractChannel(cv2.cvtColor(image, cv2.COLOR_BGR2LAB), 0), dtype=np.uint8)


@cache
def _lightness_of_grey() -> Image:
    levels = np.repeat(np.arange(256, dtype=np.uint8)[None, :, None], 3, axis=2)
    return np.asarray(cv2.cvtColor(levels, cv2.COLOR_BGR2LAB)[0, :, 0], dtype=np.uint8)
