"""Darkness and lightness under uneven light."""

import numpy as np
import pytest

from pinnray.vision.discs.colour import DARK, LIGHT
from tests.vision.discs.dots import dots


@pytest.mark.parametrize("colour", [DARK, LIGHT])
@pytest.mark.parametrize("grey", [False, True])
def test_discs_are_what_differs_from_around_it_whatever_the_light(grey, colour):
    image, discs = dots(7.6, shading=0.9, size=(960, 540))
    image = 255 - image if colour is LIGHT else image
    mask = colour.mask(image[:, :, 0] if grey else image, radius=19)
    rows, columns = np.indices(mask.shape)
    nearest = np.min([np.hypot(columns - x, rows - y) - r for x, y, r in discs], axis=0)
    assert (mask[nearest < -2] == 255).all()
    far = mask[nearest > 30]
    assert (far == 0).mean() > 0.99  # the rest are corners of the wall
    inside, outside = (image[nearest < -2], image[nearest > 30])[:: 1 if colour is DARK else -1]
    assert outside.min() < inside.max()  # no single threshold would do
