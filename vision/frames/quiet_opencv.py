"""OpenCV without messages on standard error."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import cv2


@contextmanager
def silenced() -> Iterator[None]:
    """Keeps OpenCV's messages off standard error: the caller reports what they mean to a user."""
    opencv: Any = cv2
    logging = opencv if hasattr(opencv, "setLogLevel") else opencv.utils.logging  # OpenCV 4 and 5
    level = logging.setLogLevel(0)
    try:
        yield
    finally:
        logging.setLogLevel(level)
