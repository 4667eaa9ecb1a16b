"""Means over frames at rest: their standard deviations against how far they really are from the truth."""

import itertools

import numpy as np
import pytest

from vision.discs.disc_detector import FLOOR, DiscDetections
from vision.tracking.frame_means import mean_detections

DISCS, REPEATS = 9, 200
DEVIATION = 0.01
"""Of a coordinate in one frame, pixels; `FLOOR` is small against it."""


def squares(errors):
    """Mean square of the means' errors over their variances; errors of the frames (f, n, 2)."""
    frames = [
        DiscDetections(
            centres=100 + DEVIATION * frame,
            covariances=np.repeat(DEVIATION**2 * np.eye(2)[None], len(frame), axis=0),
            radii=8.0 + 0 * frame[:, 0],
            contrasts=np.full(len(frame), 100.0),
        )
        for frame in errors
    ]
    mean = mean_detections(frames, "precise")
    variances = np.diagonal(mean.covariances, axis1=1, axis2=2)
    assert (variances > FLOOR["precise"] ** 2).all()
    return ((mean.centres - 100) ** 2 / variances).mean()


def following(rng, frames, correlation):
    """Errors (f, n, 2) of variance 1, each correlated with that of the frame before."""
    errors = rng.normal(size=(frames, DISCS, 2))
    for before, now in itertools.pairwise(errors):
        now *= np.sqrt(1 - correlation**2)
        now += correlation * before
    return errors


def mean_square(frames, errors_of):
    rng = np.random.default_rng(5)
    return np.mean([squares(errors_of(rng, frames)) for _ in range(REPEATS)])


@pytest.mark.parametrize("frames", [1, 3, 5, 30])
def test_independent_frames_reduce_the_noise(frames):
    value = mean_square(frames, lambda rng, count: rng.normal(size=(count, DISCS, 2)))
    assert 0.7 < value < 1.1  # chance looks like a common part now and then


@pytest.mark.parametrize("frames", [3, 5, 30])
def test_frames_that_are_copies_reduce_nothing(frames):
    value = mean_square(frames, lambda rng, count: np.repeat(rng.normal(size=(1, DISCS, 2)), count, axis=0))
    assert 0.9 < value < 1.1


@pytest.mark.parametrize("frames", [5, 30])
@pytest.mark.parametrize("share", [0.3, 0.7])
def test_what_all_frames_share_stays(frames, share):
    def errors(rng, count):
        common, own = rng.normal(size=(1, DISCS, 2)), rng.normal(size=(count, DISCS, 2))
        return np.sqrt(share) * common + np.sqrt(1 - share) * own

    assert 0.65 < mean_square(frames, errors) < 2  # as independent frames it would be at least 2.2 and 9.7


@pytest.mark.parametrize("every", [2, 3])
def test_frames_in_which_no_disc_was_seen_say_nothing(every):
    """Of those that are left none follows another, or every second one does; nothing is correlated."""

    def errors(rng, count):
        values = rng.normal(size=(count, DISCS, 2))
        values[::every] = np.nan
        return values

    assert 0.6 < mean_square(30, errors) < 1.1


@pytest.mark.parametrize("correlation", [0.5, 0.9])
def test_a_frame_that_follows_the_one_before_counts_for_less(correlation):
    value = mean_square(30, lambda rng, count: following(rng, count, correlation))
    assert 0.65 < value < 1.3  # as independent frames it would be 3 and 11


def test_a_disc_that_scatters_more_than_the_others_has_a_larger_standard_deviation():
    rng = np.random.default_rng(6)
    errors = rng.normal(size=(12, DISCS, 2))
    errors[:, 0] *= 4
    frames = [
        DiscDetections(
            100 + DEVIATION * frame,
            np.tile(DEVIATION**2 * np.eye(2), (DISCS, 1, 1)),
            *np.full((2, DISCS), 8.0),
        )
        for frame in errors
    ]
    deviations = np.sqrt(np.diagonal(mean_detections(frames, "precise").covariances, axis1=1, axis2=2)).mean(
        axis=1
    )
    assert deviations[0] > 2.5 * deviations[1:].max()
