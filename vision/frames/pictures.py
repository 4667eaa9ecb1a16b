"""Sequences of pictures: a folder, a glob, or a pipe of JPEG or PNG pictures one after another."""

import re
import warnings
import zlib
from collections.abc import Callable, Iterable, Iterator, Sequence
from glob import glob, has_magic
from itertools import count
from pathlib import Path

import cv2

from pinnray.runtime.atomic import write_bytes
from pinnray.runtime.errors import UserError
from pinnray.vision.frames.decoder import JPEG, PNG_HEADER, Decoder, content_of, picture_end
from pinnray.vision.frames.formats import HEAD, PNG, UNREAD, UNREAD_SUFFIXES, has_pages, is_unread
from pinnray.vision.frames.frame import RIG_MARK, CapturedImage, Image, ImageStream

SUFFIXES = frozenset({".png", ".jpg", ".jpeg", ".tif", ".tiff", ".bmp", ".webp", ".pgm", ".ppm", ".jp2"})


def natural_order(path: Path) -> list[tuple[int, str]]:
    """Sort key that puts frame2 before frame10."""
    parts = re.split(r"(\d+)", path.name)
    return [(int(part), "") if part.isdecimal() else (-1, part) for part in parts]


def picture_paths(source: str | Path) -> list[Path]:
    """The pictures of a folder, but hidden ones, or of a glob, in natural order, or the file `source` itself.

    Raises:
        UserError: If there is none, or a folder also holds some of a format that is not read.
    """
    path = Path(source)
    if path.is_dir():
        shown = [file for file in path.iterdir() if not file.name.startswith(".")]
        others = sorted((file for file in shown if file.suffix.lower() in UNREAD_SUFFIXES), key=natural_order)
        if others:
            more = f" and {len(others) - 1} more" if len(others) > 1 else ""
            raise UserError(f"{path} holds {others[0].name}{more}: {UNREAD}; or take them out")
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


def is_picture(path: Path) -> bool:
    """True for a file that is a picture by its suffix or its content; False for a film, or without a file.

    Raises:
        UserError: If it is a photograph of a format that is not read.
    """
    try:
        with path.open("rb") as file:
            head = file.read(HEAD)
    except OSError:
        return False
    suffix = path.suffix.lower()
    if is_unread(head) or suffix in UNREAD_SUFFIXES:
        raise UserError(f"cannot read the picture {path}: {UNREAD}")
    return suffix in SUFFIXES or has_pages(head)


def images_of_files(paths: Sequence[Path], rate: float) -> ImageStream:
    """The images of picture files, decoded one by one to the same scale."""
    return _decoded(((content_of(path), f"the picture {path}", path.name) for path in paths), rate)


def images_of_pipe(read: Callable[[int], bytes], name: str, rate: float) -> ImageStream:
    """The images of a pipe of pictures, such as `ffmpeg -f image2pipe` writes; `read` gives b"" at its end.

    The pipe is not read by PyAV: FFmpeg's reader of pictures takes several JPEGs for one, leaves out the last
    and is one or two behind a live source.
    """
    pictures = enumerate(split(read, name), start=1)
    labelled = ((content, f"picture {number} of {name}") for number, content in pictures)
    return _decoded(((content, label, label) for content, label in labelled), rate)


def _decoded(pictures: Iterable[tuple[bytes, str, str]], rate: float) -> ImageStream:
    """The images of pictures: their contents, how a message calls each, and their names."""
    decode, numbers = Decoder(), count()
    for content, label, name in pictures:
        for page, image in decode(content, label, name):
            yield CapturedImage(image, next(numbers) / rate, page, is_marked(content))


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
