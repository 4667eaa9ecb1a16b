"""Videos: what is written is read back, and what is damaged is told in one line."""

import os
import resource
import warnings
import wave
from pathlib import Path

import av
import cv2
import numpy as np
import pytest

from pinnray.runtime.errors import UserError
from pinnray.vision.frames.sources import open_frames
from pinnray.vision.frames.video import video_frames, video_writer

VIDEOS = Path(__file__).parent / "videos"
SIZE = (64, 48)


def smooth(count: int, size: tuple[int, int] = SIZE) -> list[np.ndarray]:
    """Frames in colour without sharp edges, none like another; uint8."""
    x, y = np.meshgrid(*map(np.arange, size))
    waves = [(x + 5 * n, y - 3 * n, x + y + 4 * n) for n in range(count)]
    return [np.rint(128 + 90 * np.sin(np.stack(wave, axis=2) / 9)).astype(np.uint8) for wave in waves]


def written(path: Path, frames: list[np.ndarray], rate: float = 25.0) -> Path:
    size = frames[0].shape[1::-1] if frames else SIZE
    with video_writer(path, size, rate) as write:
        for frame in frames:
            write(frame)
    return path


def read(path: Path) -> list[np.ndarray]:
    with open_frames(path) as frames:
        return [frame.image for frame in frames]


@pytest.mark.parametrize(
    ("name", "psnr"),
    [
        ("a.mkv", np.inf),  # lossless
        ("a.avi", 35),  # dB; 8 bits of these waves in MJPG
        ("A.MP4", 30),
    ],
)
def test_every_frame_comes_back(name, psnr, tmp_path):
    frames = smooth(7)
    path = written(tmp_path / name, frames)
    back = read(path)
    assert len(back) == 7
    assert min(map(cv2.PSNR, frames, back)) >= min(psnr, 360)  # OpenCV's infinity is about 361
    assert [file.name for file in tmp_path.iterdir()] == [name]
    with open_frames(path) as opened:
        assert opened.lossy == np.isfinite(psnr)


@pytest.mark.parametrize("rate", [1, 23.976, 59.94, 240])
@pytest.mark.parametrize("suffix", [".mkv", ".avi", ".mp4"])
def test_times_and_rate_come_back(rate, suffix, tmp_path):
    path = written(tmp_path / f"a{suffix}", smooth(5), rate)
    with open_frames(path) as frames:
        assert (frames.size, frames.count) == (SIZE, 5)
        assert frames.rate == pytest.approx(rate, rel=1e-3)
        times = [frame.time for frame in frames]
    assert times == pytest.approx(np.arange(5) / rate, abs=1.1e-3)  # Matroska has milliseconds


def test_grey_frames_and_odd_sides_keep_their_pixels(tmp_path):
    grey = [frame[:, :, 0] for frame in smooth(3, (65, 49))]
    back = read(written(tmp_path / "a.mkv", grey))
    assert back[0].shape == (50, 66, 3)
    for one, other in zip(grey, back, strict=True):
        np.testing.assert_array_equal(other[:49, :65], np.dstack([one] * 3))
        np.testing.assert_array_equal(other[49], other[48])


@pytest.mark.parametrize("name", ["h264_turned_variable_rate.mp4", "h264_variable_rate.mkv"])
def test_the_times_and_the_pixels_of_a_telephone_are_as_stored(name):
    """H.264, the first to be shown turned by 90 degrees; luma is 40 + 8 n, n = 0, 1, 5, 10, 15."""
    with open_frames(VIDEOS / name) as frames:
        assert frames.size == (48, 32)
        found = list(frames)
    n = np.array([0, 1, 5, 10, 15])
    assert [frame.time for frame in found] == pytest.approx(n / 25, abs=1e-3)
    levels = (24 + 8 * n) * 255 / 219  # of limited range, ITU-R BT.601
    assert [frame.image.mean() for frame in found] == pytest.approx(levels, abs=1.5)


def test_hevc_of_10_bits_is_read():
    """Luma is 160 + 240 n of 1023."""
    levels = (np.array([160, 400, 640]) / 4 - 16) * 255 / 219
    assert [image.mean() for image in read(VIDEOS / "hevc_10_bits.mp4")] == pytest.approx(levels, abs=1.5)


