"""Video files, read and written by PyAV, the Python binding of FFmpeg's libraries.

A frame is converted to blue, green, red by the matrix of ITU-R BT.601, whatever the file says, and is not
turned: bit for bit as by OpenCV, so that a colour picked from a camera is the same in its film. Only the
colour differences of HEVC with 10 bits are a fraction of a pixel beside OpenCV's.
"""

import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from fractions import Fraction
from io import BufferedReader
from pathlib import Path
from typing import cast

import av
import numpy as np
from av.container import InputContainer
from av.video import VideoStream
from av.video.reformatter import Colorspace, Interpolation, VideoReformatter

from pinnray.runtime.atomic import atomic_path
from pinnray.runtime.errors import ShapeError, UserError
from pinnray.vision import MOST_PIXELS
from pinnray.vision.frames.frame import (
    MAX_RATE,
    RIG_MARK,
    CapturedImage,
    Frames,
    Image,
    ImageStream,
    plausible_rate,
)

CODECS = {
    ".mkv": ("FFV1", "ffv1", "bgr0"),
    ".avi": ("MJPG", "mjpeg", "yuvj420p"),
    ".mp4": ("mp4v", "mpeg4", "yuv420p"),
}
"""Codec, FFmpeg's name of it and pixel format, by the suffix of a video that is written. FFV1 is lossless."""
BY_SLICES = ("ffv1",)
"""Decoders whose threads share a frame: with a frame for each, FFmpeg 8 corrupts memory at a damaged one."""
MIN_QUANTISER, BITS_PER_PIXEL = "3", 4
"""Best quality and highest bit rate of the lossy codecs, as OpenCV has them."""
ALONE = {"protocol_whitelist": "none"}
"""Option with which FFmpeg opens no file or address that a video names, as a play list does."""
MAX_TICKS = 65535
"""Of MPEG-4's clock in a second: the numerator of the rate."""


def video_frames(path: Path, rate: float | None = None) -> Frames:
    """Frames of a video file with the file's time stamps; `rate` counts if the file gives none.

    Nothing but the file is opened, whatever its content or its name says: FFmpeg takes `concat:a.mkv` for two
    files and `http:a` for an address, so that it gets the open file. Frames of more than `MOST_PIXELS` are
    not read.

    Raises:
        UserError: If it is no video, or not one frame can be read.
    """
    try:
        if not path.stat().st_size:
            raise UserError(f"cannot read the video {path}: the file is empty")
        file = path.open("rb")
    except OSError as error:
        raise UserError(f"cannot read the video {path}: {error.strerror}") from None
    try:
        container = av.open(file, "r", metadata_errors="ignore", options=ALONE)
    except (OSError, av.FFmpegError):
        container = None
    stream = container.streams.video[0] if container and container.streams.video else None
    if container is None or stream is None or stream.codec_context is None:
        if container is not None:
            container.close()
        file.close()
        raise UserError(
            f"cannot read the video {path}: it is no video, its end is missing, or FFmpeg lacks its codec"
        )
    stream.thread_type = "SLICE" if stream.codec.name in BY_SLICES else "AUTO"
    stream.codec_context.options = {"max_pixels": str(MOST_PIXELS)}
    rate = plausible_rate(float(stream.average_rate or 0), rate)
    duration = (container.duration or 0) / av.time_base
    count = stream.frames or round(duration * rate) or None
    images, lossy = _images_of_video(path, file, container, rate), bool(stream.codec.lossy)
    return Frames(str(path), images, rate=rate, count=count, lossy=lossy)


