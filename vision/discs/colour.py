"""Colours of markers: a box in CIELAB, or darker than the surroundings.

CIELAB (L* 0 to 100, a* and b* about -128 to 127) is OpenCV's, from sRGB with the white point D65, rounded
to 8 bits: steps of 0.4 in L*, of 1 in a* and b*. A grey image has L* alone.
"""

import re
from dataclasses import dataclass
from functools import cache

import cv2
import numpy as np

from pinnray.runtime.arrays import FloatArray
from pinnray.runtime.errors import UserError
from pinnray.vision.frames.frame import Image

Lab = tuple[float, float, float]

LOWEST: Lab = (0.0, -128.0, -128.0)
HIGHEST: Lab = (100.0, 127.0, 127.0)
HALF = 0.45
"""Threshold over the greatest darkness nearby: about at a blurred edge, and darker than a grey wall."""
CONTRAST = 15.0
"""Least difference in L* of a dark disc from its surroundings."""


@dataclass(frozen=True)
class ColourRange:
    """Colours between two limits, each L*, a*, b*.

    Raises:
        UserError: If a limit is not finite or the lower one is above the higher one.
    """

    low: Lab = LOWEST
    high: Lab = HIGHEST

    def __post_init__(self) -> None:
        for name, low, high in zip(("L*", "a*", "b*"), self.low, self.high, strict=True):
            if not low <= high or not np.isfinite([low, high]).all():
                raise UserError(f"a range of {name} from {low:g} to {high:g}; it must go from low to high")

    def __str__(self) -> str:
        return ":".join(f"{low:g},{high:g}" for low, high in zip(self.low, self.high, strict=True))

    def mask(self, image: Image, radius: float = np.inf) -> Image:
        """255 where a colour lies in the range, 0 elsewhere, shape (h, w); `radius` does not matter."""
        low, high = _in_8_bits(self.low), _in_8_bits(self.high)
        if image.ndim == 2:
            inside = (_lightness_of_grey() >= low[0]) & (_lightness_of_grey() <= high[0])
            return np.asarray(cv2.LUT(image, np.where(inside, 255, 0).astype(np.uint8)), dtype=np.uint8)
        return np.asarray(cv2.inRange(cv2.cvtColor(image, cv2.COLOR_BGR2LAB), low, high), dtype=np.uint8)


@dataclass(frozen=True)
class Darker:
    """Darker than the surroundings, and about half as dark as the darkest pixel nearby.

    A morphological closing estimates the brightness of the surroundings, so the light may be uneven: the
    black-hat transform (F. Meyer, "Iterative image transformations for an automatic screening of cervical
    smears", J. Histochem. Cytochem. 27, 1979).
    """

    def __str__(self) -> str:
        return "dark"

    def mask(self, image: Image, radius: float = 25.0) -> Image:
        """255 where a dark disc of at most `radius` pixels may be, 0 elsewhere, shape (h, w)."""
        lightness = lightness_of(image)
        side = 2 * int(np.ceil(1.5 * radius)) + 1
        box = cv2.getStructuringElement(cv2.MORPH_RECT, (side, side))
        darker = cv2.morphologyEx(lightness, cv2.MORPH_BLACKHAT, box)
        half = cv2.convertScaleAbs(cv2.dilate(darker, box), alpha=HALF)
        threshold = cv2.max(half, np.rint(2.55 * CONTRAST))
        return np.asarray(cv2.compare(darker, threshold, cv2.CMP_GT), dtype=np.uint8)


DARK = Darker()
Colour = ColourRange | Darker
"""Classifier of the pixels that may belong to a marker."""


def read_colour(text: str) -> Colour:
    """The colour of a text: "dark", or L*, a* and b* such as "20,60:40,80:-10,30".

    Of the ranges, a* and b* may be left out. `str` of a colour gives its text.

    Raises:
        UserError: If it is none of these.
    """
    number = r"[-+]?\d+(?:\.\d*)?"
    if text.strip().lower() == "dark":
        return DARK
    if re.fullmatch(rf"{number},{number}(:{number},{number}){{0,2}}", text.strip()):
        pairs = [tuple(map(float, pair.split(","))) for pair in text.strip().split(":")]
        pairs += list(zip(LOWEST, HIGHEST, strict=True))[len(pairs) :]
        (dark, light), (low_a, high_a), (low_b, high_b) = pairs
        return ColourRange((dark, low_a, low_b), (light, high_a, high_b))
    raise UserError(
        f"cannot read the colour {text!r}; give dark, or ranges of L*, a* and b* such as 20,60:40,80:-10,30"
    )


def lightness_of(image: Image) -> Image:
    """L* of a grey or coloured image in 8 bits: 255 is L* 100."""
    if image.ndim == 2:
        return np.asarray(cv2.LUT(image, _lightness_of_grey()), dtype=np.uint8)
    return np.asarray(cv2.extractChannel(cv2.cvtColor(image, cv2.COLOR_BGR2LAB), 0), dtype=np.uint8)


@cache
def _lightness_of_grey() -> Image:
    levels = np.repeat(np.arange(256, dtype=np.uint8)[None, :, None], 3, axis=2)
    return np.asarray(cv2.cvtColor(levels, cv2.COLOR_BGR2LAB)[0, :, 0], dtype=np.uint8)


def _in_8_bits(colour: Lab) -> FloatArray:
    """OpenCV's encoding, rounded, shape (3,)."""
    return np.asarray(np.rint(np.array(colour) * (2.55, 1, 1) + (0, 128, 128)))
