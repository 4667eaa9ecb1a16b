"""Annotated images of tracked markers, to check by eye."""

from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from pinnray.runtime.arrays import FloatArray
from pinnray.vision.frames.frame import Image
from pinnray.vision.tracking.frame_tracker import FrameDetections

SEEN, LOST, FIXED, TRAJECTORY = (40, 150, 0), (0, 60, 230), (200, 110, 0), (190, 0, 190)
"""Colours, in blue, green, red, of markers, undetected markers, fiducials and trajectories."""
SHIFT = 4
"""Binary digits after the point in the coordinates that OpenCV draws."""


def annotated(
    image: Image, detections: FrameDetections, text: Sequence[str], *, trajectories: Sequence[FloatArray] = ()
) -> Image:
    """A copy of an image with the detections drawn into it.

    Args:
        image: Grey or coloured.
        detections: What the tracker found in it; undetected markers are crossed at their predicted places.
        text: Lines in the upper left corner.
        trajectories: Of markers, each of shape (f, 2), pixels; nan where one was not detected.

    Returns:
        Shape (h, w, 3).
    """
    coloured = cv2.cvtColor(image, cv2.COLOR_GRAY2BGR) if image.ndim == 2 else image.copy()
    canvas: Image = np.asarray(coloured, dtype=np.uint8)
    size = max(canvas.shape[1] / 1280, 0.5)
    width = max(1, round(size))
    for trajectory in trajectories:
        known = trajectory[np.isfinite(trajectory).all(axis=1)]
        cv2.polylines(canvas, [_fixed(known)], False, TRAJECTORY, width, cv2.LINE_AA, SHIFT)
    fiducials = [] if detections.fiducials is None else [(detections.fiducials, FIXED)]
    for discs, colour in (*fiducials, (detections.markers, SEEN)):
        for centre, radius in zip(discs.centres, discs.radii, strict=True):
            if np.isfinite(radius):
                whole = round(float(radius) * 2**SHIFT)
                cv2.circle(canvas, _fixed(centre).tolist(), whole, colour, width, cv2.LINE_AA, SHIFT)
    for number, (seen, guess) in enumerate(
        zip(detections.markers.radii, detections.guesses, strict=True), start=1
    ):
        colour = SEEN if np.isfinite(seen) else LOST
        if not np.isfinite(seen):
            centre, cross = np.rint(guess).astype(int).tolist(), cv2.MARKER_TILTED_CROSS
            cv2.drawMarker(canvas, centre, LOST, cross, round(16 * size), width, cv2.LINE_AA)
        _write(canvas, str(number), guess + size * np.array([-5, -14]), 0.55 * size, colour)
    for number, line in enumerate(text):
        _write(canvas, line, size * np.array([14, 26 + 24 * number]), 0.6 * size, (30, 30, 30))
    return canvas


def _write(canvas: Image, text: str, place: FloatArray, scale: float, colour: tuple[int, ...]) -> None:
    """Letters with a light rim, readable on anything."""
    where = (round(float(place[0])), round(float(place[1])))
    for width, paint in ((4, (255, 255, 255)), (1, colour)):
        cv2.putText(canvas, text, where, cv2.FONT_HERSHEY_SIMPLEX, scale, paint, width, cv2.LINE_AA)


def _fixed(pixels: FloatArray) -> NDArray[np.int32]:
    return np.asarray(np.rint(pixels * 2**SHIFT), dtype=np.int32)
