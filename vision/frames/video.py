"""Frames from wherever they come, and videos that hold every frame that was written."""

import os
import re
import sys
from contextlib import ExitStack
from functools import partial
from glob import glob, has_magic
from pathlib import Path
from typing import Self

import cv2
import numpy as np

from geometry.atomic import atomic_path
from geometry.errors import ShapeError, UserError
from vision.frames.capture import FASTEST, USUAL_RATE, camera_frames, video_frames
from vision.frames.frame import Frame, Frames, Image
from vision.frames.pictures import SUFFIXES, images_of_files, images_of_pipe, natural_order, pictures_in
from vision.frames.quiet_opencv import silenced

__all__ = ["CODECS", "Frame", "Frames", "VideoWriter", "open_frames"]

CODECS = {".mkv": "FFV1", ".avi": "MJPG", ".mp4": "mp4v"}
"""By the suffix of a video that is written. FFV1 is lossless."""

LIVE_SIZE = (1280, 720)


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
    if rate is not None and not 0 < rate <= FASTEST:
        raise UserError(f"a rate of {rate:g} frames a second; it must be above 0 and at most {FASTEST:g}")
    usual = rate or USUAL_RATE
    path = Path(str(source))
    if source == "-":
        if sys.stdin.isatty():
            raise UserError("nothing is piped to standard input; '-' reads JPEG or PNG pictures from there")
        name, read = "standard input", partial(os.read, sys.stdin.fileno())
        return Frames(name, images_of_pipe(read, name, usual), rate=usual)
    camera = re.fullmatch(r"(?:/dev/video)?(\d+)", str(source))
    if camera and (isinstance(source, int) or not (path.is_file() or path.is_dir())):
        return camera_frames(int(camera[1]), size=size, rate=rate)
    if path.is_dir() and str(source):
        paths = pictures_in(path)
    elif path.is_file() and path.suffix.lower() not in SUFFIXES:
        return video_frames(path, rate)
    elif path.is_file():
        paths = [path]
    elif has_magic(str(source)):
        paths = sorted(filter(Path.is_file, map(Path, glob(str(source)))), key=natural_order)
    else:
        raise UserError(f"{str(source)!r}: there is no such video, picture or folder")
    if not paths:
        raise UserError(f"{str(source)!r}: there is no such picture")
    return Frames(str(source), images_of_files(paths, usual), rate=usual, count=len(paths))


class VideoWriter:
    """Writes a video; when its block ends without an error, the file is there with every frame in it.

    None of the codecs has odd sides: the last column or row is then written twice, and coordinates stay.

    Args:
        path: Of the video; an old one stays until the new one is whole.
        size: (width, height) of the frames, pixels.
        rate: Frames a second.
        codec: ffv1, mjpg or mp4v; that of `CODECS` if not given.

    Raises:
        UserError: If the suffix, size or rate is impossible, the file cannot hold the codec, or, at the end,
            a frame is missing.
    """

    def __init__(
        self, path: str | Path, size: tuple[int, int], rate: float, codec: str | None = None
    ) -> None:
        self.path, self.size, self.rate, self.written = Path(path), size, rate, 0
        suffix = self.path.suffix.lower()
        codecs = {name.lower(): name for name in CODECS.values()}
        if suffix not in CODECS or (codec is not None and codec.lower() not in codecs):
            raise UserError(
                f"cannot write the video {path}{f' as {codec}' if codec else ''}; "
                "it can be .mkv (ffv1, lossless), .avi (mjpg) or .mp4 (mp4v)"
            )
        if not 0 < rate <= FASTEST or min(size) < 1:
            raise UserError(f"cannot write a video of {size[0]}x{size[1]} pixels, {rate:g} frames a second")
        self._codec = codecs[codec.lower()] if codec else CODECS[suffix]
        self._right, self._below = size[0] % 2, size[1] % 2
        self._whole_size = (size[0] + self._right, size[1] + self._below)

    def __enter__(self) -> Self:
        with ExitStack() as stack:
            self._partial = stack.enter_context(atomic_path(self.path))
            code = cv2.VideoWriter.fourcc(*self._codec)
            with silenced():
                self._writer = cv2.VideoWriter(
                    str(self._partial), cv2.CAP_FFMPEG, code, self.rate, self._whole_size
                )
            if not self._writer.isOpened():
                width, height = self.size
                raise UserError(
                    f"OpenCV cannot write {width}x{height} pixels as {self._codec} into {self.path}"
                )
            stack.push(self._finish)
            self._stack = stack.pop_all()
        return self

    def __exit__(self, *raised: object) -> None:
        self._stack.__exit__(*raised)  # type: ignore[arg-type]

    def write(self, image: Image) -> None:
        """Append a frame, grey or coloured.

        Raises:
            ShapeError: If it has another size.
        """
        if image.dtype != np.uint8 or image.shape[1::-1] != self.size:
            raise ShapeError(
                f"a frame for {self.path} is {image.dtype} of shape {image.shape}; it must be uint8 with "
                f"{self.size[0]}x{self.size[1]} pixels"
            )
        coloured = cv2.cvtColor(image, cv2.COLOR_GRAY2BGR) if image.ndim == 2 else image
        self._writer.write(cv2.copyMakeBorder(coloured, 0, self._below, 0, self._right, cv2.BORDER_REPLICATE))
        self.written += 1

    def _finish(self, kind: type[BaseException] | None, *_: object) -> None:
        """Count the frames of the file: OpenCV does not say when it could not write one."""
        self._writer.release()
        if kind is not None:
            return
        if not self.written:
            raise UserError(f"no frame was given for the video {self.path}")
        with silenced():
            capture = cv2.VideoCapture(str(self._partial), cv2.CAP_FFMPEG)
            found = 0
            while capture.grab():
                found += 1
            capture.release()
        if found != self.written:
            raise UserError(
                f"only {found} of {self.written} frames are in the video {self.path}; is the disk full?"
            )
