"""The plane without fiducials: the scale, turn and shift that put the design's markers on discs in the image.

Two discs that are taken for two markers suggest a similarity; the one under which most markers meet a disc of
their size is taken. A row of markers looks the same from both ends, and then the one is taken in which x
runs to the right in the image; how the finger moves then tells. Units: pixels, mm.
"""

from itertools import combinations

import numpy as np

from geometry.arrays import FloatArray, IntArray
from geometry.errors import UserError

GATE = 0.15
"""How far from its marker a disc may be, over the least distance of two markers."""
SAME_SIZE = 1.4
"""Ratio of the radii of a disc and of a marker."""
BETTER = 1.5
"""Markers, above those that a similarity in which x runs to the right explains."""


def match_layout(pixels: FloatArray, radii: FloatArray, markers: FloatArray, diameter: float) -> IntArray:
    """The number of its disc for every marker, shape (m,); -1 where none was found.

    Args:
        pixels: Centres of discs, shape (n, 2).
        radii: Of the discs, shape (n,).
        markers: Where the design has them, shape (m, 2), mm.
        diameter: Of a marker, mm.

    Raises:
        UserError: If fewer than three, or less than half of the markers, are seen.
    """
    discs, places = pixels @ (1, -1j), markers @ (1, 1j)
    apart = np.abs(places[:, None] - places)[~np.eye(len(places), dtype=bool)].min(initial=np.inf)
    first, second = np.nonzero(~np.eye(len(discs), dtype=bool))
    best, most = np.full(len(places), -1), -np.inf
    for one, other in combinations(range(len(places)), 2):
        factor = (discs[second] - discs[first]) / (places[other] - places[one])
        size = radii / (np.abs(factor)[:, None] * diameter / 2)
        fits = (size < SAME_SIZE) & (size > 1 / SAME_SIZE)
        likely = fits[np.arange(len(first)), first] & fits[np.arange(len(first)), second]
        factor, fits = factor[likely], fits[likely]
        mapped = factor[:, None] * (places - places[one]) + discs[first[likely], None]
        away = np.abs(mapped[:, :, None] - discs) / (np.abs(factor)[:, None, None] * apart)
        away = np.where(fits[:, None], away, np.inf)
        missed = away.min(axis=2, initial=np.inf)
        score = ((missed < GATE) * (1 - missed / GATE * 0.5)).sum(axis=1) + BETTER * (factor.real > 0)
        if len(score) and score.max() > most:
            most, chosen = score.max(), int(score.argmax())
            best = np.where(missed[chosen] < GATE, away[chosen].argmin(axis=1), -1)
    if (best >= 0).sum() < max(3, len(places) / 2):
        raise UserError(
            f"neither the fiducials nor the markers can be made out among {len(pixels)} discs; show them, "
            "and give the design, the workspace and the markers' colour"
        )
    return best


def has_half_turn_symmetry(markers: FloatArray) -> bool:
    """Whether the markers, shape (m, 2), look the same from both ends."""
    middle = markers.mean(axis=0)
    return bool(np.allclose(2 * middle - markers[::-1], markers))
