"""Means over frames of series whose scatter and autocorrelation are known, by closed forms."""

import numpy as np
import pytest
from scipy.stats import chi2

from geometry.arrays import FloatArray
from vision.discs.disc_detector import FLOOR, DetectionMethod, DiscDetections
from vision.tracking.frame_means import LOSSY, mean_detections

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
    assert np.isfinite(mean.radii).tolist() == [True, known, True]
    assert np.isfinite(mean.centres).all(axis=1).tolist() == [True, known, True]
    assert np.isfinite(mean.covariances).all(axis=(1, 2)).tolist() == [True, known, True]
    assert np.isfinite(mean.contrasts).tolist() == [True, known, True]


def test_of_frames_in_which_a_disc_was_hidden_the_others_count() -> None:
    errors = series([1.0, 2.0, 4.0, 5.0], 2)
    errors[2:, 0] = np.nan
    frames = frames_of(errors)
    frames[0].radii[:], frames[0].contrasts[:] = 6.0, 50.0
    mean = mean_detections(frames, "precise")
    np.testing.assert_allclose(mean.centres[:, 0], [100 + 1.5 * DEVIATION, 100 + 3 * DEVIATION], rtol=1e-12)
    np.testing.assert_allclose(mean.radii, [7.0, 7.5])
    np.testing.assert_allclose(mean.contrasts, [75.0, 87.5])


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


@pytest.mark.parametrize("count", [2, 4, 10])
def test_frames_that_scatter_as_their_covariances_say_reduce_them_by_their_number(count: int) -> None:
    """Alternating: the steps are larger than of independent frames, so no frame follows another."""
    size = np.sqrt((count - 1) / count)  # the sum of squares is that of the degrees of freedom
    found = shares(frames_of(series([size, -size] * (count // 2), 5)))
    np.testing.assert_allclose(found, 1 / count, rtol=1e-9)


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


def test_the_scatter_is_the_median_over_the_discs() -> None:
    sizes = np.array([0.05, 0.1, 0.2, 0.3, 9.0])
    errors = series([1.0, -1.0] * 3, 5) * sizes[:, None]
    found = shares(frames_of(errors))
    scatter = 12 * 0.2**2 / chi2.median(10) + np.sqrt(2) * chance(5, 6)
    excess = [1, 1, 1, 1, (8 + 12 * 81) / 18]
    np.testing.assert_allclose(found, np.array(excess) * (1 - scatter * (1 - 1 / 6)), rtol=1e-9)


def test_the_scatter_of_a_disc_that_is_known_worse_is_over_its_noise_alone() -> None:
    """Of variances four times the median 1.3 / 4 are noise; the squares are as 1, 4, 9, 4 and 4."""
    sizes = np.array([0.1, 0.2, 0.3, 0.2, 0.2])
    found = shares(frames_of(series([1.0, -1.0] * 3, 5) * sizes[:, None], sizes=(1.0, 1.0, 1.0, 4.0, 4.0)))
    scatter = 12 * 0.3**2 / chi2.median(10) + np.sqrt(2) * chance(5, 6)  # 4 / 0.325 is more than 9
    noise = np.array([1, 1, 1, 1.3 / 4, 1.3 / 4])
    np.testing.assert_allclose(found, 1 - noise * scatter * (1 - 1 / 6), rtol=1e-9)


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


def test_of_frames_that_none_follows_nothing_is_known_of_a_correlation() -> None:
    """Every disc is seen in every second frame: four frames of the usual scatter."""
    size = np.sqrt(3 / 4)
    errors = series([size, np.nan, -size, np.nan, size, np.nan, -size, np.nan], 3)
    np.testing.assert_allclose(shares(frames_of(errors)), 1 / 4, rtol=1e-9)


def test_no_frames_are_fewer_than_one() -> None:
    """A drift so slow that more than one frame is hardly known of, among many discs."""
    drift = np.linspace(-4, 4, 60)
    found = shares(frames_of(series(drift.tolist(), 400)))
    squares = 2 * (drift**2).sum()
    np.testing.assert_allclose(found, (8 + squares) / (8 + 2 * 59), rtol=1e-9)


def test_what_a_disc_is_known_worse_than_usual_is_common_to_its_frames() -> None:
    """Variances up to 1.3 times the median are noise; of four times as much a share of 1.3 / 4 is."""
    size = np.sqrt(9 / 10)
    errors = series([size, -size] * 5, 5)
    found = shares(frames_of(errors, sizes=(1.0, 1.0, 1.0, 1.29, 4.0)))
    np.testing.assert_allclose(found[:4], 0.1, rtol=1e-9)
    assert found[4] == pytest.approx(1 - 1.3 / 4 * (1 - 1 / 10), rel=1e-9)


def test_discs_whose_frames_do_not_follow_each_other_say_nothing_of_the_correlation() -> None:
    """Two discs drift; three are seen in every second frame only."""
    drift = 2 * (np.arange(12) - 5.5)
    errors = series(drift.tolist(), 5)
    errors[1::2, 2:] = np.nan
    found = shares(frames_of(errors))
    freedom = 2 * (2 * 11) + 3 * (2 * 5)
    correlation = 1 - 0.5 / 13 - np.sqrt(np.pi / 2 / freedom)
    independent = np.array([12, 12, 6, 6, 6]) * (1 - correlation) / (1 + correlation)
    half = 2 * 4 * 4 * 6 * 35 / 12
    squares = np.array([2 * 4 * 12 * 143 / 12] * 2 + [half] * 3)
    excess = (8 + squares) / (8 + 2 * (np.array([12, 12, 6, 6, 6]) - 1))
    np.testing.assert_allclose(found, excess / np.maximum(independent, 1), rtol=1e-9)


def test_a_lossy_film_adds_what_its_frames_share() -> None:
    frames = frames_of(np.random.default_rng(2).normal(size=(5, 3, 2)))
    plain, lossy = (mean_detections(frames, "precise", lossy=each) for each in (False, True))
    np.testing.assert_array_equal(plain.centres, lossy.centres)
    added = np.broadcast_to(LOSSY**2 * np.eye(2), plain.covariances.shape)
    np.testing.assert_allclose(lossy.covariances - plain.covariances, added, atol=1e-12)
