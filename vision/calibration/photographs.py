"""Photographs of a board, in grey and by name: pictures, folders, patterns, or frames of a video."""

from collections.abc import Iterable, Iterator, Sequence
from glob import glob, has_magic
from pathlib import Path

import cv2
import numpy as np

from geometry.errors import UserError
from vision.frames.frame import GreyImage, Image
from vision.frames.pictures import SUFFIXES, Decoder, natural_order, pictures_in
from vision.frames.video import open_frames

FRAMES_OF_A_VIDEO = 40
"""How many frames are taken of a video at most, spread evenly."""


def photographs(sources: Iterable[Path], *, without: Sequence[str] = ()) -> Iterator[tuple[str, GreyImage]]:
    """Names and photographs, shape (height, width), as the sensor read them: never turned.

    Args:
        sources: Pictures, folders of them, patterns such as photos/*.jpg, or videos.
        without: Names to leave out, with or without their folders.

    Raises:
        UserError: If a source cannot be read, or there is no photograph of a name in `without`.
    """
    absent = set(without)
    for name, image in _all(sources):
        names = {name, Path(name).name}
        if names.isdisjoint(without):
            yield name, _grey(image)
        absent -= names
    if absent:
        raise UserError(f"there is no photograph {', '.join(sorted(absent))} to leave out")


def _all(sources: Iterable[Path]) -> Iterator[tuple[str, Image]]:
    for source in sources:
        if source.is_file() and source.suffix.lower() not in SUFFIXES:
            yield from _frames(source)
            continue
        for path in _pictures(source):
            try:
                content = path.read_bytes()
            except OSError as error:
                raise UserError(f"cannot read the picture {path}: {error.strerror}") from None
            yield str(path), Decoder()(content, f"the picture {path}")


def _pictures(source: Path) -> list[Path]:
    if source.is_dir():
        return pictures_in(source)
    if has_magic(str(source)) and not source.exists():
        if found := sorted(map(Path, glob(str(source))), key=natural_order):
            return found
        raise UserError(f"{source}: there is no such picture")
    return [source]


def _frames(source: Path) -> Iterator[tuple[str, Image]]:
    with open_frames(source) as frames:
        every = max(1, (frames.count or 0) // FRAMES_OF_A_VIDEO)
        for frame in frames:
            if frame.number % every == 0:
                yield f"{source}:{frame.number}", frame.image


def _grey(image: Image) -> GreyImage:
    grey = image if image.ndim == 2 else cv2.cvtColor(image, cv2.COLOR_BGR2GRAY)
    return np.asarray(grey, dtype=np.uint8)
