"""Pictures of several pages are films; photographs of formats that are not read are named, never left out."""

from pathlib import Path

import cv2
import numpy as np
import pytest
from PIL import Image

from pinnray.vision.frames.formats import pages
from pinnray.vision.frames.sources import open_frames, photographs

LEVELS = (10, 40, 70, 100, 130, 160)


def stack(path: Path, *, colour: bool = False, levels=LEVELS, **options) -> Path:
    """A picture of a page for every grey level."""
    shape = (12, 16, 3) if colour else (12, 16)
    images = [Image.fromarray(np.full(shape, level, np.uint8)) for level in levels]
    images[0].save(path, save_all=True, append_images=images[1:], **options)
    return path


def seen(source: Path | str) -> list[int]:
    with open_frames(source) as frames:
        return [int(frame.image.mean()) for frame in frames]


@pytest.mark.parametrize("colour", [False, True])
@pytest.mark.parametrize(
    ("name", "options"),
    [
        ("stack.tif", {}),
        ("stack.tif", {"compression": "tiff_lzw"}),
        ("stack.tif", {"big_tiff": True}),
        ("stack.stk", {"format": "TIFF"}),  # of MetaMorph
        ("moving.gif", {"duration": 50}),
    ],
)
def test_every_page_is_a_frame(tmp_path, name, options, colour):
    path = stack(tmp_path / name, colour=colour, **options)
    assert seen(path) == pytest.approx(LEVELS, abs=1)
    assert [int(image.mean()) for _, image in photographs([path])] == pytest.approx(LEVELS, abs=1)
    with open_frames(path) as frames:
        assert frames.count == 6
        assert {frame.image.ndim for frame in frames} <= {2, 3}


def test_stacks_of_a_folder_follow_each_other(tmp_path):
    stack(tmp_path / "run2.tif", levels=(50, 60))
    stack(tmp_path / "run1.tif", levels=(30, 40))
    stack(tmp_path / "run10.tif", levels=(70,))
    assert seen(tmp_path) == [30, 40, 50, 60, 70]
    names = [Path(name).name for name, _ in photographs([tmp_path])]
    assert names == ["run1.tif:0", "run1.tif:1", "run2.tif:0", "run2.tif:1", "run10.tif"]


def test_a_long_stack_gives_a_calibration_forty_pages(tmp_path):
    path = stack(tmp_path / "long.tif", levels=range(100))
    assert [int(image.mean()) for _, image in photographs([path])] == list(range(0, 100, 2))


def test_pages_of_16_bits_have_one_scale(tmp_path):
    path = tmp_path / "deep.tif"
    assert cv2.imwritemulti(str(path), [np.full((12, 16), level, np.uint16) for level in (1000, 500)])
    assert seen(path) == [249, 125]


def test_a_smaller_copy_is_no_page(tmp_path):
    """As of the tag NewSubfileType, which a thumbnail has."""
    path = tmp_path / "thumb.tif"
    small = Image.fromarray(np.full((3, 4), 9, np.uint8))
    small.encoderinfo = {"tiffinfo": {254: 1}}
    Image.fromarray(np.full((12, 16), 70, np.uint8)).save(path, save_all=True, append_images=[small])
    assert seen(path) == [70]
    assert list(pages(path.read_bytes())) == [0]
