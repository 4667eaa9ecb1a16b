"""Means over frames of series whose scatter and autocorrelation are known: closed forms and chance."""

from itertools import pairwise

import numpy as np
import pytest
from scipy.stats import chi2

from pinnray.runtime.arrays import FloatArray
from pinnray.vision.discs.disc_detector import FLOOR, DetectionMethod, DiscDetections
from pinnray.vision.tracking.frame_means import LOSSY, mean_detections

DEVIATION = 0.01
"""Of a coordinate in one frame, pixels."""


def frames_of(
    errors: FloatArray, sizes: tuple[float, ...] = (), radii: float = 8.0, contrast: float = 100.0
) -> list[DiscDetections]:
    """Frames with errors in standard deviations, shape (f, n, 2), nan for hidden discs, about (100, 100)."""
    count = errors.shape[1]
    scale = DEVIATION * np.sqrt(sizes or np.ones(count))
    return [
        DiscDetections(
            centres=100 + scale[:, None] * frame,
            covariances=np.where(np.isnan(frame[:, :1, None]), np.nan, scale[:, None, None] ** 2 * np.eye(2)),
            radii=np.where(np.isnan(frame[:, 0]), np.nan, radii),
            contrasts=np.where(np.isnan(frame[:, 0]), np.nan, contrast),
        )
        for frame in errors
    ]


def shares(frames: list[DiscDetections], method: DetectionMethod = "precise") -> FloatArray:
    """Variances of the means less the floor over those of one frame, shape (n,)."""
    found, covariance = mean_detections(frames, method).covariances, np.nanmean
    one = covariance([frame.covariances for frame in frames], axis=0)
    kept = (found - FLOOR[method] ** 2 * np.eye(2)) / one[:, :1, :1]
    np.testing.assert_allclose(kept[:, 0, 0], kept[:, 1, 1], rtol=1e-9)
    np.testing.assert_allclose(kept[:, 0, 1], 0, atol=1e-9)
    return np.asarray(kept[:, 0, 0])


def series(values: list[float], discs: int) -> FloatArray:
    """The same values for both coordinates of every disc, shape (f, n, 2)."""
    return np.tile(np.array(values)[:, None, None], (1, discs, 2))


def chance(discs: int, frames: int) -> float:
    """Standard deviation of a median over the discs, by that of a mean over all degrees of freedom."""
    return float(np.sqrt(np.pi / 2 / (discs * 2 * (frames - 1))))


def test_the_mean_is_weighted_by_the_inverse_covariances() -> None:
    """The minimum of the sum of squares, of two frames with crossed ellipses."""
    frames = [
        DiscDetections(np.array([centre]), np.array([covariance]), np.array([radius]), np.array([contrast]))
        for centre, covariance, radius, contrast in (
            ([10.0, 20.0], [[4.0, 1.0], [1.0, 1.0]], 7.0, 90.0),
            ([11.0, 19.0], [[1.0, -0.5], [-0.5, 3.0]], 9.0, 120.0),
        )
    ]
    found = mean_detections(frames, "precise")
    roots = np.concatenate([np.linalg.inv(np.linalg.cholesky(frame.covariances[0])) for frame in frames])
    rows = np.concatenate(
        [np.linalg.inv(np.linalg.cholesky(f.covariances[0])) @ f.centres[0] for f in frames]
    )
    expected = np.linalg.lstsq(roots, rows, rcond=None)[0]
    np.testing.assert_allclose(found.centres[0], expected, rtol=1e-12)
    assert found.radii.tolist() == [8.0]
    assert found.contrasts.tolist() == [105.0]


@pytest.mark.parametrize(
    ("frames", "shown", "known"), [(10, 2, True), (10, 1, False), (11, 2, False), (3, 1, True), (3, 0, False)]
)
def test_a_disc_is_known_from_a_fifth_of_the_frames_on(frames: int, shown: int, known: bool) -> None:
    errors = series([0.0] * frames, 3)
    errors[shown:, 1] = np.nan
    mean = mean_detections(frames_of(errors), "precise")
    for part in mean:
        np.testing.assert_array_equal(np.isfinite(part.reshape(3, -1)).all(axis=1), [True, known, True])


def test_discs_that_no_frame_shows_are_not_known() -> None:
    mean = mean_detections(frames_of(np.full((4, 2, 2), np.nan)), "precise")
    assert [part.shape for part in mean] == [(2, 2), (2, 2, 2), (2,), (2,)]
    assert all(np.isnan(part).all() for part in mean)


@pytest.mark.parametrize("method", ["precise", "hough"])
@pytest.mark.parametrize("count", [1, 2, 6])
def test_one_frame_or_its_copies_keep_all_of_the_covariance_and_have_the_floor(count, method):
    frames = frames_of(series([0.0] * count, 3), contrast=np.nan)
    mean = mean_detections(frames, method)
    expected = (DEVIATION**2 + {"precise": 0.0005, "hough": 0.45}[method] ** 2) * np.eye(2)
    np.testing.assert_allclose(mean.covariances, np.tile(expected, (3, 1, 1)), rtol=1e-12)
    assert np.isnan(mean.contrasts).all()  # of circles it is not known


