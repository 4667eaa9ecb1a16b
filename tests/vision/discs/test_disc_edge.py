"""Centres of discs against pictures that are drawn exactly."""

from dataclasses import replace

import cv2
import numpy as np
import pytest
from scipy.stats import chi2

from pinnray.vision.discs.disc_fit import FittedDiscs, fit_discs
from tests.vision.discs.disc_images import DiscImage, Edge

COUNT = 60


def sheet(images: list[DiscImage], *, noise: float = 2.0) -> tuple[np.ndarray, np.ndarray]:
    """One noisy picture of all, side by side, and where its discs are."""
    rng = np.random.default_rng(7)
    shifts = np.cumsum([0, *(image.size[0] for image in images[:-1])])
    centres = np.array(
        [(x + image.centre[0], image.centre[1]) for x, image in zip(shifts, images, strict=True)]
    )
    return np.hstack([image.noisy(noise, rng) for image in images]), centres


def scattered(image: DiscImage, count: int = COUNT) -> list[DiscImage]:
    """The same at many places within a pixel."""
    offsets = np.random.default_rng(3).uniform(-0.5, 0.5, (count, 2))
    return [replace(image, centre=tuple(offset + image.centre)) for offset in offsets]


def guessed(centres: np.ndarray, radius: float, *, off: float = 0.6) -> np.ndarray:
    """Guesses that are off by that many pixels in any direction, and in the radius by up to a tenth."""
    rng = np.random.default_rng(5)
    angle = rng.uniform(0, 2 * np.pi, len(centres))
    shift = off * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    return np.column_stack([centres + shift, radius * rng.uniform(0.9, 1.1, len(centres))])


def measured(
    image: DiscImage, *, noise: float = 2.0, off: float = 0.6, **options
) -> tuple[FittedDiscs, np.ndarray]:
    """What was found of `COUNT` such discs, and the errors."""
    picture, centres = sheet(scattered(image), noise=noise)
    discs = fit_discs(picture, guessed(centres, image.radius, off=off), **options)
    return discs, discs.centres - centres


def assert_covered(discs: FittedDiscs, errors: np.ndarray) -> None:
    """The errors are what the covariances say, as far as their number can tell (99.8 % of cases)."""
    assert discs.found.all()
    scores = np.einsum("ni,nij,nj->", errors, np.linalg.inv(discs.covariances), errors)
    low, high = chi2.ppf([1e-3, 1 - 1e-3], errors.size)
    assert low < scores < high


@pytest.mark.parametrize(
    ("image", "noise"),
    [
        (DiscImage(), 2.0),
        (DiscImage(blur=1.5), 6.0),  # adverse
        (DiscImage(radius=3.5), 2.0),
        pytest.param(DiscImage(radius=30.0, centre=(45, 45), size=(91, 91)), 2.0, marks=pytest.mark.slow),
        (DiscImage(stretch=1.16, turn=0.7), 2.0),  # a strain of 10 %
        (DiscImage(gradient=(0.015, -0.01)), 2.0),  # light that changes by 30 % over the disc
        (DiscImage(light=40, dark=200), 2.0),
        (DiscImage(light=290), 2.0),  # saturated around the disc
    ],
)
def test_errors_are_what_the_covariances_say(image, noise):
    assert_covered(*measured(image, noise=noise))


@pytest.mark.parametrize("off", [2.0, 4.0, 6.0])
def test_a_guess_may_be_off_by_several_pixels(off):
    discs, errors = measured(DiscImage(), off=off)
    assert discs.found.all()
    assert np.abs(errors).max() < 0.04


def test_radius_and_contrast_are_recovered():
    picture, centres = sheet([DiscImage(stretch=1.1, turn=0.0, blur=0.9)], noise=0.0)
    discs = fit_discs(picture, guessed(centres, 8))
    assert discs.radii == pytest.approx([8], abs=0.01)
    assert discs.contrast == pytest.approx([120], abs=0.5)


@pytest.mark.parametrize(
    "image",
    [
        DiscImage(dark=180.0),  # nothing
        DiscImage(dark=180.0, gradient=(0.01, 0.01)),
        DiscImage(dark=180.0, edges=(Edge(0.3, 25.0, 60.0),)),  # an edge, no disc
        DiscImage(radius=16.0),  # too large
        DiscImage(centre=(20.0, -5.0)),  # nearly outside
        DiscImage(centre=(38.0, 20.0)),  # beyond reach
    ],
)
def test_what_is_not_there_is_not_found(image):
    picture, _ = sheet([image])
    discs = fit_discs(picture, [(20.0, 20.0, 8.0)])
    assert not discs.found.any()
    assert np.isnan(discs.centres).all()


