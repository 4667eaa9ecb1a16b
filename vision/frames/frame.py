"""Frames of one source: a file, a folder, a camera or a pipe.

Images are uint8, shape (height, width) in grey or (height, width, 3) in blue, green, red. They are as the
sensor read them: a rotation in a file's metadata is ignored, in films and in photographs
(`pinnray.vision.frames.sources`), so that one calibration fits both.
"""

from collections.abc import Generator, Iterator
from contextlib import AbstractContextManager
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pinnray.runtime.errors import UserError

Image = NDArray[np.uint8]
GreyImage = NDArray[np.uint8]

RIG_MARK = "simulated by pinnray rig"
"""Mark of the virtual rig, in the metadata of its videos and pictures."""
DEFAULT_RATE = 30.0
MAX_RATE = 1000.0
"""Frames a second; a higher rate in a file is taken for an error."""


class Frame(NamedTuple):
    """One image of a sequence.

    Attributes:
        number: From 0.
        time: Since the first frame, s.
        image: Shape (height, width) or (height, width, 3).
    """

    number: int
    time: float
    image: Image


class CapturedImage(NamedTuple):
    """An image from a source, its time, s, its name in messages, and whether it carries `RIG_MARK`."""

    image: Image
    time: float
    name: str
    simulated: bool = False


ImageStream = Generator[CapturedImage, None, None]


class Frames(AbstractContextManager["Frames"]):
    """A sequence of frames of one size, to be iterated once and closed: a context manager.

    Attributes:
        name: Of the source, for messages.
        size: (width, height), pixels.
        rate: Frames a second, from the source or the user.
        count: Number of frames by the source; None for a camera or a pipe. It can be wrong for a video with
            a variable rate.
        lossy: True for a video whose codec changes images: alike in frames that repeat each other.
        timed: False if neither the source nor the user says the rate: `DEFAULT_RATE` is assumed.
        simulated: True if the first frame carries `RIG_MARK`: no camera was involved.

    Raises:
        UserError: If the source has no frame; on iterating, if an image cannot be read or has another size.
    """

    def __init__(
        self,
        name: str,
        images: ImageStream,
        *,
        rate: float,
        count: int | None = None,
        lossy: bool = False,
        timed: bool = True,
    ) -> None:
        self.name, self.rate, self.count, self.lossy, self.timed = name, rate, count, lossy, timed
        self._images = images
        first = next(images, None)
        if first is None:
            raise UserError(f"{name} has no frame that can be read")
        self._first = first
        self.size, self.simulated = _size(first.image), first.simulated

    def __iter__(self) -> Iterator[Frame]:
        yield Frame(0, 0.0, self._first.image)
        for number, captured in enumerate(self._images, start=1):
            if _size(captured.image) != self.size:
                (w, h), (width, height) = self.size, _size(captured.image)
                raise UserError(
                    f"{self._first.name} has {w}x{h} pixels and {captured.name} {width}x{height}; "
                    "frames of one sequence must have one size"
                )
            yield Frame(number, captured.time - self._first.time, captured.image)

    def close(self) -> None:
        """Release the file or the camera."""
        self._images.close()

    def __exit__(self, *_: object) -> None:
        self.close()


def plausible_rate(said: float, given: float | None) -> float:
    """Frames a second: as the source says if that is possible, else as the user gave, else the default."""
    return said if 0 < said <= MAX_RATE else given or DEFAULT_RATE


def _size(image: Image) -> tuple[int, int]:
    return image.shape[1], image.shape[0]