def _images_of_video(path: Path, file: BufferedReader, container: InputContainer, rate: float) -> ImageStream:
    """Images with increasing times: a frame without a later time follows the last one by 1 / `rate`."""
    read, last = 0, -math.inf
    reformatter, tick = VideoReformatter(), container.streams.video[0].time_base
    simulated = RIG_MARK in container.metadata.values()
    with file, container:
        for frame in _decoded(container):
            time = -math.inf if frame.pts is None or tick is None else float(frame.pts * tick)
            last = time if time > last else last + 1 / rate if read else 0.0
            image = reformatter.reformat(
                frame,
                format="bgr24",
                src_colorspace=Colorspace.ITU601,
                dst_colorspace=Colorspace.ITU601,
                interpolation=Interpolation.BICUBIC,
                threads=1,
            )
            array = np.ascontiguousarray(image.to_ndarray(), np.uint8)
            yield CapturedImage(array, last, f"frame {read}", simulated)
            read += 1
    if not read:
        raise UserError(
            f"no frame of the video {path} can be read: it is damaged, too large, or FFmpeg lacks its codec"
        )


def _decoded(container: InputContainer) -> Iterator[av.VideoFrame]:
    """Frames of the first video stream, without those that are damaged."""
    stream = container.streams.video[0]
    with suppress(av.FFmpegError):  # the end of the file is missing
        for packet in container.demux(stream):
            if packet.size:
                with suppress(av.FFmpegError):
                    yield from stream.decode(packet)
    with suppress(av.FFmpegError):
        yield from stream.decode(None)  # frames that the decoder still holds


@contextmanager
def video_writer(
    path: str | Path, size: tuple[int, int], rate: float, *, comment: str = ""
) -> Iterator[Callable[[Image], None]]:
    """Writes a video with the function that it gives: every call appends a frame, grey or coloured.

    When the block ends without an error, the file is there with every frame in it; an old one stays until
    then. None of the codecs has odd sides: the last column or row is then written twice.

    Args:
        path: Of the video.
        size: (width, height) of the frames, pixels.
        rate: Frames a second.
        comment: Text in the file's metadata.

    Raises:
        UserError: If the suffix, size or rate is impossible, or no frame is given or can be written.
        ShapeError: If a frame has another size.
    """
    path, (width, height) = Path(path), size
    suffix = path.suffix.lower()
    if suffix not in CODECS:
        raise UserError(
            f"cannot write the video {path}; it can be .mkv (ffv1, lossless), .avi (mjpg) or .mp4 (mp4v)"
        )
    if not 0 < rate <= MAX_RATE or min(size) < 1:
        raise UserError(f"cannot write a video of {width}x{height} pixels, {rate:g} frames a second")
    name, encoder, pixel_format = CODECS[suffix]
    right, below = width % 2, height % 2
    written = 0

    def write(image: Image) -> None:
        nonlocal written
        if image.dtype != np.uint8 or image.shape[1::-1] != size:
            raise ShapeError(
                f"a frame for {path} is {image.dtype} of shape {image.shape}; it must be uint8 with "
                f"{width}x{height} pixels"
            )
        coloured = np.broadcast_to(np.atleast_3d(image), (height, width, 3))
        whole = np.pad(coloured, ((0, below), (0, right), (0, 0)), mode="edge")
        container.mux(stream.encode(av.VideoFrame.from_ndarray(whole, format="bgr24")))
        written += 1

    with atomic_path(path) as partial:
        try:
            with av.open(str(partial), "w") as container:
                if comment:
                    container.metadata["comment"] = comment
                fraction = Fraction(rate).limit_denominator(int(MAX_TICKS / max(rate, 1)))
                stream = cast(VideoStream, container.add_stream(encoder, fraction, {"qmin": MIN_QUANTISER}))
                stream.width, stream.height = width + right, height + below
                stream.pix_fmt = pixel_format
                stream.bit_rate = round(BITS_PER_PIXEL * rate * width * height)
                stream.codec_context.open()
                yield write
                if not written:
                    raise UserError(f"no frame was given for the video {path}")
                container.mux(stream.encode())
        except av.FFmpegError as error:
            raise UserError(
                f"cannot write {width}x{height} pixels as {name} into {path}: {error.strerror}"
            ) from None
