"""Formats of picture files: those that are not read, and the numbers of pages."""

import struct
import warnings
from collections.abc import Sequence
from contextlib import suppress
from io import BytesIO

from PIL import Image as PictureFile
from PIL import ImageSequence

PNG, TIFF = b"\x89PNG\r\n\x1a\n", (b"II*\0", b"MM\0*", b"II+\0", b"MM\0+")
HEAD = 64
"""Bytes at the start of a file that tell its format."""
UNREAD = "HEIC, AVIF, JPEG XL and raw photographs are not read; convert them to JPEG, PNG or TIFF"
UNREAD_SUFFIXES = frozenset(
    {".heic", ".heif", ".hif", ".avif", ".jxl"}
    | {".dng", ".cr2", ".cr3", ".nef", ".arw", ".orf", ".rw2", ".raf", ".pef", ".srw"}
)
"""Formats of photographs that are not read.

FFmpeg opens some, but gives a tile, a preview or the first picture. HEIC would need libheif (pillow-heif: 6
MB, of which x265 is under the GPL), which turns photographs as their tag says; all others come as the sensor
read them, and one calibration fits all.
"""
_BRANDS = frozenset(b"heic heix heim heis hevc hevx mif1 msf1 mif2 avif avis crx".split())
SUBFILE, _SMALLER, _MASK = 254, 1, 4
"""A TIFF page's tag NewSubfileType, and its bits: a smaller copy of another page, a mask of one."""
DAMAGED = (OSError, SyntaxError, LookupError, ValueError, struct.error, PictureFile.DecompressionBombError)
"""Errors of Pillow for a picture that is damaged or too large."""


def is_unread(content: bytes) -> bool:
    """True for the start of a photograph in a format that is not read.

    Source: ISO/IEC 23008-12 and the AVIF specification, brands in the box `ftyp`; ISO/IEC 18181-2.
    """
    jpeg_xl = content.startswith((b"\xff\x0a", b"\0\0\0\x0cJXL "))
    return jpeg_xl or (content[4:8] == b"ftyp" and content[8:12].strip() in _BRANDS)


def has_pages(head: bytes) -> bool:
    """True for the start of a PNG, a TIFF or a WebP, of which FFmpeg may read one page of many."""
    return head.startswith((PNG, *TIFF)) or (head.startswith(b"RIFF") and head[8:12] == b"WEBP")


def pages(content: bytes) -> Sequence[int]:
    """Numbers of a picture's pages: more than [0] for a TIFF of several, an animated PNG or WebP.

    Smaller copies and masks of other pages of a TIFF are left out.

    Source: TIFF 6.0, section 8, NewSubfileType.
    """
    if not has_pages(content):
        return [0]
    kinds = []
    with (
        suppress(*DAMAGED),
        warnings.catch_warnings(action="ignore"),
        PictureFile.open(BytesIO(content)) as file,
    ):
        if not content.startswith(TIFF):
            return range(getattr(file, "n_frames", 1))
        for page in ImageSequence.Iterator(file):
            kinds.append(getattr(page, "tag_v2", {}).get(SUBFILE, 0))
    return [page for page, kind in enumerate(kinds) if not kind & (_SMALLER | _MASK)] or [0]
