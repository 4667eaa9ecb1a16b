"""What a video says about the markers: their way, their means at rest, and the displacements with errors."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import chdtri

from geometry.arrays import BoolArray, FloatArray, IntArray
from geometry.errors import UserError
from geometry.finger.parameters import Parameters
from geometry.finger.section import finger_section
from geometry.observations import Observations
from vision.discs.disc_detector import FLOOR, DetectionMethod, DiscDetections
from vision.tracking.marker_plane import MarkerPlane
from vision.tracking.rest_detection import RestIntervals

LEAST_SHARE = 0.2
"""Of the frames at rest; a marker that is seen in fewer counts as not visible."""
USUAL = 1.3
"""Variance over the discs' median up to which it is taken for noise, which differs a little by itself."""
TRUST = 8
"""In the fit's covariances, against what the frames' scatter says: as if of so many squares."""


@dataclass(frozen=True, eq=False)
class Tracking:
    """The markers in a video of f frames.

    Attributes:
        design: The finger.
        expected: Where its markers should be before loading, shape (m, 2), mm.
        times: Of the frames, shape (f,), s.
        pixels: Of the markers, shape (f, m, 2); nan where one was not seen.
        covariances: Of the pixels, shape (f, m, 2, 2), pixels².
        plane: From pixels to the finger's frame.
        rest: The frames before and after the motion.
        initial, final: Means of the markers over those frames.
        method: How the markers were found.
        warnings: What a person should know, one line each.
    """

    design: Parameters
    expected: FloatArray
    times: FloatArray
    pixels: FloatArray
    covariances: FloatArray
    plane: MarkerPlane
    rest: RestIntervals
    initial: DiscDetections
    final: DiscDetections
    method: DetectionMethod
    warnings: tuple[str, ...] = ()

    @property
    def visible(self) -> BoolArray:
        """Which markers were seen before and after the motion, shape (m,)."""
        return np.asarray(np.isfinite(self.initial.radii + self.final.radii))

    @property
    def positions(self) -> FloatArray:
        """Of the markers in every frame, shape (f, m, 2), mm; nan where one was not seen."""
        return plane_positions(self.plane, self.pixels, self.design)

    @property
    def offsets(self) -> FloatArray:
        """Initial positions minus those of the design, shape (m, 2), mm; nan for markers not visible."""
        initial = plane_positions(self.plane, self.initial.centres, self.design)
        return np.where(self.visible[:, None], initial - self.expected, np.nan)

    @property
    def displacement_covariance(self) -> FloatArray:
        """Of the displacements of the visible markers, shape (2 v, 2 v), mm², in the order u1, v1, u2, ..."""
        seen = self.visible
        before, after = (
            plane_positions(self.plane, end.centres[seen], self.design) for end in (self.initial, self.final)
        )
        noise = (self.initial.covariances[seen], self.final.covariances[seen])
        return self.plane.displacement_covariance(before, after, *noise)

    def observations(self, source: str) -> Observations:
        """The displacements, final minus initial; markers that are not visible are where the design has them.

        So are all of the method "hough", whose linear map does not find places: the lens shifts them.

        Raises:
            UserError: If no marker is visible, or one lies outside the finger.
        """
        seen = self.visible
        if not seen.any():
            raise UserError("no marker was seen both before and after the motion; show them all at rest")
        points = self.expected.copy()
        displacements, deviations = np.zeros_like(points), np.zeros_like(points)
        initial, final = (
            plane_positions(self.plane, end.centres, self.design) for end in (self.initial, self.final)
        )
        if self.method != "hough":
            points[seen] = initial[seen]
        displacements[seen] = (final - initial)[seen]
        deviations[seen] = np.sqrt(np.diag(self.displacement_covariance)).reshape(-1, 2)
        if (outside := ~finger_section(self.design).contains(points)).any():
            number = int(outside.argmax())
            x, y = points[number]
            wanted_x, wanted_y = self.expected[number]
            raise UserError(
                f"marker {number + 1} was seen at ({x:.2f}, {y:.2f}) mm, outside the finger; the design has "
                f"it at ({wanted_x:.2f}, {wanted_y:.2f}) mm: give the design and the workspace of the video"
            )
        return Observations(
            points,
            displacements,
            deviations,
            seen,
            source,
            simulated=False,
            marker_radius=self.design.marker_radius,
        )