@pytest.mark.parametrize("factor", [1.5, 3.0])
def test_a_larger_scatter_than_the_covariances_counts_against_eight_degrees_of_freedom(factor: float) -> None:
    found = shares(frames_of(series([factor, -factor] * 3, 5)))
    squares, freedom = 12 * factor**2, 10
    np.testing.assert_allclose(found, (8 + squares) / (8 + freedom) / 6, rtol=1e-9)


@pytest.mark.parametrize("size", [0.1, 0.3])
def test_what_the_frames_do_not_scatter_is_common_to_them(size: float) -> None:
    """The sum of squares over its median by chance, and √2 standard deviations of that on top."""
    found = shares(frames_of(series([size, -size] * 3, 5)))
    scatter = 12 * size**2 / chi2.median(10) + np.sqrt(2) * chance(5, 6)
    np.testing.assert_allclose(found, 1 - scatter * (1 - 1 / 6), rtol=1e-9)


@pytest.mark.parametrize("count", [6, 12])
def test_frames_that_follow_each_other_count_for_less(count: int) -> None:
    """A drift at an even speed; n frames with the autocorrelation r are n (1 - r) / (1 + r) independent ones.

    Of a drift of n steps of 1 the mean square about the middle is n (n + 1) / 12, and half of that of the
    steps is 1/2.
    """
    drift = 2 * (np.arange(count) - (count - 1) / 2)
    found = shares(frames_of(series(drift.tolist(), 50)))
    correlation = 1 - 0.5 / (count * (count + 1) / 12) - chance(50, count)
    independent = max(count * (1 - correlation) / (1 + correlation), 1)
    squares = 2 * 4 * count * (count**2 - 1) / 12
    excess = (8 + squares) / (8 + 2 * (count - 1))
    np.testing.assert_allclose(found, excess / independent, rtol=1e-9)


def test_a_lossy_film_adds_what_its_frames_share() -> None:
    frames = frames_of(np.random.default_rng(2).normal(size=(5, 3, 2)))
    plain, lossy = (mean_detections(frames, "precise", lossy=each) for each in (False, True))
    np.testing.assert_array_equal(plain.centres, lossy.centres)
    added = np.broadcast_to(LOSSY**2 * np.eye(2), plain.covariances.shape)
    np.testing.assert_allclose(lossy.covariances - plain.covariances, added, atol=1e-12)


def independent(rng: np.random.Generator, frames: int) -> FloatArray:
    return rng.normal(size=(frames, 9, 2))


def copies(rng: np.random.Generator, frames: int) -> FloatArray:
    return np.repeat(independent(rng, 1), frames, axis=0)


def sharing(share: float):
    """Errors of which all frames share a part of the variance."""
    return lambda rng, frames: (
        share**0.5 * independent(rng, 1) + (1 - share) ** 0.5 * independent(rng, frames)
    )


def seen_but_every(number: int):
    """Independent errors; no disc was seen in every so many-th frame."""

    def errors(rng: np.random.Generator, frames: int) -> FloatArray:
        values = independent(rng, frames)
        values[::number] = np.nan
        return values

    return errors


def following(correlation: float):
    """Errors of variance 1, each correlated with that of the frame before."""

    def errors(rng: np.random.Generator, frames: int) -> FloatArray:
        values = independent(rng, frames)
        for before, now in pairwise(values):
            now *= np.sqrt(1 - correlation**2)
            now += correlation * before
        return values

    return errors


@pytest.mark.parametrize(
    ("errors", "counts", "low", "high"),
    [
        (independent, (1, 3, 30), 0.7, 1.1),  # chance looks like a common part now and then
        (copies, (3, 30), 0.9, 1.1),
        (sharing(0.3), (5, 30), 0.65, 2),  # as independent frames at least 2.2 and 9.7
        (sharing(0.7), (5, 30), 0.65, 2),
        (seen_but_every(3), (30,), 0.6, 1.1),
        (following(0.5), (30,), 0.65, 1.3),  # as independent frames 3
        (following(0.9), (30,), 0.65, 1.3),  # and 11
    ],
)
def test_means_are_as_far_from_the_truth_as_their_variances_say(errors, counts, low, high) -> None:
    """Mean square of the errors of 100 means of nine discs over their variances."""
    for count in counts:
        rng, squares = np.random.default_rng(5), []
        for _ in range(100):
            mean = mean_detections(frames_of(errors(rng, count)), "precise")
            variances = np.diagonal(mean.covariances, axis1=1, axis2=2)
            squares.append(((mean.centres - 100) ** 2 / variances).mean())
        assert low < np.mean(squares) < high
