"""One line on the terminal with the marker displacements while they are tracked."""

from collections.abc import Callable

import numpy as np
from rich.live import Live
from rich.text import Text

from geometry.arrays import FloatArray
from vision.frames.frame import Frame
from vision.tracking.frame_tracker import FrameDetections


def displacement_line(live: Live) -> Callable[[Frame, FrameDetections], None]:
    """A function that shows the displacements, mm, since its first frame; a dash for an invisible marker."""
    start: FloatArray | None = None

    def show(frame: Frame, detections: FrameDetections) -> None:
        nonlocal start
        if start is None:
            start = detections.places
        moved = (detections.places - start).tolist()
        seen = np.isfinite(detections.markers.radii)
        cells = [f"{u:+.2f},{v:+.2f}" if known else "–" for (u, v), known in zip(moved, seen, strict=True)]
        live.update(Text(f"{frame.time:8.2f} s  {'  '.join(cells)}", no_wrap=True, overflow="ellipsis"))

    return show