WALL = tuple(Edge(angle, 20 * np.cos(angle) + 20 * np.sin(angle) + 9.9, 20.0) for angle in (0.4, 0.4 + np.pi))
"""Of a wall that ends 1.9 pixels from the disc on either side, before a dark ground."""


@pytest.mark.slow
@pytest.mark.parametrize(
    "image",
    [
        DiscImage(edges=WALL),
        DiscImage(edges=WALL, blur=1.5),  # disc and wall run into each other
        DiscImage(edges=tuple(replace(edge, level=240.0) for edge in WALL)),  # a light ground
        DiscImage(edges=(Edge(0.0, 29.9, 30.0), Edge(np.pi, -10.1, 220.0))),  # light and dark
    ],
)
def test_the_wall_beside_the_disc_does_not_move_it(image):
    discs, errors = measured(image)
    assert_covered(discs, errors)
    assert np.sqrt((errors**2).mean()) < (0.0105 if image.blur < 1 else 0.017)


@pytest.mark.parametrize("blur", [0.8, 1.5])
def test_a_wall_that_is_bent_does_not_move_the_disc(blur):
    """It is 0.014 and 0.053 pixels astray if its edges are taken for straight ones."""
    wall = tuple(replace(edge, curvature=sign * 0.004) for edge, sign in zip(WALL, (1, -1), strict=True))
    discs, errors = measured(DiscImage(edges=wall, blur=blur))
    assert_covered(discs, errors)
    assert np.abs(errors.mean(axis=0)).max() < 0.01


@pytest.mark.slow
@pytest.mark.parametrize(
    "image",
    [
        DiscImage(centre=(20, 0)),  # beyond the border
        DiscImage(edges=(Edge(0.0, 24.0, 120.0, occludes=True),)),
        DiscImage(edges=(Edge(0.0, 20.0, 120.0, occludes=True),)),  # of a level between light and dark
        DiscImage(edges=(Edge(0.3, 28.0, 240.0, occludes=True),)),
    ],
)
def test_a_disc_that_is_partly_hidden_is_found_by_its_arc(image):
    discs, errors = measured(image, radii=8.0)
    found = discs.found
    assert found.mean() > 0.9
    scores = np.einsum("ni,nij,nj->", errors[found], np.linalg.inv(discs.covariances[found]), errors[found])
    assert scores < chi2.ppf(1 - 1e-3, 2 * found.sum())  # the radius is better than it is said to be
    assert discs.seen[found].max() < 0.9


@pytest.mark.slow
def test_noise_that_a_codec_correlates_is_accounted_for():
    picture, centres = sheet(scattered(DiscImage(), 240))
    _, content = cv2.imencode(".jpg", picture, [cv2.IMWRITE_JPEG_QUALITY, 60])
    discs = fit_discs(cv2.imdecode(content, cv2.IMREAD_GRAYSCALE), guessed(centres, 8))
    scores = (discs.centres - centres) / np.sqrt(np.diagonal(discs.covariances, axis1=1, axis2=2))
    assert discs.found.all()
    assert 0.8 < np.sqrt((scores**2).mean()) < 1.3  # 1.48 if the noise were taken for white


@pytest.mark.slow
@pytest.mark.parametrize("radii", [None, 6.0])
def test_no_picture_is_too_odd(radii):
    rng = np.random.default_rng(2)
    squares = np.kron(rng.integers(0, 2, (20, 20)) * 255, np.ones((11, 11)))
    noise = rng.integers(0, 256, (220, 220))
    for picture in (squares, noise, np.zeros((220, 220)), np.full((220, 220), 255), squares[:3], noise[:1]):
        guesses = np.column_stack([rng.uniform(-30, 250, (9, 2)), rng.uniform(1, 12, 9)])
        discs = fit_discs(picture.astype(np.uint8), guesses, radii=radii)
        assert np.isfinite(discs.centres[discs.found]).all()
        assert discs.found.mean() < 0.05  # of white noise, chance makes a disc
