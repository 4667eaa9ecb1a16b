"""Photographs from wherever they come."""

import cv2
import numpy as np
import pytest

from pinnray.vision.frames.sources import FRAMES_OF_A_VIDEO, photographs
from pinnray.vision.frames.video import video_writer


@pytest.fixture
def folder(tmp_path):
    for number in (1, 2, 10):
        cv2.imwrite(str(tmp_path / f"{number}.png"), np.full((20, 30, 3), (10 * number, 0, 0), np.uint8))
    return tmp_path


def names(sources, **options):
    return [name.rsplit("/", 1)[-1] for name, _ in photographs(sources, **options)]


def test_folders_patterns_and_files_are_in_the_order_of_their_numbers(folder):
    assert names([folder]) == ["1.png", "2.png", "10.png"]
    assert names([folder / "1*.png", folder / "2.png"]) == ["1.png", "10.png", "2.png"]


def test_photographs_are_grey(folder):
    (_, image), *_ = photographs([folder / "10.png"])
    assert image.shape == (20, 30)
    assert np.unique(image).tolist() == [11]  # 0.114 of blue


def test_a_video_gives_frames_spread_evenly(tmp_path):
    with video_writer(tmp_path / "board.mkv", (32, 24), 30) as write:
        for number in range(130):
            write(np.full((24, 32), number, np.uint8))
    found = list(photographs([tmp_path / "board.mkv"]))
    assert FRAMES_OF_A_VIDEO <= len(found) <= 1.2 * FRAMES_OF_A_VIDEO
    assert [name.rsplit(":", 1)[1] for name, _ in found[:3]] == ["0", "3", "6"]
    assert found[1][1].mean() == pytest.approx(3, abs=1)
