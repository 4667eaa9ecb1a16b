"""Sequences of pictures: a folder, a glob, or a pipe of JPEG or PNG pictures one after another."""

import re
import warnings
import zlib
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from glob import glob, has_magic
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from geometry.atomic import write_bytes
from geometry.errors import UserError
from vision.frames.frame import RIG_MARK, CapturedImage, Image, ImageStream

SUFFIXES = frozenset({".png", ".jpg", ".jpeg", ".tif", ".tiff", ".bmp", ".webp", ".pgm", ".ppm", ".jp2"})
JPEG, PNG, PNG_END = b"\xff\xd8", b"\x89PNG\r\n\x1a\n", b"\0\0\0\0IEND\xaeB`\x82"
PNG_HEADER = 33
"""Length of a PNG's signature and first chunk, bytes."""
DEFLATE = 1032
"""Largest ratio by which a PNG's compression makes data smaller. Source: zlib, technical details."""

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


def natural_order(path: Path) -> list[tuple[int, str]]:
    """Sort key that puts frame2 before frame10."""
    parts = re.split(r"(\d+)", path.name)
    return [(int(part), "") if part.isdecimal() else (-1, part) for part in parts]


def picture_paths(source: str | Path) -> list[Path]:
    """The pictures of a folder, but hidden ones, or of a glob, in natural order, or the file `source` itself.

    Raises:
        UserError: If there is none.
    """
    path = Path(source)
    if path.is_dir():
        shown = (file for file in path.iterdir() if not file.name.startswith("."))
        found = [file for file in shown if file.suffix.lower() in SUFFIXES and file.is_file()]
    elif path.exists() or not has_magic(str(source)):
        found = [path]
    else:
        found = [file for file in map(Path, glob(str(source))) if file.is_file()]
    if not found:
        raise UserError(
            f"{path} holds no picture, such as PNG or JPEG"
            if path.is_dir()
            else f"{str(source)!r}: there is no such picture"
        )
    return sorted(found, key=natural_order)


def images_of_files(paths: Sequence[Path], rate: float) -> ImageStream:
    """The images of picture files, decoded one by one to the same scale."""
    decode = Decoder()
    for number, path in enumerate(paths):
        content = _content(path)
        image = decode(content, f"the picture {path}")
        yield CapturedImage(image, number / rate, path.name, is_marked(content))


def images_of_pipe(read: Callable[[int], bytes], name: str, rate: float) -> ImageStream:
    """The images of a pipe of pictures, such as `ffmpeg -f image2pipe` writes; `read` gives b"" at its end.

    The pipe is not read by PyAV: FFmpeg's reader of pictures takes several JPEGs for one, leaves out the last
    and is one or two behind a live source.
    """
    decode = Decoder()
    for number, content in enumerate(split(read, name)):
        label = f"picture {number + 1} of {name}"
        yield CapturedImage(decode(content, label), number / rate, label, is_marked(content))


class Decoder:
    """Decodes the pictures of one sequence into 8 bits, all to the same scale.

    A 16-bit picture has 10, 12, 14 or 16 significant bits, as many as the brightest pixel of the first one
    needs: many cameras of 10 to 14 bits leave the highest ones empty.
    """

    def __init__(self) -> None:
        self._white: int | None = None

    def __call__(self, content: bytes, label: str) -> Image:
        """The image in a file's content.

        Raises:
            UserError: If it is no whole picture, or neither of 8 nor of 16 bits.
        """
        if not content:
            raise UserError(f"cannot read {label}: it is empty")
        if content.startswith((JPEG, PNG)) and picture_end(content) is None:
            raise UserError(f"cannot read {label}: its end is missing")
        if content.startswith(PNG) and (fault := _png_fault(content)):
            raise UserError(f"cannot read {label}: {fault}")
        image = None
        with silenced(), suppress(cv2.error):  # raised for more pixels than `vision.MOST_PIXELS`
            image = cv2.imdecode(np.frombuffer(content, dtype=np.uint8), _AS_STORED)
        if image is None:
            raise UserError(
                f"cannot read {label}: it is damaged, too large, or not one that OpenCV knows, such as PNG "
                "or JPEG"
            )
        if image.dtype == np.uint8:
            return np.asarray(image, dtype=np.uint8)
        if image.dtype != np.uint16:
            raise UserError(f"cannot read {label}: its pixels are {image.dtype}; they must have 8 or 16 bits")
        if self._white is None:
            brightest = int(image.max()).bit_length()
            self._white = 2 ** next(bits for bits in DEPTHS if bits >= brightest) - 1
        return np.asarray(cv2.convertScaleAbs(image, alpha=255 / self._white), dtype=np.uint8)

    def file(self, path: Path) -> Image:
        """The image in a file.

        Raises:
            UserError: If the file cannot be read, is no whole picture, or has neither 8 nor 16 bits.
        """
        return self(_content(path), f"the picture {path}")


