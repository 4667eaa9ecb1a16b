"""Sequences of pictures from files and from a pipe."""

import io
import os
import warnings
from pathlib import Path

import cv2
import numpy as np
import pytest

from pinnray.runtime.errors import UserError
from pinnray.vision.frames.decoder import Decoder
from pinnray.vision.frames.pictures import split
from pinnray.vision.frames.sources import open_frames


def encoded(
    level: int, suffix: str = ".png", *, shape: tuple[int, ...] = (6, 8), dtype: type = np.uint8
) -> bytes:
    done, content = cv2.imencode(suffix, np.full(shape, level, dtype))
    assert done
    return content.tobytes()


def levels(source: str | Path, **options: float) -> list[int]:
    with open_frames(source, **options) as frames:
        return [int(frame.image.mean()) for frame in frames]


def piped(content: bytes, monkeypatch: pytest.MonkeyPatch) -> None:
    """Let `content` come in on standard input."""
    reader, writer = os.pipe()
    os.write(writer, content)
    os.close(writer)
    monkeypatch.setattr("sys.stdin", os.fdopen(reader, "r"))


def test_pictures_come_by_number_and_other_files_are_passed_over(tmp_path):
    for number in (1, 2, 10):
        (tmp_path / f"shot{number}.PNG").write_bytes(encoded(10 * number))
    for name in ("truth.json", ".shot3.PNG"):
        (tmp_path / name).write_text("no picture")
    assert levels(tmp_path) == [10, 20, 100]
    assert levels(f"{tmp_path}/shot1*") == [10, 100]
    assert levels(tmp_path / "shot2.PNG") == [20]
    with open_frames(tmp_path, rate=10) as frames:
        assert (frames.count, frames.rate, frames.size) == (3, 10, (8, 6))
        assert [(frame.number, frame.time) for frame in frames] == [(0, 0), (1, 0.1), (2, 0.2)]


@pytest.mark.parametrize("suffix", [".png", ".jpg", ".tiff", ".bmp", ".webp"])
def test_pictures_in_grey_and_in_colour(suffix, tmp_path):
    (tmp_path / f"a{suffix}").write_bytes(encoded(70, suffix))
    (tmp_path / f"b{suffix}").write_bytes(encoded(90, suffix, shape=(6, 8, 3)))
    assert levels(tmp_path) == pytest.approx([70, 90], abs=1)


@pytest.mark.parametrize(("white", "bits"), [(300, 10), (3000, 12), (16383, 14), (65535, 16)])
def test_16_bits_become_8_by_one_scale(white, bits, tmp_path):
    (tmp_path / "1.png").write_bytes(encoded(white, dtype=np.uint16))
    (tmp_path / "2.tif").write_bytes(encoded(white // 3, ".tif", dtype=np.uint16))
    expected = 255 / (2**bits - 1) * np.array([white, white // 3])
    with open_frames(tmp_path) as frames:
        found = [frame.image for frame in frames]
    assert [image.dtype for image in found] == [np.uint8] * 2
    assert [image.mean() for image in found] == pytest.approx(expected, abs=0.5)


def with_preview(picture: bytes) -> bytes:
    """A JPEG with another, whole one in a segment, as cameras make them."""
    segment = b"Exif\0\0" + encoded(1, ".jpg")
    return picture[:2] + b"\xff\xe1" + (len(segment) + 2).to_bytes(2, "big") + segment + picture[2:]


@pytest.mark.parametrize("step", [1, 7, 100000])
def test_a_stream_is_cut_between_its_pictures(step):
    noise = np.random.default_rng(0).integers(0, 256, (40, 40, 3), dtype=np.uint8)
    restarts = cv2.imencode(".jpg", noise, [cv2.IMWRITE_JPEG_RST_INTERVAL, 2])[1].tobytes()
    pictures = [encoded(1), with_preview(restarts), encoded(3, ".jpg"), encoded(4)]
    stream = io.BytesIO(b"".join(pictures))
    assert list(split(lambda _: stream.read(step), "pipe")) == pictures


def test_pictures_are_read_from_standard_input(monkeypatch):
    piped(encoded(10, ".jpg") + encoded(20, ".jpg"), monkeypatch)
    with warnings.catch_warnings(action="error"):
        assert levels("-") == pytest.approx([10, 20], abs=1)


@pytest.mark.parametrize("content", [b"", b"RIFF, which is no picture"])
def test_a_pipe_without_pictures_is_refused(content, monkeypatch):
    piped(content, monkeypatch)
    with pytest.raises(UserError, match="standard input"):
        open_frames("-")


def test_a_pipe_that_was_interrupted_keeps_its_whole_pictures(monkeypatch):
    piped(encoded(10) + encoded(20)[:-3], monkeypatch)
    with pytest.warns(UserWarning, match="ended within a picture"):
        assert levels("-") == [10]


def test_a_note_to_turn_a_photograph_is_not_followed():
    turn = b"Exif\0\0II*\0\x08\0\0\0\x01\0\x12\x01\x03\0\x01\0\0\0\x06\0\0\0\0\0\0\0"  # orientation 6
    picture = encoded(1, ".jpg")
    turned = picture[:2] + b"\xff\xe1" + (len(turn) + 2).to_bytes(2, "big") + turn + picture[2:]
    assert cv2.imdecode(np.frombuffer(turned, np.uint8), cv2.IMREAD_COLOR).shape == (8, 6, 3)
    assert [image.shape for _, image in Decoder()(turned, "a", "a")] == [(6, 8)]
