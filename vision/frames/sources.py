"""Frames of any source: a video file, pictures, a camera or a pipe."""

import os
import re
import sys
from functools import partial
from glob import has_magic
from pathlib import Path

from geometry.errors import UserError
from vision.frames.frame import DEFAULT_RATE, MAX_RATE, Frames
from vision.frames.live_camera import camera_frames
from vision.frames.pictures import SUFFIXES, images_of_files, images_of_pipe, picture_paths
from vision.frames.video import video_frames

LIVE_SIZE = (1280, 720)
"""(width, height) that a camera is asked for, pixels."""


def open_frames(
    source: str | Path | int, *, rate: float | None = None, size: tuple[int, int] = LIVE_SIZE
) -> Frames:
    """Frames of a video, of pictures, of a camera or of a pipe.

    Args:
        source: A video file; a picture; a folder or glob of pictures, taken in natural order; the number of a
            camera, or its device; or "-", JPEG or PNG pictures one after another on standard input.
        rate: Frames a second, where the source does not say: of pictures and pipes, 30 if not given. A camera
            is asked for it.
        size: (width, height) that a camera is asked for, pixels.

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
        return Frames(name, images_of_pipe(read, name, usual), rate=usual)
    camera = re.fullmatch(r"(?:/dev/video)?(\d+)", str(source))
    if camera and (isinstance(source, int) or not (path.is_file() or path.is_dir())):
        return camera_frames(int(camera[1]), size=size, rate=rate)
    if path.is_file() and path.suffix.lower() not in SUFFIXES:
        return video_frames(path, rate)
    if not str(source) or not (path.is_file() or path.is_dir() or has_magic(str(source))):
        raise UserError(f"{str(source)!r}: there is no such video, picture or folder")
    paths = picture_paths(str(source))
    return Frames(str(source), images_of_files(paths, usual), rate=usual, count=len(paths))