def _png_fault(content: bytes) -> str:
    """A clause if a chunk of a PNG is damaged, or its pixels are too many: OpenCV would take gigabytes.

    Source: PNG specification, third edition, sections 5.3, 5.5 and 11.2.1.
    """
    position, kind, kinds = len(PNG), b"", list[bytes]()
    while kind != b"IEND":
        length = int.from_bytes(content[position : position + 4], "big")
        body, end = content[position + 4 : position + 8 + length], position + 12 + length
        kind = body[:4]
        if end > len(content) or zlib.crc32(body) != int.from_bytes(content[end - 4 : end], "big"):
            return "one of its parts is damaged"
        position = end
        kinds.append(kind)
    if kinds[0] != b"IHDR" or kinds.count(b"IHDR") > 1 or len(content) < PNG_HEADER:
        return "it has no header, or more than one"
    if b"IDAT" not in kinds:
        return "it has no pixels"
    width, height = (int.from_bytes(content[at : at + 4], "big") for at in (16, 20))
    samples = {0: 1, 2: 3, 3: 1, 4: 2, 6: 4}.get(content[25], 1)
    if width * height * samples * content[24] // 8 > DEFLATE * len(content):
        return "its header asks for more pixels than the file can hold"
    return ""


def _content(path: Path) -> bytes:
    try:
        return path.read_bytes()
    except OSError as error:
        raise UserError(f"cannot read the picture {path}: {error.strerror}") from None


def write_picture(path: Path, image: Image, *, comment: str = "") -> None:
    """Write a picture atomically, in the format of its suffix; a PNG may have a comment in Latin letters."""
    done, encoded = cv2.imencode(path.suffix.lower(), image)
    if not done:
        raise UserError(f"cannot write the picture {path}")
    content = encoded.tobytes()
    if comment:
        content = content[:PNG_HEADER] + _text_chunk(comment) + content[PNG_HEADER:]
    write_bytes(path, content)


def is_marked(content: bytes) -> bool:
    """True for a PNG of the virtual rig, whose comment is `RIG_MARK`."""
    return content.startswith(PNG) and content.startswith(_text_chunk(RIG_MARK), PNG_HEADER)


def _text_chunk(comment: str) -> bytes:
    """A comment as a chunk of a PNG. Source: PNG specification, third edition, sections 5.3 and 11.3.3.2."""
    body = b"tEXtComment\0" + comment.encode("latin-1")
    return (len(body) - 4).to_bytes(4, "big") + body + zlib.crc32(body).to_bytes(4, "big")


def split(read: Callable[[int], bytes], name: str) -> Iterator[bytes]:
    """Cut a stream of JPEG and PNG pictures into single ones.

    Warns if the stream ends within a picture, as an interrupted one does.

    Raises:
        UserError: If the stream carries something else.
    """
    buffer = bytearray()
    more = True
    while more or buffer:
        if more:
            more = bool(chunk := read(1 << 20))
            buffer += chunk
        while (end := picture_end(buffer)) is not None:
            yield bytes(buffer[:end])
            del buffer[:end]
        if len(buffer) >= len(PNG) and not buffer.startswith((JPEG, PNG)):
            raise UserError(
                f"{name} carries neither JPEG nor PNG pictures; send them by, for example, "
                "ffmpeg -i VIDEO -f image2pipe -c:v mjpeg -q:v 2 -"
            )
        if not more and buffer:
            warnings.warn(f"{name} ended within a picture, which is left out", stacklevel=2)
            return


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
