"""Annotations of tracked markers, measured in the image: places, sizes and colours."""

from collections.abc import Sequence

import numpy as np
import pytest

from pinnray.runtime.arrays import BoolArray, FloatArray
from pinnray.vision.discs.disc_detector import DiscDetections
from pinnray.vision.frames.frame import Image
from pinnray.vision.tracking.annotation import annotated
from pinnray.vision.tracking.frame_tracker import FrameDetections
from tests.vision.tracking.listed_discs import discs_at

GREEN, RED, BLUE, VIOLET, DARK = (40, 150, 0), (0, 60, 230), (200, 110, 0), (190, 0, 190), (30, 30, 30)
"""Markers, lost markers, fiducials, trajectories and text; written again here, in blue, green, red."""
GREY = 150


def blank(width: int = 1280, height: int = 300) -> Image:
    return np.full((height, width, 3), GREY, dtype=np.uint8)


def discs(places: Sequence[tuple[float, float, float]]) -> DiscDetections:
    """Discs at x, y with a radius; nan for those not seen."""
    table = np.array(places, dtype=np.float64).reshape(-1, 3)
    return discs_at(table[:, :2], radius=table[:, 2])


def drawn(
    image: Image,
    markers: Sequence[tuple[float, float, float]] = (),
    guesses: Sequence[tuple[float, float]] = (),
    fiducials: Sequence[tuple[float, float, float]] | None = None,
    text: Sequence[str] = (),
    trajectories: Sequence[FloatArray] = (),
) -> Image:
    places = np.reshape(guesses, (-1, 2)).astype(float)
    found = None if fiducials is None else discs(fiducials)
    return annotated(
        image, FrameDetections(discs(markers), found, places, places), text, trajectories=trajectories
    )


def painted(image: Image, colour: tuple[int, int, int]) -> BoolArray:
    """Mask of the pixels of the last axis that have at least half of a colour, over the grey."""
    whole, paint = image.astype(float) - GREY, np.array(colour, dtype=float) - GREY
    share = whole @ paint / (paint @ paint)
    return np.asarray((share > 0.5) & (np.linalg.norm(whole - share[..., None] * paint, axis=-1) < 20))


def box(image: Image, colour: tuple[int, int, int]) -> list[int]:
    """Left, top, right and bottom of the pixels of a colour."""
    rows, columns = np.nonzero(painted(image, colour))
    assert len(rows), f"no pixel is {colour}"
    return [int(columns.min()), int(rows.min()), int(columns.max()), int(rows.max())]


def has(image: Image, colour: tuple[int, int, int]) -> bool:
    return bool(painted(image, colour).any())


def test_the_image_itself_stays_as_it_is_and_a_grey_one_becomes_coloured() -> None:
    image, grey = blank(), np.full((300, 1280), GREY, dtype=np.uint8)
    marks = ([(300.0, 100.0, 20.0)], [(300.0, 100.0)])
    first, second = drawn(image, *marks), drawn(grey, *marks)
    assert (image == GREY).all()
    np.testing.assert_array_equal(first, second)
    assert has(first, GREEN)
    np.testing.assert_array_equal(drawn(image, fiducials=[(np.nan, np.nan, np.nan)]), image)


@pytest.mark.parametrize(("width", "line"), [(1280, 1), (2560, 5), (320, 1)])
def test_a_marker_is_circled_at_its_edge_with_a_line_as_wide_as_the_image_asks_for(width, line):
    image = drawn(blank(width), [(200.0, 120.0, 60.0)], [(200.0, 120.0)])
    edge = np.nonzero(painted(image[120, 200:], GREEN))[0]
    assert abs(edge.mean() - 60) <= 0.5
    assert len(edge) == line
    assert not (image[120, 205:250] != GREY).any()
    assert abs(np.nonzero(painted(image[120:, 200], GREEN))[0].mean() - 60) <= 0.5


def test_fiducials_are_circled_in_their_colour_and_hidden_ones_are_not() -> None:
    image = drawn(blank(), fiducials=[(900.0, 150.0, 40.0), (np.nan, np.nan, np.nan)])
    assert box(image, BLUE) == pytest.approx([860, 110, 940, 190], abs=1)
    assert not has(image, GREEN)
    assert not has(drawn(blank(), [(900.0, 150.0, 40.0)], [(900.0, 150.0)]), BLUE)


def test_a_trajectory_is_an_open_line_over_the_frames_that_show_the_marker() -> None:
    """Three sides of a square, with a gap that is bridged; the fourth side stays open."""
    corners = np.array([[100, 100], [200, 100], [np.nan, np.nan], [200, 200], [100, 200]], dtype=float)
    image = drawn(blank(), trajectories=[corners])
    assert box(image, VIOLET) == [100, 100, 200, 200]
    assert painted(image[150, 200], VIOLET)
    assert (image[150, 90:110] == GREY).all()


def test_a_lost_marker_is_crossed_where_it_is_expected() -> None:
    """Two diagonals of 16 pixels, none of them horizontal."""
    image = drawn(blank(), [(np.nan, np.nan, np.nan)], [(640.4, 149.6)])
    cross = image[140:161, 630:651]
    assert painted(cross[10, 10], RED)
    for step in (-7, 7):
        assert painted(cross[10 + step, 10 + step], RED)
        assert painted(cross[10 + step, 10 - step], RED)
        assert (cross[10, 10 + step] == GREY).all()
    assert not has(image, GREEN)
    reach = np.nonzero(painted(image[150:], RED).any(axis=0))[0]  # below the number
    assert (reach.min(), reach.max()) == (632, 648)
