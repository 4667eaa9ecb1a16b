"""Frames of a connected camera, by OpenCV.

PyAV opens Video4Linux devices, too, but refuses a camera without the requested format; OpenCV takes another.
"""

import time
from itertools import count

import cv2
import numpy as np

from geometry.errors import UserError
from vision.frames.frame import CapturedImage, Frames, ImageStream, plausible_rate
from vision.frames.quiet_opencv import silenced


def camera_frames(index: int, *, size: tuple[int, int], rate: float | None = None) -> Frames:
    """Frames of a camera as they come, which is asked for a size, (width, height), and a rate.

    Raises:
        UserError: If there is no such camera; on iterating, if it stops.
    """
    with silenced():
        capture = cv2.VideoCapture(index)
    if not capture.isOpened():
        raise UserError(f"camera {index} cannot be opened; is it connected, and not used by another program?")
    capture.set(cv2.CAP_PROP_FOURCC, cv2.VideoWriter.fourcc(*"MJPG"))  # over USB, raw images come slower
    capture.set(cv2.CAP_PROP_FRAME_WIDTH, size[0])
    capture.set(cv2.CAP_PROP_FRAME_HEIGHT, size[1])
    if rate is not None:
        capture.set(cv2.CAP_PROP_FPS, rate)
    rate = plausible_rate(capture.get(cv2.CAP_PROP_FPS), rate)
    return Frames(f"camera {index}", _images_of_camera(index, capture), rate=rate)


def _images_of_camera(index: int, capture: cv2.VideoCapture) -> ImageStream:
    try:
        for number in count():
            with silenced():
                done, image = capture.read()
            if not done:
                raise UserError(f"camera {index} gives no image after {number} frames")
            yield CapturedImage(np.asarray(image, dtype=np.uint8), time.monotonic(), f"frame {number}")
    finally:
        capture.release()
