"""Formats of picture files: those that are not read, and the numbers of pages."""

import re
from collections.abc import Sequence

from pinnray.runtime.errors import UserError

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
DESCRIPTION = 8192
"""Bytes at the start of a TIFF in which ImageJ writes how many images it has."""


def is_unread(content: bytes) -> bool:
    """True for the start of a photograph in a format that is not read.

    Source: ISO/IEC 23008-12 and the AVIF specification, brands in the box `ftyp`; ISO/IEC 18181-2.
    """
    jpeg_xl = content.startswith((b"\xff\x0a", b"\0\0\0\x0cJXL "))
    return jpeg_xl or (content[4:8] == b"ftyp" and content[8:12].strip() in _BRANDS)


def has_pages(head: bytes) -> bool:
    """True for the start of a PNG, a TIFF or a WebP, of which FFmpeg may read one page of many."""
    return head.startswith((PNG, *TIFF)) or (head.startswith(b"RIFF") and head[8:12] == b"WEBP")


def pages(content: bytes, label: str) -> Sequence[int]:
    """Numbers of a picture's pages: more than [0] for a TIFF of several, an animated PNG or WebP.

    Smaller copies and masks of other pages of a TIFF are left out.

    Raises:
        UserError: If there are fewer than the file says; it names the file by `label`.

    Source: PNG specification, third edition, section 11.3.6.1; WebP container specification; TIFF 6.0,
    section 2, and the BigTIFF design.
    """
    if content.startswith(PNG):
        control = content.find(b"acTL", 0, content.find(b"IDAT"))
        return range(max(1, int.from_bytes(content[control + 4 : control + 8], "big") if control > 0 else 1))
    if content.startswith(b"RIFF"):
        return range(max(1, _frames_of_webp(content)))
    return _pages_of_tiff(content, label) or [0] if content.startswith(TIFF) else [0]


def _frames_of_webp(content: bytes) -> int:
    at, frames = len(b"RIFFsizeWEBP"), 0
    while at + 8 <= len(content):
        frames += content[at : at + 4] == b"ANMF"
        size = int.from_bytes(content[at + 4 : at + 8], "little")
        at += 8 + size + size % 2
    return frames


def _pages_of_tiff(content: bytes, label: str) -> list[int]:
    little, big = content.startswith(b"II"), content[2:4] in (b"+\0", b"\0+")
    offset, width, counts, entry = (8, 8, 8, 20) if big else (4, 4, 2, 12)

    def number(at: int, size: int) -> int:
        return int.from_bytes(content[at : at + size], "little" if little else "big")

    kinds: list[int] = []
    seen: set[int] = set()
    at = number(offset, width)
    cut = False
    while at and at not in seen:
        seen.add(at)
        entries, start = number(at, counts), at + counts
        if cut := start + entries * entry + width > len(content):
            break
        tags = {number(start + entry * k, 2): start + entry * k for k in range(entries)}
        kinds.append(number(tags[SUBFILE] + entry - width, 4) if SUBFILE in tags else 0)
        at = number(start + entries * entry, width)
    whole = [page for page, kind in enumerate(kinds) if not kind & (_SMALLER | _MASK)]
    said = re.search(rb"ImageJ=[^\0]*?images=(\d+)", content[:DESCRIPTION])
    promised = int(said[1]) if said else len(kinds)
    if promised > len(kinds) or (cut and len(kinds) > 1):
        raise UserError(
            f"cannot read {label}: its end is missing, or it is a stack of more than 4 GB: {len(kinds)} of "
            f"its {f'{promised} ' if said else ''}pages can be read; save it as single pictures"
        )
    return whole
