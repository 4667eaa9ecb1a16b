"""Colour maps and the limits of shared colour scales."""

from collections.abc import Sequence
from functools import cache
from typing import NamedTuple

import matplotlib as mpl
import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Colormap, ListedColormap, LogNorm, Normalize
from numpy.typing import NDArray

from compare.evaluation.differences import weighted_percentile
from geometry.arrays import FloatArray

PERCENT = 99.5
"""Share of the area within a colour scale; peaks at re-entrant corners would leave the rest in one colour."""


class Scale(NamedTuple):
    """A colour scale that several pictures share."""

    low: float  # value of the first colour
    high: float  # value of the last one
    colours: Colormap
    log: bool = False  # whether the colours follow the logarithm of the value, which must be positive

    @property
    def mappable(self) -> ScalarMappable:
        """For a colour bar."""
        norm = LogNorm if self.log else Normalize
        return ScalarMappable(norm(self.low, self.high), self.colours)

    def paint(self, values: FloatArray) -> NDArray[np.uint8]:
        """Colours of values of shape (t,): red, green and blue, shape (t, 3)."""
        rgba = self.mappable.to_rgba(values, bytes=True)
        return np.asarray(rgba, dtype=np.uint8)[:, :3]


def sequential(values: FloatArray, weights: FloatArray) -> Scale:
    """A scale from zero to the percentile of values, shape (t,), under area weights, shape (t,)."""
    return Scale(0.0, _positive(weighted_percentile(values, weights, PERCENT)), mpl.colormaps["viridis"])


def symmetric(fields: Sequence[FloatArray], weights: FloatArray) -> Scale:
    """A scale symmetric about zero that covers the percentile of the absolute value in each of the fields."""
    limit = max((weighted_percentile(np.abs(values), weights, PERCENT) for values in fields), default=0.0)
    return Scale(-_positive(limit), _positive(limit), diverging())


@cache
def diverging() -> Colormap:
    """Blue, light grey, red along straight lines in OKLab: perceptually uniform on either side of zero.

    Source: B. Ottosson, "A perceptual color space for image processing" (2020): the matrices from OKLab to
    linear sRGB.
    """
    steps = np.linspace(0, 1, 128)[:, None]
    blue, grey, red = np.array([(0.42, -0.035, -0.145), (0.955, 0.0, 0.0), (0.45, 0.165, 0.075)])
    lab = np.concatenate([blue + (grey - blue) * steps, grey + (red - grey) * steps])
    lms = lab @ np.array(
        [
            [1, 1, 1],
            [0.3963377774, -0.1055613458, -0.0894841775],
            [0.2158037573, -0.0638541728, -1.2914855480],
        ]
    )
    linear = lms**3 @ np.array(
        [
            [4.0767416621, -1.2684380046, -0.0041960863],
            [-3.3077115913, 2.6097574011, -0.7034186147],
            [0.2309699292, -0.3413193965, 1.7076147010],
        ]
    )
    linear = np.clip(linear, 0, 1)
    rgb = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
    return ListedColormap(np.clip(rgb, 0, 1), name="difference")


def _positive(limit: float) -> float:
    """The limit, or the smallest scale that can be drawn where a field is zero."""
    return limit if limit > 0 else 1e-12
