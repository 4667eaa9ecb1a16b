"""Photographs of a board, in grey and by name: pictures, folders, patterns, or frames of a video."""

from collections.abc import Iterable, Iterator, Sequence
from itertools import chain
from pathlib import Path

import cv2
import numpy as np

from geometry.errors import UserError
from vision.frames.frame import GreyImage, Image
from vision.frames.pictures import SUFFIXES, Decoder, picture_paths
from vision.frames.sources import open_frames

FRAMES_OF_A_VIDEO = 40
"""At most, spread evenly."""


def photographs(sources: Iterable[Path], *, without: Sequence[str] = ()) -> Iterator[tuple[str, GreyImage]]:
    """Names and photographs, shape (height, width), as the sensor read them: never turned.

    Args:
        sources: Pictures, folders of them, patterns such as photos/*.jpg, or videos.
        without: Names to leave out, with or without their folders.

    Raises:
        UserError: If a source cannot be read, or there is no photograph of a name in `without`.
    """
    absent = set(without)
    for name, image in chain.from_iterable(map(_images, sources)):
        names = {name, Path(name).name}
        if names.isdisjoint(without):
            grey = image if image.ndim == 2 else cv2.cvtColor(image, cv2.COLOR_BGR2GRAY)
            yield name, np.asarray(grey, dtype=np.uint8)
        absent -= names
    if absent:
        raise UserError(f"there is no photograph {', '.join(sorted(absent))} to leave out")


def _images(source: Path) -> Iterator[tuple[str, Image]]:
    """Names and images of one source."""
    if not source.is_file() or source.suffix.lower() in SUFFIXES:
        for path in picture_paths(source):
            yield str(path), Decoder().file(path)
        return
    with open_frames(source) as frames:
        every = max(1, (frames.count or 0) // FRAMES_OF_A_VIDEO)
        for frame in frames:
            if frame.number % every == 0:
                yield f"{source}:{frame.number}", frame.image
