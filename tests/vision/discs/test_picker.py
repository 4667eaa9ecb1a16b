"""The picker: the range of a marker that was pointed at holds it and leaves out the rest."""

import cv2
import numpy as np
import pytest

from pinnray.vision.discs.colour import ColourRange, read_colour
from pinnray.vision.discs.colour_picker import pick_colour
from tests.vision.discs.dots import Dots, dots

COLOURS = {
    "black": (45, 45, 45),
    "red": (40, 40, 200),
    "blue": (190, 90, 30),
    "green": (60, 150, 40),
    "yellow": (40, 200, 220),
}
"""Blue, green, red."""


def shares(scene: Dots, image: np.ndarray, colour: ColourRange) -> tuple[float, float]:
    """Of the markers' insides, the least share that is selected; and the share of all that is no disc."""
    mask = colour.mask(cv2.medianBlur(image, 3)) > 0
    rows, columns = np.indices(mask.shape)
    away = np.array([np.hypot(columns - x, rows - y) - r for x, y, r in scene.discs])
    return min(mask[distance < -2].mean() for distance in away[:9]), mask[away.min(axis=0) > 3].mean()


@pytest.mark.parametrize(("name", "radius"), zip([*COLOURS, "grey"], 3 * [5.0, 12.0], strict=True))
def test_a_click_into_one_marker_selects_all_and_nothing_else(name, radius):
    scene = dots(radius, colour=COLOURS.get(name, COLOURS["black"]), size=(640, 360))
    image = scene.image[:, :, 1] if name == "grey" else scene.image
    x, y, _ = scene.discs[4]
    inside, outside = shares(scene, image, pick_colour(image, (x + 1, y - 1)))
    assert inside > 0.9
    assert outside < 0.005


def test_a_colour_is_read_back():
    scene = dots(12.0, colour=COLOURS["red"], size=(640, 360))
    clicked = pick_colour(scene.image, scene.discs[4, :2])
    assert read_colour(str(clicked)) == clicked


def lightness(grey: int) -> float:
    return 116 * (((grey / 255 + 0.055) / 1.055) ** 2.4) ** (1 / 3) - 16


def test_the_range_ends_half_way_to_what_is_around():
    """Grey 120 on 180: L* 50 and 73."""
    scene = dots(
        12.0, colour=(120,) * 3, wall=180.0, background=180.0, noise=1.0, shading=0.0, size=(640, 360)
    )
    colour = pick_colour(scene.image, scene.discs[4, :2])
    assert colour.high[0] == pytest.approx((lightness(120) + lightness(180)) / 2, abs=1.5)
    assert colour.low[0] == pytest.approx(lightness(120) - 25, abs=1.5)


def test_what_is_not_connected_to_the_click_does_not_count():
    scene = dots(12.0, colour=(120,) * 3, size=(640, 360))
    x, y, _ = scene.discs[4]
    alone = pick_colour(scene.image, (x, y))
    scene.image[250:, 450:] = 135
    assert pick_colour(scene.image, (x, y)) == alone
