"""Loading and unloading of a filmed finger: the branch of a frame, and the error by the material's loss."""

from dataclasses import replace
from math import hypot
from typing import Literal, NamedTuple

import numpy as np

from pinnray.runtime.arrays import BoolArray, FloatArray
from pinnray.solvers.identification.fit import NORMAL
from pinnray.solvers.identification.tracker import ForceReading
from pinnray.solvers.solution import Estimated

Branch = Literal["rest", "loading", "hold", "unloading", "reloading"]
"""Of a frame: rest is before the first loading, reloading below the largest travel so far."""
FIRST = ("rest", "loading")
"""Branches on which no energy has been lost yet."""
NOISE_FACTOR = 5.0
"""Change of the travel, in standard deviations, that counts as motion; ..."""
DEADBAND = 0.01
"""... and over the largest travel: the least change that matters for a force known to some per cent."""
HOLD = 0.1
"""Time without motion, over that since the finger left its rest, that counts as a hold."""


class Loading(NamedTuple):
    """A frame on the path of loading and unloading.

    Attributes:
        travel: Root mean square motion of the markers since rest, mm; nan if none is seen.
        branch: Of the frame.
    """

    travel: float
    branch: Branch


class LoadingPath:
    """Follows a finger through loading and unloading, frame after frame.

    Args:
        loss: Share of the loading work that the material loses in a cycle; see `Material`.
    """

    def __init__(self, loss: float) -> None:
        self._loss = loss
        self._farthest: FloatArray | None = None  # displacements at the largest travel, shape (m, 2), mm
        self._largest = self._force = self._tangential_force = 0.0
        self._turn, self._rising = 0.0, True  # travel at the last change that counts as motion, its direction
        self._rested = self._moved = 0.0  # times, s, of the last frame at rest and of that change

    def follow(
        self, time: float, displacements: FloatArray, deviations: FloatArray, visible: BoolArray
    ) -> Loading:
        """The travel and the branch of the next frame; frames have to come in order.

        The travel is the share of the farthest displacements that a frame's ones have, by least squares, so
        that a hidden marker changes it little.

        Args:
            time: Of the frame, s.
            displacements: Of the markers since rest, shape (m, 2), mm; any value where one is hidden.
            deviations: Their standard deviations, shape (m, 2), mm.
            visible: Mask of the markers that were seen, shape (m,).
        """
        if not visible.any():
            return Loading(np.nan, self._branch(time))
        seen, spread = displacements[visible], deviations[visible]
        travel = float(np.sqrt((seen**2).sum(axis=1).mean()))
        noise = float(np.sqrt((spread**2).sum(axis=1).mean()))
        if self._farthest is not None:
            far = self._farthest[visible]
            square = max(float((far**2).sum()), 1e-12)
            travel = self._largest * float((seen * far).sum()) / square
            noise = self._largest * float(np.sqrt(((far * spread) ** 2).sum())) / square
        least = max(NOISE_FACTOR * noise, DEADBAND * self._largest)
        if self._farthest is None and travel <= least:
            self._rested = time
            return Loading(travel, "rest")
        if abs(travel - self._turn) > least:
            self._rising, self._turn, self._moved = travel > self._turn, travel, time
        if travel > self._largest:
            grown = 1.0 if self._farthest is None else travel / self._largest
            before = displacements if self._farthest is None else grown * self._farthest
            self._farthest = np.where(visible[:, None], displacements, before)
            self._largest = float(np.sqrt((self._farthest**2).sum(axis=1).mean()))
        return Loading(travel, self._branch(time, below=travel < self._largest - least))

    def _branch(self, time: float, *, below: bool = False) -> Branch:
        if self._farthest is None:
            return "rest"
        if time - self._moved > HOLD * (self._moved - self._rested):
            return "hold"
        if self._rising:
            return "reloading" if below else "loading"
        return "unloading"

    def widened(self, reading: ForceReading, loading: Loading) -> ForceReading:
        """The reading of the frame with intervals that allow for the loss, but for a first loading."""
        if np.isfinite(reading.force.value):
            self._force = max(self._force, reading.force.value, key=abs)
            self._tangential_force = max(self._tangential_force, reading.tangential_force.value, key=abs)
        if loading.branch in FIRST:
            return reading
        return replace(
            reading,
            force=with_loss(reading.force, self._force, self._loss),
            tangential_force=with_loss(reading.tangential_force, self._tangential_force, self._loss),
            variances={**reading.variances, "loss": (self._loss * self._force / 2) ** 2},
        )


def with_loss(elastic: Estimated, largest: float, loss: float) -> Estimated:
    """An elastic force on the way back, or after a hold, with an interval that reaches to what a loss leaves.

    The loss ψ is 1 - W_u / W_l by the works of unloading and loading. If the force grows in proportion to the
    stroke up to F, then W_l is F / 2 times the stroke, and whatever the shape of the loop, the unloading is
    lower by ψ F / 2 in the mean over the stroke. This mean counts as the standard deviation, independent of
    the others, on the side of zero: an interval of 95 % reaches ψ F lower. A loop with the same difference
    everywhere needs a half of that, one like a lens 0.75, and one whose difference is in proportion to the
    force all of it, at F. A hold that is not much longer than the loading relaxes less.

    Args:
        elastic: The force of the elastic finger with its interval of 95 %.
        largest: The force F of the largest size so far, in the same unit.
        loss: ψ.
    """
    value, low, high = elastic
    half = NORMAL * loss * abs(largest) / 2
    if largest > 0:
        return Estimated(value, value - hypot(value - low, half), high)
    return Estimated(value, low, value + hypot(high - value, half))