@pytest.mark.parametrize("suffix", [".mkv", ".avi"])
def test_a_truncated_video_is_read_as_far_as_it_goes(suffix, tmp_path):
    path = written(tmp_path / f"a{suffix}", smooth(40))
    whole = path.read_bytes()
    path.write_bytes(whole[: len(whole) // 2])
    assert 10 < len(read(path)) < 30


def test_whole_videos_do_not_warn(tmp_path):
    with warnings.catch_warnings(action="error"):
        read(written(tmp_path / "a.mkv", smooth(3), rate=59.94))
        read(VIDEOS / "h264_variable_rate.mkv")


def test_what_is_no_video_is_refused_and_ffmpeg_is_silent(tmp_path, capfd):
    whole = written(tmp_path / "a.mp4", smooth(5)).read_bytes()
    index, data = whole.rindex(b"moov"), whole.index(b"mdat") + 4
    blank = whole[:data] + bytes(index - 4 - data) + whole[index - 4 :]  # every frame overwritten
    matroska = written(tmp_path / "a.mkv", smooth(2)).read_bytes().replace(b"V_FFV1", b"V_NONE")
    for content in (whole[:index], blank, matroska, np.random.default_rng(0).bytes(9999)):
        (tmp_path / "a.mp4").write_bytes(content)
        with pytest.raises(UserError, match=r"a\.mp4"):
            open_frames(tmp_path / "a.mp4")
    assert capfd.readouterr().err == ""


@pytest.mark.parametrize(
    ("path", "thread_type"), [("damaged_ffv1.mkv", "SLICE"), ("h264_variable_rate.mkv", "AUTO")]
)
def test_threads_of_ffv1_share_a_frame(path, thread_type, monkeypatch):
    """With a frame each they corrupted memory at this file, one time in some thousand."""
    opened = []

    def remember(*given, _open=av.open, **named):
        opened.append(_open(*given, **named))
        return opened[-1]

    monkeypatch.setattr(av, "open", remember)
    with open_frames(VIDEOS / path) as frames:
        assert opened[0].streams.video[0].thread_type.name == thread_type
        assert len(list(frames)) >= 5


def test_a_file_without_pictures_is_closed(tmp_path):
    path = tmp_path / "a.wav"
    with wave.open(str(path), "wb") as sound:
        sound.setparams((1, 2, 8000, 0, "NONE", "not compressed"))
        sound.writeframes(bytes(800))
    with pytest.raises(UserError, match="it is no video"):
        video_frames(path)
    assert str(path) not in [os.path.realpath(each) for each in Path("/proc/self/fd").iterdir()]


@pytest.mark.parametrize("frames", [smooth(1) + smooth(1, (65, 48)), []])
def test_a_video_that_cannot_be_written_leaves_the_old_one(frames, tmp_path):
    path = tmp_path / "a.mkv"
    path.write_text("old")
    with pytest.raises(UserError):
        written(path, frames)
    assert path.read_text() == "old"
    assert [file.name for file in tmp_path.iterdir()] == ["a.mkv"]


@pytest.mark.parametrize("suffix", [".mkv", ".avi", ".mp4"])
def test_a_full_disk_is_noticed_and_leaves_nothing(suffix, tmp_path):
    """For a process that may write 20 kB, less than the frames need."""
    limit = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, limit[1]))
    try:
        with pytest.raises(UserError, match=r"cannot write 640x480 pixels .*: File too large"):
            written(tmp_path / f"a{suffix}", smooth(8, (640, 480)))
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limit)
    assert not list(tmp_path.iterdir())


NAMED = "secret.mkv"
PLAYLISTS = {
    "list.mkv": f"ffconcat version 1.0\nfile {NAMED}\n",  # known by its content, whatever its name
    "list.m3u8": f"#EXTM3U\n#EXT-X-TARGETDURATION:9\n#EXTINF:9,\n{NAMED}\n#EXT-X-ENDLIST\n",
    f"concat:{NAMED}": "x",  # names of FFmpeg's protocols
    f"subfile,,start,0,end,0,,:{NAMED}": "x",
    f"cache:{NAMED}": "x",
    "frame%d.tga": "x",  # all of a sequence
}


@pytest.mark.parametrize("name", PLAYLISTS)
def test_a_video_that_names_another_file_opens_nothing(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    written(Path(NAMED), smooth(3))
    Path("frame0.tga").write_bytes(bytes([0, 0, 2, *[0] * 9, 8, 0, 8, 0, 24, 0]) + bytes(8 * 8 * 3))
    Path(name).write_text(PLAYLISTS[name])
    with pytest.raises(UserError, match=r"cannot read the video|no frame of the video"):
        read(Path(name))


def test_a_video_larger_than_any_camera_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr("pinnray.vision.frames.video.MOST_PIXELS", 64 * 48 - 1)
    with pytest.raises(UserError, match="too large"):
        read(written(tmp_path / "a.mkv", smooth(1)))
