"""Decodes picture files into images of 8 bits, page by page."""

import re
import warnings
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from io import BytesIO
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from cv2.typing import MatLike
from PIL import Image as PictureFile

from pinnray.runtime.errors import UserError
from pinnray.vision.frames.formats import DAMAGED, PNG, TIFF, UNREAD, is_unread, pages
from pinnray.vision.frames.frame import Image

JPEG, PNG_END = b"\xff\xd8", b"\0\0\0\0IEND\xaeB`\x82"
PNG_HEADER = 33
"""Length of a PNG's signature and first chunk, bytes."""
DEPTHS = (10, 12, 14, 16)
"""Possible numbers of significant bits in 16-bit pictures."""

_JPEG_MARKER = re.compile(rb"\xff[^\x00\xff\xd0-\xd7]", re.DOTALL)
"""Starts a segment of a JPEG; the excluded ones may stand within its compressed data."""
_AS_STORED = cv2.IMREAD_ANYDEPTH | cv2.IMREAD_ANYCOLOR | cv2.IMREAD_IGNORE_ORIENTATION


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


class Decoder:
    """Decodes the pictures of one sequence into 8 bits, all to the same scale.

    A 16-bit picture has 10, 12, 14 or 16 significant bits, as many as the brightest pixel of the first one
    needs: many cameras of 10 to 14 bits leave the highest ones empty.
    """

    def __init__(self) -> None:
        self._white: int | None = None

    def __call__(self, content: bytes, label: str, name: str) -> Iterator[tuple[str, Image]]:
        """The images in a file's content with their names: of several pages, the page's number follows.

        Animated PNG and WebP are refused: OpenCV crashes on damaged ones.

        Raises:
            UserError: If it is no whole picture, or neither of 8 nor of 16 bits.
        """
        numbers, first = pages(content), self._image(content, label)
        if len(numbers) == 1 and numbers[0]:
            first = self._in_8_bits(self._page(content, numbers[0], label), label)
        if len(numbers) == 1:
            yield name, first
            return
        if not content.startswith(TIFF):
            raise UserError(f"cannot read {label}: it has {len(numbers)} frames, not one; make a video of it")
        for count, page in enumerate(numbers):
            yield f"{name}:{count}", self._in_8_bits(self._page(content, page, label), label)

    def _image(self, content: bytes, label: str) -> Image:
        """The first image."""
        if not content:
            raise UserError(f"cannot read {label}: it is empty")
        if is_unread(content):
            raise UserError(f"cannot read {label}: {UNREAD}")
        if content.startswith((JPEG, PNG)) and picture_end(content) is None:
            raise UserError(f"cannot read {label}: its end is missing")
        if content.startswith(PNG):
            _check_png(content, label)
        image = None
        with silenced(), suppress(cv2.error):  # raised for more pixels than `vision.MOST_PIXELS`
            image = cv2.imdecode(np.frombuffer(content, dtype=np.uint8), _AS_STORED)
        if image is None:
            raise UserError(
                f"cannot read {label}: it is damaged, too large, or not one that OpenCV knows, such as PNG "
                "or JPEG"
            )
        return self._in_8_bits(image, label)

    @staticmethod
    def _page(content: bytes, page: int, label: str) -> MatLike:
        """A page of a TIFF as it is stored."""
        with silenced(), suppress(cv2.error):
            buffer = np.frombuffer(content, dtype=np.uint8)
            done, found = cv2.imdecodemulti(buffer, _AS_STORED, range=(page, page + 1))
            if done and len(found) == 1:
                return found[0]
        raise UserError(f"cannot read {label}: page {page} is damaged or too large")

    def _in_8_bits(self, image: MatLike, label: str) -> Image:
        """An image as it is stored in 8 bits, without transparency."""
        if image.ndim == 3 and image.shape[2] == 4:
            image = cv2.cvtColor(image, cv2.COLOR_BGRA2BGR)
        if image.dtype == np.uint8:
            return np.asarray(image, dtype=np.uint8)
        if image.dtype != np.uint16:
            raise UserError(f"cannot read {label}: its pixels are {image.dtype}; they must have 8 or 16 bits")
        if self._white is None:
            brightest = int(image.max()).bit_length()
            self._white = 2 ** next(bits for bits in DEPTHS if bits >= brightest) - 1
        return np.asarray(cv2.convertScaleAbs(image, alpha=255 / self._white), dtype=np.uint8)


def _check_png(content: bytes, label: str) -> None:
    """Refuse a PNG with a damaged part, which OpenCV would show in part."""
    try:
        with warnings.catch_warnings(action="ignore"), PictureFile.open(BytesIO(content)) as picture:
            picture.verify()
    except DAMAGED:
        raise UserError(f"cannot read {label}: one of its parts is damaged, or it is too large") from None


def content_of(path: Path) -> bytes:
    """The bytes of a picture file."""
    try:
        return path.read_bytes()
    except OSError as error:
        raise UserError(f"cannot read the picture {path}: {error.strerror}") from None


def picture_end(content: bytes | bytearray) -> int | None:
    """End of the JPEG or PNG at the start of `content`; None if it does not hold all of it.

    Source: PNG specification, third edition, section 5.3; ITU-T T.81, annex B. A JPEG is walked segment by
    segment, since a preview in one of them has an end marker of its own.
    """
    if content.startswith(PNG):
        return end + len(PNG_END) if (end := content.find(PNG_END)) >= 0 else None
    position = len(JPEG)
    while content.startswith(JPEG) and (marker := _JPEG_MARKER.search(content, position)):
        position = marker.end()
        if marker[0] == b"\xff\xd9":
            return position
        position += int.from_bytes(content[position : position + 2], "big")
    return None
