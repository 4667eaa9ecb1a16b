"""The similarity from the markers at rest to the drawing."""

import numpy as np
import pytest

from pinnray.geometry.picture_frame import FIXED, Homography
from pinnray.vision.tracking.alignment import LAID, align

DRAWN = np.array([[10.0, -1.0], [20.0, -20.0], [30.0, -1.0], [45.0, -14.0], [60.0, -1.0], [80.0, -2.0]])
OFF = Homography(np.array([40.0, -6.0]), np.array([0.4, 0.5, -0.3, 0.01, 0.0, 0.0]))


def test_a_similarity_is_found_without_those_that_were_not_seen():
    film = OFF.undone(DRAWN)
    film[2] = np.nan
    found = align(film, DRAWN)
    np.testing.assert_allclose(found.similarity.moved(OFF.undone(DRAWN)), DRAWN, atol=2e-4)
    np.testing.assert_allclose(found.similarity.values[[0, 3]], OFF.values[[0, 3]], rtol=1e-2)
    seen = np.isfinite(film[:, 0])
    assert found.before == pytest.approx(np.sqrt(((film - DRAWN)[seen] ** 2).sum(axis=1).mean()))
    assert found.after < 2e-4
    assert found.drawn == FIXED


def test_deviations_are_those_of_many_fits():
    random = np.random.default_rng(5)
    fits = [align(DRAWN + random.normal(0, 0.1, DRAWN.shape), DRAWN) for _ in range(2000)]
    values = np.array([fit.similarity.values for fit in fits])
    stated = np.array([[fit.known.turn, fit.known.shift, fit.known.scale] for fit in fits])
    scattered = values.std(axis=0)[[0, 1, 3]]
    np.testing.assert_allclose(np.sqrt((stated**2).mean(axis=0)), scattered, rtol=0.05)
    assert fits[0].drawn == fits[0].known


def test_what_the_markers_do_not_tell_stays_with_the_prior():
    """Near each other and off by a millimetre each, they tell nothing of turn and scale."""
    random = np.random.default_rng(5)
    close = np.array([[10.0, -1.0], [10.5, -1.0], [10.0, -1.5], [10.4, -1.6]])
    found = align(close + random.normal(0, 1.0, close.shape), close)
    turn, scale = np.abs(found.similarity.values[[0, 3]])
    assert turn < LAID.turn
    assert scale < LAID.scale
    assert found.known.scale == pytest.approx(LAID.scale, rel=0.01)


@pytest.mark.parametrize("count", [0, 1, 2])
def test_too_few_markers_align_nothing(count):
    film = np.full(DRAWN.shape, np.nan)
    film[:count] = DRAWN[:count]
    assert align(film, DRAWN) is None
