"""Colours in CIELAB against its definition, and darkness under uneven light."""

import numpy as np
import pytest

from pinnray.vision.discs.colour import DARK, ColourRange, read_colour
from tests.vision.discs.dots import dots

WHITE = (0.95047, 1.0, 1.08883)
"""XYZ of D65."""
XYZ_OF_RGB = np.array(
    [[0.4124564, 0.3575761, 0.1804375], [0.2126729, 0.7151522, 0.0721750], [0.0193339, 0.1191920, 0.9503041]]
)


def cielab(bgr: np.ndarray) -> np.ndarray:
    """CIELAB of sRGB by its definition (IEC 61966-2-1, CIE 15), shape (..., 3)."""
    rgb = bgr[..., ::-1] / 255
    linear = np.where(rgb <= 0.04045, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4)
    t = linear @ XYZ_OF_RGB.T / WHITE
    f = np.where(t > (6 / 29) ** 3, np.cbrt(t), t / (3 * (6 / 29) ** 2) + 4 / 29)
    return np.stack(
        [116 * f[..., 1] - 16, 500 * (f[..., 0] - f[..., 1]), 200 * (f[..., 1] - f[..., 2])], axis=-1
    )


@pytest.mark.parametrize(
    ("low", "high"),
    [
        ((20, -10, -30), (70, 40, 20)),
        ((0, -128, -128), (40, 127, 127)),  # dark, of any colour
        ((50, 20, 10), (100, 127, 127)),
    ],
)
def test_a_range_selects_what_cielab_says(low, high):
    image = np.random.default_rng(0).integers(0, 256, (120, 160, 3), dtype=np.uint8)
    distance = np.minimum(cielab(image) - low, np.array(high) - cielab(image)).min(axis=2)
    mask = ColourRange(low, high).mask(image)
    clear = np.abs(distance) > 1  # beyond the rounding to 8 bits
    assert clear.mean() > 0.9
    np.testing.assert_array_equal(mask[clear], np.where(distance > 0, 255, 0)[clear])


def test_a_grey_image_is_judged_by_its_lightness_alone():
    grey = np.arange(256, dtype=np.uint8)[None]
    exact = cielab(np.repeat(grey[..., None], 3, axis=2))[..., 0]
    mask = ColourRange((30, 50, 50), (60, 60, 60)).mask(grey)
    clear = (np.abs(exact - 30) > 0.4) & (np.abs(exact - 60) > 0.4)
    np.testing.assert_array_equal((mask > 0)[clear], ((exact > 30) & (exact < 60))[clear])


@pytest.mark.parametrize("grey", [False, True])
def test_dark_is_what_is_darker_than_around_it_whatever_the_light(grey):
    image, discs = dots(7.6, shading=0.9, size=(960, 540))
    mask = DARK.mask(image[:, :, 0] if grey else image, radius=19)
    rows, columns = np.indices(mask.shape)
    nearest = np.min([np.hypot(columns - x, rows - y) - r for x, y, r in discs], axis=0)
    assert (mask[nearest < -2] == 255).all()
    far = mask[nearest > 30]
    assert (far == 0).mean() > 0.995
    assert image[nearest > 30].min() < image[nearest < -2].max()  # no single threshold would do


@pytest.mark.parametrize(
    ("text", "colour"),
    [
        ("dark", DARK),
        (" Dark ", DARK),
        ("0,40", ColourRange((0, -128, -128), (40, 127, 127))),
        ("20,60:40,80", ColourRange((20, 40, -128), (60, 80, 127))),
        ("20,60:40,80:-30.5,-10", ColourRange((20, 40, -30.5), (60, 80, -10))),
    ],
)
def test_a_colour_is_read_from_text_and_written_as_text(text, colour):
    assert read_colour(text) == colour
    assert read_colour(str(colour)) == colour