def plane_positions(plane: MarkerPlane, pixels: FloatArray, design: Parameters) -> FloatArray:
    """Where markers lie in the plane; shapes (..., 2), mm, nan where the pixels are."""
    flat = pixels.reshape(-1, 2)
    known = np.isfinite(flat).all(axis=1)
    places = np.full_like(flat, np.nan)
    places[known] = plane.circles(flat[known], design.marker_radius)
    return places.reshape(pixels.shape)


def mean_detections(frames: Sequence[DiscDetections], method: DetectionMethod) -> DiscDetections:
    """Every disc's mean over frames; nan for those hardly seen.

    Weights are inverse covariances. Those of most discs are noise, which a mean over independent frames
    reduces; what others have beyond is misfit, of the wall beside a disc for one, and common to all frames,
    as is `FLOOR`. Frames of lossy films repeat each other: what the discs scatter less than their covariances
    say is common too, and what follows the frame before counts for so many fewer frames. A disc that is not
    quite the model's scatters more than its covariances say; they grow with the mean square (R. T. Birge,
    "The calculation of errors by the method of least squares", Physical Review 40, 1932).
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
    covariance[known] = share[:, None, None] * usual + FLOOR[method] ** 2 * np.eye(2)
    return DiscDetections(mean, covariance, radius, contrast)


def _kept(away: FloatArray, weights: FloatArray, count: IntArray, noise: FloatArray) -> FloatArray:
    """What share of a frame's covariance the mean over frames keeps, shape (m,).

    Args:
        away: Of the frames' discs from the means, shape (f, m, 2), pixels; nan where one was not seen.
        weights: Inverse covariances, shape (f, m, 2, 2), 1/pixels².
        count: Of the frames in which a disc was seen, shape (m,).
        noise: Share of the covariance that is noise, shape (m,).
    """
    squares, steps = _squares(away, weights), np.diff(away, axis=0)
    freedom, pairs = 2 * (count - 1), np.isfinite(steps[..., 0]).sum(axis=0)
    turns = np.where(pairs > 0, 0.0, np.nan)  # of copies
    moving = (squares > 0) & (pairs > 0)
    half = _squares(steps, weights[1:])[moving] / (2 * pairs[moving])
    turns[moving] = half / (squares[moving] / (count[moving] - 1))
    scatter, follows = _scatter(squares / noise, turns, freedom)
    independent = np.maximum((1 - follows) / (1 + follows) * count, 1.0)
    excess = np.maximum(1.0, (TRUST + squares) / (TRUST + freedom))
    return np.asarray(excess * (1 - noise * scatter * (1 - 1 / independent)))


def _squares(offsets: FloatArray, weights: FloatArray) -> FloatArray:
    """Sums of the weighted squares over frames, shape (m,), of offsets (f, m, 2), nan where unknown."""
    known = np.nan_to_num(offsets)
    return np.asarray(np.einsum("fmi,fmij,fmj->m", known, weights, known))


def _scatter(squares: FloatArray, turns: FloatArray, freedom: IntArray) -> tuple[float, float]:
    """How much discs scatter, of what their covariances say, and how much of it follows the frame before.

    Both are between 0 and 1, medians over the discs; independent frames have 1 and 0, and what is within a
    standard deviation of that counts as that.

    Args:
        squares: Of what the frames miss the mean by, in standard deviations, shape (m,).
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
    follows = 1 - np.nanmedian(turns) - chance if np.isfinite(turns).any() else 0.0
    return min(1.0, float(scatter)), max(0.0, float(follows))
