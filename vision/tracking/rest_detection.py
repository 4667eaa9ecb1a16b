"""Detection of the frames at rest: before the finger is pressed, and while it is held."""

from typing import NamedTuple

import numpy as np

from pinnray.runtime.arrays import FloatArray
from pinnray.runtime.errors import UserError

STILL = 0.02
"""Root mean square distance from the first frames, mm, that counts as rest, ..."""
NOISE_FACTOR = 3.5
"""... or this multiple of the noise's standard deviation, whichever is more."""
FEWEST = 3
"""Smallest number of frames at rest; fewer if there are only a few pictures."""


class RestIntervals(NamedTuple):
    """The frames at rest, as ranges: before and after the motion."""

    initial: range
    final: range


def find_rest_intervals(positions: FloatArray, noise: float = 0.0) -> RestIntervals:
    """Find the frames at rest; if the finger comes back in the end, those around its farthest place instead.

    Args:
        positions: Of markers in every frame, shape (f, m, 2), mm; nan where one was not detected.
        noise: Standard deviation of a coordinate that is known beforehand, mm.

    Raises:
        UserError: If there is only one frame, or the finger does not rest at either end, or does not move.
    """
    count = len(positions)
    if count < 2:
        raise UserError(f"{count} frame; show the finger at rest before and after it is pressed")
    limit = max(STILL, NOISE_FACTOR * max(noise, _noise(positions)))
    fewest = max(1, min(FEWEST, count // 2))
    first = _resting(positions, fewest, limit)
    last = _resting(positions[::-1], fewest, limit)
    for length, end in ((first, "start"), (last, "end")):
        if length < fewest:
            raise UserError(
                f"the finger does not rest at the {end}: it moves by more than {limit:.2g} mm within "
                f"{fewest} frames; film it at rest before it is pressed and while it is held"
            )
    rest = RestIntervals(range(first), range(count - last, count))
    start = _centre(positions[: rest.initial.stop])
    if _distance(start, _centre(positions[rest.final.start :])) > limit:
        return rest
    away = np.nan_to_num([_distance(frame, start) for frame in positions])
    if not away.max() > 2 * limit:
        raise UserError(
            f"the finger does not move by more than {2 * limit:.2g} mm; film it while it is pressed"
        )
    farthest = int(away.argmax())
    near = [_distance(frame, positions[farthest]) <= limit for frame in positions]
    before, after = near[farthest::-1].index(False), near[farthest:].index(False)
    return RestIntervals(rest.initial, range(farthest - before + 1, farthest + after))


def _resting(positions: FloatArray, fewest: int, limit: float) -> int:
    """Number of first frames that stay near the first few; a single outlier is tolerated."""
    reference = _centre(positions[:fewest])
    away = np.array([not _distance(frame, reference) <= limit for frame in positions])
    left = away[:-1] & away[1:]
    if left.any():
        return int(left.argmax())
    return len(away) - int(away[-1])


def _noise(positions: FloatArray) -> float:
    """Standard deviation of a coordinate, mm, from second differences, which are free of steady motion."""
    bends = positions[2:] - 2 * positions[1:-1] + positions[:-2]
    known = np.abs(bends[np.isfinite(bends)])
    return float(np.median(known) * 1.4826 / np.sqrt(6)) if len(known) else 0.0


def _centre(positions: FloatArray) -> FloatArray:
    """Median of the frames in which a marker was detected, shape (m, 2), mm; nan if there is none."""
    seen = np.isfinite(positions).any(axis=0)
    centre = np.full(positions.shape[1:], np.nan)
    centre[seen] = np.nanmedian(positions[:, seen], axis=0)
    return centre


def _distance(positions: FloatArray, reference: FloatArray) -> float:
    """Root mean square over the coordinates that are known in both, mm; nan if there are none."""
    missed = positions - reference
    known = missed[np.isfinite(missed)]
    return float(np.sqrt(np.mean(known**2))) if len(known) else np.nan
