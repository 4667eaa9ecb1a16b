"""One line on the terminal that follows the markers while they are tracked."""

from types import TracebackType
from typing import Self

import numpy as np
from rich.console import Console
from rich.live import Live
from rich.text import Text

from geometry.arrays import FloatArray
from vision.frames.frame import Frame
from vision.tracking.frame_tracker import FrameDetections


class LiveLine:
    """Shows the displacements, mm, of the markers since the first frame; a dash where one is not seen."""

    def __init__(self, console: Console, *, shown: bool) -> None:
        self._live = Live(console=console, refresh_per_second=10) if shown else None
        self._start: FloatArray | None = None

    def __enter__(self) -> Self:
        if self._live is not None:
            self._live.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._live is not None:
            self._live.stop()

    def __call__(self, frame: Frame, detections: FrameDetections) -> None:
        """Show a frame."""
        if self._live is None:
            return
        if self._start is None:
            self._start = detections.places
        moved = (detections.places - self._start).tolist()
        seen = np.isfinite(detections.markers.radii)
        cells = [f"{u:+.2f},{v:+.2f}" if known else "–" for (u, v), known in zip(moved, seen, strict=True)]
        self._live.update(Text(f"{frame.time:8.2f} s  {'  '.join(cells)}", no_wrap=True, overflow="ellipsis"))
