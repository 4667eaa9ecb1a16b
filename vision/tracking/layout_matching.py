"""Identification of the markers in an image without fiducials, by the design's marker layout.

Two discs and two markers define a similarity (scale, rotation, shift); the one that maps most markers to a
disc of their size is taken. For a row of markers, which looks the same from both ends, x runs to the right
in the image until the motion of the finger shows its direction. Units: pixels, mm.
"""

from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from pinnray.runtime.arrays import FloatArray, IntArray
from pinnray.runtime.errors import UserError

ComplexArray = NDArray[np.complex128]

GATE = 0.15
"""Largest distance of a disc from its marker, over the smallest distance of two markers."""
SAME_SIZE = 1.4
"""Largest ratio of the radii of a disc and of a marker."""
BETTER = 1.5
"""Bonus, in markers, of a similarity in which x runs to the right."""


def match_layout(pixels: FloatArray, radii: FloatArray, markers: FloatArray, diameter: float) -> IntArray:
    """Find the number of its disc for every marker, shape (m,); -1 where none was found.

    Args:
        pixels: Centres of discs, shape (n, 2).
        radii: Of the discs, shape (n,).
        markers: Their positions in the design, shape (m, 2), mm.
        diameter: Of a marker, mm.

    Raises:
        UserError: If fewer than three, or less than half of the markers, are seen, or they look the same
            after a turn by another angle than 180 degrees.
    """
    discs, places = pixels @ (1, -1j), markers @ (1, 1j)
    apart = np.abs(places[:, None] - places)[~np.eye(len(places), dtype=bool)].min(initial=np.inf)
    if (turn := _symmetry(places, GATE * apart)) is not None:
        raise UserError(
            f"the fiducials cannot be made out, and the markers look the same after a turn by {turn:.0f} "
            "degrees, so they do not tell how the finger lies; show the fiducials"
        )
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


def _symmetry(places: ComplexArray, gate: float) -> float | None:
    """Smallest turn but 180, degrees, that maps places, shape (m,), on each other within `gate`, or None."""
    arms = places - places.mean()
    farthest = arms[np.abs(arms).argmax()]
    turns = np.angle(arms / farthest)[np.abs(np.abs(arms) - np.abs(farthest)) < gate]
    found = [
        abs(float(np.degrees(turn)))
        for turn in turns
        if np.pi / 180 < abs(turn) < np.pi * 179 / 180
        and (np.abs(arms[:, None] * np.exp(1j * turn) - arms).min(axis=1) < gate).all()
    ]
    return min(found, default=None)
