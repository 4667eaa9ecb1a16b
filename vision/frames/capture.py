"""Frames of a video file and of a camera, by OpenCV."""

import math
import time
import warnings
from itertools import count
from pathlib import Path

import cv2
import numpy as np

from geometry.errors import UserError
from vision.frames.frame import CapturedImage, Frames, Image, ImageStream
from vision.frames.quiet_opencv import silenced

USUAL_RATE = 30.0
FASTEST = 1000.0
"""Frames a second; what a file says beyond that is no rate."""

MISSING_SHARE = 0.02
"""Of a video's frames: so far off the number in its header may be."""


def video_frames(path: Path, rate: float | None = None) -> Frames:
    """Frames of a video file, with the times that it gives; `rate` counts if it gives none.

    Iterating warns if far fewer frames can be read than the file says that it has.

    Raises:
        UserError: If it is no video, or not one frame can be read.
    """
    try:
        with path.open("rb") as file:
            empty = not file.read(1)
    except OSError as error:
        raise UserError(f"cannot read the video {path}: {error.strerror}") from None
    if empty:
        raise UserError(f"cannot read the video {path}: the file is empty")
    with silenced():
        capture = cv2.VideoCapture(str(path), cv2.CAP_FFMPEG)
    if not capture.isOpened():
        raise UserError(
            f"cannot read the video {path}: it is no video, its end is missing, or OpenCV lacks its codec"
        )
    capture.set(cv2.CAP_PROP_ORIENTATION_AUTO, 0)
    known = capture.get(cv2.CAP_PROP_FRAME_COUNT)
    frames = int(known) if 0 < known < math.inf else None
    rate = _rate(capture, rate)
    return Frames(str(path), _images_of_video(path, capture, rate, frames), rate=rate, count=frames)


def _images_of_video(path: Path, capture: cv2.VideoCapture, rate: float, known: int | None) -> ImageStream:
    """Where the file's times do not increase, a frame follows the last one by 1 / `rate`.

    The end is missing if the last time falls short too: where the rate varies, `known` is only the product of
    duration and `rate`.
    """
    read, first, last = 0, math.nan, -math.inf
    try:
        while (image := _next(capture)) is not None:
            said = _time(capture, rate)
            last = said if said > last else last + 1 / rate
            first = first if read else last
            yield CapturedImage(image, last, f"frame {read}")
            read += 1
    finally:
        capture.release()
    if not read:
        raise UserError(
            f"no frame of the video {path} can be read: it is damaged, or OpenCV lacks its codec (AV1?)"
        )
    if known and max(read, (last - first) * rate + 1) < known - max(1, MISSING_SHARE * known):
        warnings.warn(
            f"{path} says that it has {known} frames, but only the first {read} can be read: "
            "it was cut off or is damaged there",
            stacklevel=3,
        )


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
    return Frames(f"camera {index}", _images_of_camera(index, capture), rate=_rate(capture, rate))


def _images_of_camera(index: int, capture: cv2.VideoCapture) -> ImageStream:
    try:
        for number in count():
            if (image := _next(capture)) is None:
                raise UserError(f"camera {index} gives no image after {number} frames")
            yield CapturedImage(image, time.monotonic(), f"frame {number}")
    finally:
        capture.release()


def _next(capture: cv2.VideoCapture) -> Image | None:
    with silenced():
        done, image = capture.read()
    return np.asarray(image, dtype=np.uint8) if done else None


def _time(capture: cv2.VideoCapture, rate: float) -> float:
    """Of the last image, s; by its number at `rate` if the stream does not say when it starts (OpenCV 4)."""
    said = capture.get(cv2.CAP_PROP_POS_MSEC) / 1000
    return said if said >= 0 else capture.get(cv2.CAP_PROP_PTS) / rate


def _rate(capture: cv2.VideoCapture, told: float | None) -> float:
    said = capture.get(cv2.CAP_PROP_FPS)
    return said if 0 < said <= FASTEST else told or USUAL_RATE
