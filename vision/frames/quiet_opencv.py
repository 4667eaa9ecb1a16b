"""OpenCV without a word on standard error."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import cv2


@contextmanager
def silenced() -> Iterator[None]:
    """Keeps remarks of OpenCV and FFmpeg off standard error: what they mean to a user, we say."""
    os.environ.setdefault("OPENCV_FFMPEG_LOGLEVEL", "-8")
    opencv: Any = cv2
    logging = opencv if hasattr(opencv, "setLogLevel") else opencv.utils.logging  # OpenCV 4 and 5
    level = logging.setLogLevel(0)
    try:
        yield
    finally:
        logging.setLogLevel(level)
