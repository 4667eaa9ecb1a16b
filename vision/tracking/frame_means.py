"""Means of discs over frames at rest, with covariances for shared and autocorrelated noise."""

from collections.abc import Sequence

import numpy as np
from scipy.special import chdtri

from pinnray.runtime.arrays import FloatArray, IntArray
from pinnray.vision.discs.disc_detector import FLOOR, DetectionMethod, DiscDetections

LEAST_SHARE = 0.2
"""Smallest share of the frames at rest in which a visible marker is detected."""
USUAL = 1.3
"""Largest variance over the discs' median that counts as noise alone."""
LOSSY = 0.02
"""Further standard deviation of a disc in a lossy film, pixels, common to frames that repeat each other. In
H.264 films by another renderer errors are 0.7 to 1.0 of what is so stated, 1.3 at a quarter of their size."""
TRUST = 8
"""Prior degrees of freedom given to the fit's covariance, against the frames' scatter."""


def mean_detections(
    frames: Sequence[DiscDetections], method: DetectionMethod, *, lossy: bool = False
) -> DiscDetections:
    """Every disc's weighted mean over frames; nan for those detected in too few.

    Weights are inverse covariances. The covariances of most discs are noise, which a mean over independent
    frames reduces; the excess of others is misfit, such as of the wall beside a disc, and common to all
    frames, as are `FLOOR` and, of a lossy film, `LOSSY`. Its frames repeat each other: if the discs scatter
    less than their covariances, the difference is common too, and autocorrelation reduces the number of
    independent frames.
    If a disc scatters more than its covariances, these grow with the mean square (R. T. Birge, "The
    calculation of errors by the method of least squares", Physical Review 40, 1932).
    """
    centres, covariances, radii, contrasts = (np.stack(parts) for parts in zip(*frames, strict=True))
    seen = np.isfinite(radii)
    count = seen.sum(axis=0)
    known = count >= max(1.0, LEAST_SHARE * len(frames))
    mean, radius, contrast = (np.full(part.shape[1:], np.nan) for part in (centres, radii, contrasts))
    covariance = np.full(covariances.shape[1:], np.nan)
    if not known.any():
        return DiscDetections(mean, covariance, radius, contrast)
    weights = np.zeros_like(covariances)
    weights[seen] = np.linalg.inv(covariances[seen])
    total = np.linalg.inv(weights.sum(axis=0)[known])
    centres = np.where(seen[:, :, None], centres, 0.0)
    mean[known] = np.einsum("mij,fmjk,fmk->mi", total, weights[:, known], centres[:, known])
    radius[known] = np.nanmean(radii[:, known], axis=0)
    contrast[known] = np.where(seen, contrasts, 0.0).sum(axis=0)[known] / count[known]
    usual = np.nanmean(covariances[:, known], axis=0)
    size = np.trace(usual, axis1=1, axis2=2)
    noise = np.minimum(USUAL * np.median(size) / size, 1.0)
    away = np.where(seen[:, known, None], centres[:, known] - mean[known], np.nan)
    share = _kept(away, weights[:, known], count[known], noise)
    covariance[known] = share[:, None, None] * usual + (FLOOR[method] ** 2 + lossy * LOSSY**2) * np.eye(2)
    return DiscDetections(mean, covariance, radius, contrast)


def _kept(away: FloatArray, weights: FloatArray, count: IntArray, noise: FloatArray) -> FloatArray:
    """Share of a frame's covariance that the mean over frames keeps, shape (m,).

    `away` are the discs less their means, shape (f, m, 2), nan where one was not detected, `weights` the
    inverse covariances, `count` the frames with a disc, `noise` the share of its covariance that is noise.
    """
    squares, steps = _squares(away, weights), np.diff(away, axis=0)
    freedom, pairs = 2 * (count - 1), np.isfinite(steps[..., 0]).sum(axis=0)
    turns = np.where(pairs > 0, 0.0, np.nan)  # copies of one frame stay at 0
    moving = (squares > 0) & (pairs > 0)
    half = _squares(steps, weights[1:])[moving] / (2 * pairs[moving])
    turns[moving] = half / (squares[moving] / (count[moving] - 1))
    scatter, correlation = _scatter(squares / noise, turns, freedom)
    independent = np.maximum((1 - correlation) / (1 + correlation) * count, 1.0)
    excess = np.maximum(1.0, (TRUST + squares) / (TRUST + freedom))
    return np.asarray(excess * (1 - noise * scatter * (1 - 1 / independent)))


def _squares(offsets: FloatArray, weights: FloatArray) -> FloatArray:
    """Sums of the weighted squares over frames, shape (m,), of offsets (f, m, 2), nan where unknown."""
    known = np.nan_to_num(offsets)
    return np.asarray(np.einsum("fmi,fmij,fmj->m", known, weights, known))


def _scatter(squares: FloatArray, turns: FloatArray, freedom: IntArray) -> tuple[float, float]:
    """Scatter of the discs over their covariances, and its autocorrelation from frame to frame.

    Both are between 0 and 1, medians over the discs; independent frames have 1 and 0, and values within a
    standard deviation of these count as these.

    Args:
        squares: Sums of squared distances from the mean, in standard deviations, shape (m,).
        turns: Half the mean square of the steps from frame to frame over the variance, shape (m,): 1 for
            independent frames (J. von Neumann, "Distribution of the ratio of the mean square successive
            difference to the variance", Annals of Mathematical Statistics 12, 1941); nan if unknown.
        freedom: Degrees of freedom of the squares, shape (m,).
    """
    several = freedom > 0
    if not several.any():
        return 1.0, 0.0
    usual = chdtri(freedom[several], 0.5)  # the median of chi squared
    chance = np.sqrt(np.pi / 2 / freedom[several].sum())  # standard deviation of a median, by that of a mean
    scatter = np.median(squares[several] / usual) + np.sqrt(2) * chance
    correlation = 1 - np.nanmedian(turns) - chance if np.isfinite(turns).any() else 0.0
    return min(1.0, float(scatter)), max(0.0, float(correlation))
