"""Motion of the finger, the camera and the light while the rig films."""

import numpy as np
from numpy.typing import ArrayLike

from pinnray.geometry.finger.parameters import CheckedModel, bounded
from pinnray.runtime.arrays import FloatArray


class Motion(CheckedModel):
    """Number of frames of each part of a recording, and the load as a function of time.

    The shutter opens at the start of a frame. The load grows at constant speed, from the closing of the
    shutter in the last frame at rest until its opening in the first frame held, and goes back likewise.
    """

    rest: int = bounded(30, 1, 100_000, "Frames before the pressing", "frames")
    moving: int = bounded(30, 0, 100_000, "Frames of the pressing; 0: a jump between two frames", "frames")
    held: int = bounded(30, 1, 100_000, "Frames held under full load", "frames")
    back: int = bounded(
        0, 0, 100_000, "Frames of the way back, after which the finger rests as long; 0: none", "frames"
    )
    rate: float = bounded(30.0, 0.1, 1000, "Frames a second", "1/s")
    shutter: float = bounded(0.3, 0, 0.9, "Share of the time for which the shutter is open")

    def __len__(self) -> int:
        """Number of frames."""
        return self._leaves + (self.back + self.rest if self.back else 0)

    @property
    def loading_time(self) -> float:
        """Time in which the load grows, frames."""
        return 1 - self.shutter + self.moving

    @property
    def _leaves(self) -> int:
        """The first frame after those held."""
        return self.rest + self.moving + self.held

    def load(self, time: ArrayLike) -> FloatArray:
        """Share of the load that acts at times, both of shape (n,); the frames start at 0, 1, 2, ..."""
        time = np.asarray(time)
        start, turn = self.rest - 1 + self.shutter, self._leaves - 1 + self.shutter
        grown = np.clip((time - start) / (self.rest + self.moving - start), 0.0, 1.0)
        if not self.back:
            return np.asarray(grown)
        return np.asarray(grown - np.clip((time - turn) / (self._leaves + self.back - turn), 0.0, 1.0))

    def exposed(self, frame: int, steps: int) -> FloatArray:
        """Shares of the load at `steps` times within a frame's exposure; one share if they are equal."""
        return np.unique(self.load(frame + (np.arange(steps) + 0.5) / steps * self.shutter))

    def travel(self, frame: int) -> float:
        """Growth of the share of the load while a frame is exposed."""
        return float(np.ptp(self.load(frame + np.array([0.0, self.shutter]))))
