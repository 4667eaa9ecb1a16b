"""Frames and photographs of any source: a video file, pictures, a camera or a pipe."""

import os
import re
import sys
import time
from collections.abc import Iterable, Iterator
from functools import partial
from glob import has_magic
from itertools import chain, count, islice
from pathlib import Path

import cv2
import numpy as np

from pinnray.runtime.errors import UserError
from pinnray.vision.frames.decoder import Decoder, content_of, silenced
from pinnray.vision.frames.formats import pages
from pinnray.vision.frames.frame import (
    DEFAULT_RATE,
    MAX_RATE,
    CapturedImage,
    Frames,
    GreyImage,
    Image,
    ImageStream,
    plausible_rate,
)
from pinnray.vision.frames.pictures import images_of_files, images_of_pipe, is_picture, picture_paths
from pinnray.vision.frames.video import video_frames

LIVE_SIZE = (1280, 720)
"""(width, height) that a camera is asked for, pixels."""
FRAMES_OF_A_VIDEO = 40
"""Largest number of photographs from a video or from the pages of one picture, spread evenly."""


def open_frames(source: str | Path | int, *, rate: float | None = None) -> Frames:
    """Frames of a video, of pictures, of a camera or of a pipe.

    Args:
        source: A video file; a picture, whose pages are frames; a folder or glob of pictures, taken in
            natural order; the number of a camera, or its device; or "-", JPEG or PNG pictures one after
            another on standard input.
        rate: Frames a second, where the source does not say: of pictures and pipes, 30 if not given. A camera
            is asked for it, and for `LIVE_SIZE`.

    Raises:
        UserError: If there is no such source or nothing in it can be read.
    """
    if rate is not None and not 0 < rate <= MAX_RATE:
        raise UserError(f"a rate of {rate:g} frames a second; it must be above 0 and at most {MAX_RATE:g}")
    usual = rate or DEFAULT_RATE
    path = Path(str(source))
    if source == "-":
        if sys.stdin.isatty():
            raise UserError("nothing is piped to standard input; '-' reads JPEG or PNG pictures from there")
        name, read = "standard input", partial(os.read, sys.stdin.fileno())
        return Frames(name, images_of_pipe(read, name, usual), rate=usual, timed=rate is not None)
    camera = re.fullmatch(r"(?:/dev/video)?(\d+)", str(source))
    if camera and (isinstance(source, int) or not (path.is_file() or path.is_dir())):
        return camera_frames(int(camera[1]), rate)
    if path.is_file() and not is_picture(path):
        return video_frames(path, rate)
    if not str(source) or not (path.is_file() or path.is_dir() or has_magic(str(source))):
        raise UserError(f"{str(source)!r}: there is no such video, picture or folder")
    paths = picture_paths(str(source))
    number = len(paths) if len(paths) > 1 else len(pages(content_of(paths[0])))
    images = images_of_files(paths, usual)
    return Frames(str(source), images, rate=usual, count=number, timed=rate is not None)


def camera_frames(index: int, rate: float | None = None) -> Frames:
    """Frames of a camera as they come, by OpenCV; it is asked for `LIVE_SIZE` and a rate.

    PyAV opens Video4Linux devices, too, but refuses a camera without the requested format.

    Raises:
        UserError: If there is no such camera; on iterating, if it stops.
    """
    with silenced():
        capture = cv2.VideoCapture(index)
    if not capture.isOpened():
        raise UserError(f"camera {index} cannot be opened; is it connected, and not used by another program?")
    capture.set(cv2.CAP_PROP_FOURCC, cv2.VideoWriter.fourcc(*"MJPG"))  # over USB, raw images come slower
    capture.set(cv2.CAP_PROP_FRAME_WIDTH, LIVE_SIZE[0])
    capture.set(cv2.CAP_PROP_FRAME_HEIGHT, LIVE_SIZE[1])
    if rate is not None:
        capture.set(cv2.CAP_PROP_FPS, rate)
    rate = plausible_rate(capture.get(cv2.CAP_PROP_FPS), rate)
    return Frames(f"camera {index}", _images_of_camera(index, capture), rate=rate)


def _images_of_camera(index: int, capture: cv2.VideoCapture) -> ImageStream:
    try:
        for number in count():
            with silenced():
                done, image = capture.read()
            if not done:
                raise UserError(f"camera {index} gives no image after {number} frames")
            yield CapturedImage(np.asarray(image, dtype=np.uint8), time.monotonic(), f"frame {number}")
    finally:
        capture.release()


def photographs(sources: Iterable[Path]) -> Iterator[tuple[str, GreyImage]]:
    """Names and photographs, shape (height, width), as the sensor read them: never turned.

    Args:
        sources: Pictures, folders of them, patterns such as photos/*.jpg, or videos.

    Raises:
        UserError: If a source cannot be read.
    """
    for name, image in chain.from_iterable(map(_images, sources)):
        grey = image if image.ndim == 2 else cv2.cvtColor(image, cv2.COLOR_BGR2GRAY)
        yield name, np.asarray(grey, dtype=np.uint8)


def _images(source: Path) -> Iterator[tuple[str, Image]]:
    """Names and images of one source."""
    if not source.is_file() or is_picture(source):
        for path in picture_paths(source):
            content, label = content_of(path), f"the picture {path}"
            every = max(1, len(pages(content)) // FRAMES_OF_A_VIDEO)
            yield from islice(Decoder()(content, label, str(path)), None, None, every)
        return
    with open_frames(source) as frames:
        every = max(1, (frames.count or 0) // FRAMES_OF_A_VIDEO)
        for frame in frames:
            if frame.number % every == 0:
                yield f"{source}:{frame.number}", frame.image
