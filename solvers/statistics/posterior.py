"""Two Gaussian processes, u and v, conditioned on the displacements of markers.

The observations are d = u - S z + e, with the processes u, errors e, and the unknown frames of the pictures,
of standardised values z, which u and v have in common; see `pinnray.solvers.assimilation.picture_frames`.

Source: C. E. Rasmussen, C. K. I. Williams, Gaussian Processes for Machine Learning, MIT Press 2006, equations
2.23 to 2.26, 2.30 and 5.9.
"""

import math
from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import cho_solve
from scipy.optimize import minimize
from threadpoolctl import threadpool_limits

from pinnray.geometry.mesh.point_location import LocatedPoints
from pinnray.runtime.arrays import FloatArray
from pinnray.solvers.assimilation.picture_frames import FreePictures
from pinnray.solvers.statistics.kernel import correlation, derivative_by_log_length, gradient_factor

START, RANGES = (10.0, 30.0), ((1e-4, 1e6), (1.0, 1000.0))
"""Start and ranges of the search for variance, mm², and length, mm."""


@dataclass(frozen=True, eq=False)
class FramedMarkers:
    """Observations at m markers."""

    points: FloatArray  # Shape (m, 2), mm
    observed: FloatArray  # d, shape (m, 2), mm
    deviations: FloatArray  # Standard deviations of e, shape (m, 2), mm
    frames: FloatArray  # -S, errors by unit changes of the pictures' frames, shape (p, m, 2), mm

    def without(self, marker: int) -> "FramedMarkers":
        """The other markers' data."""
        kept = np.arange(len(self.points)) != marker
        return FramedMarkers(
            self.points[kept], self.observed[kept], self.deviations[kept], self.frames[:, kept]
        )


@dataclass(frozen=True, eq=False)
class Posterior:
    """The processes given the markers: a displacement field with standard deviations."""

    data: FramedMarkers
    variances: FloatArray  # Of the processes u and v a priori, shape (2,), mm²
    lengths: FloatArray  # Of their kernels, shape (2,), mm
    cholesky: FloatArray  # Cholesky factor of the covariance of d, shape (2 m, 2 m)
    coefficients: FloatArray  # Inverse covariance of d times d, shape (m, 2), 1/mm

    @classmethod
    def of(cls, data: FramedMarkers) -> "Posterior":
        """The processes of the largest marginal likelihood with the frames as they are, conditioned."""
        with threadpool_limits(1, user_api="blas"):  # on small matrices its threads wait for one another
            variances, lengths = np.exp([_most_likely(data, axis) for axis in (0, 1)]).T
        covariance = _covariance(data, variances, lengths, data.points)
        frames = data.frames.reshape(len(data.frames), len(covariance))
        cholesky = np.linalg.cholesky(covariance + np.diag(data.deviations.ravel() ** 2) + frames.T @ frames)
        coefficients = cho_solve((cholesky, True), data.observed.ravel()).reshape(-1, 2)
        return cls(data, variances, lengths, cholesky, coefficients)

    @property
    def log_evidence(self) -> float:
        """Logarithm of the marginal likelihood of d."""
        misfit = 0.5 * float(self.data.observed.ravel() @ self.coefficients.ravel())
        return -misfit - log_root_determinant(self.cholesky) - len(self.data.points) * math.log(2 * np.pi)

    @property
    def frames(self) -> tuple[FloatArray, FloatArray]:
        """Mean (p,) and covariance (p, p) of the frames' standardised values."""
        flat = self.data.frames.reshape(len(self.data.frames), 2 * len(self.data.points))
        mean = flat @ self.coefficients.ravel()
        return mean, np.eye(len(flat)) - flat @ cho_solve((self.cholesky, True), flat.T)

    def displacement(self, location: LocatedPoints) -> FloatArray:
        """Posterior mean, shape (n, 2), mm."""
        return self.mean(location.points)

    def gradient(self, location: LocatedPoints) -> FloatArray:
        """Gradient du_i/dx_j of the mean, shape (n, 2, 2)."""
        centres, points = self.data.points, location.points
        factors = [gradient_factor(points, centres, length) for length in self.lengths]
        weighted = np.stack(factors, axis=-1) * (self.variances * self.coefficients)
        return np.asarray(np.einsum("nmc,nmx->ncx", weighted, centres - points[:, None]))

    def mean(self, points: FloatArray) -> FloatArray:
        """Posterior mean at points (n, 2), mm: shape (n, 2), mm."""
        kernels = [correlation(points, self.data.points, length) for length in self.lengths]
        return np.asarray((np.stack(kernels, axis=-1) * self.variances * self.coefficients).sum(axis=1))

    def standard_deviation(self, location: LocatedPoints) -> FloatArray:
        """Standard deviation of the displacement, shape (n, 2), mm."""
        return self._deviation(location.points, np.zeros((len(self.data.frames), *location.points.shape)))

    def shown_deviation(self, pictures: FreePictures, location: LocatedPoints) -> FloatArray:
        """Standard deviation of what pictures show of the displacement, shape (n, 2), mm."""
        (z, _), points = self.frames, location.points
        there = replace(pictures, points=points, shown=self.shown(pictures, points))
        return self._deviation(points, there.about(z).frames)

    def shown(self, pictures: FreePictures, points: FloatArray) -> FloatArray:
        """What pictures show of the displacement of points (n, 2), mm: shape (n, 2), mm."""
        return pictures.at(self.frames[0]).shown(points, self.mean(points))

    def _deviation(self, points: FloatArray, frames: FloatArray) -> FloatArray:
        """Standard deviation of u + the frames (p, n, 2), mm, times z at points (n, 2): (n, 2), mm."""
        between = _covariance(self.data, self.variances, self.lengths, points)
        between = between + np.einsum("pnc,pgd->ncgd", frames, self.data.frames).reshape(between.shape)
        known = (between * cho_solve((self.cholesky, True), between.T).T).sum(axis=1).reshape(-1, 2)
        return np.asarray(np.sqrt(np.maximum(self.variances + (frames**2).sum(axis=0) - known, 0.0)))


def _covariance(
    data: FramedMarkers, variances: FloatArray, lengths: FloatArray, points: FloatArray
) -> FloatArray:
    """Prior covariance between n points and the markers, mm²: (2 n, 2 m), u and v by turns."""
    kernels = np.stack([correlation(points, data.points, length) for length in lengths])
    covariance = np.einsum("cng,cd->ncgd", kernels, np.diag(variances))
    return np.asarray(covariance.reshape(2 * len(points), 2 * len(data.points)))


def _most_likely(data: FramedMarkers, axis: int) -> FloatArray:
    """Logarithms of variance, mm², and length, mm, of the largest marginal likelihood of a component.

    An end of the search range is a valid result: constant over the finger, or the markers alone.
    """
    observed, noise = data.observed[:, axis], np.diag(data.deviations[:, axis] ** 2)

    def minus_log_likelihood(logarithms: FloatArray) -> tuple[float, FloatArray]:
        """Without its constant; and its derivatives, shape (2,)."""
        variance, length = np.exp(logarithms)
        process = variance * correlation(data.points, data.points, length)
        by_length = variance * derivative_by_log_length(data.points, data.points, length)
        try:
            cholesky = np.linalg.cholesky(process + noise)
        except np.linalg.LinAlgError:  # rounding: markers that all but coincide, nearly without noise
            return np.inf, np.zeros(2)
        weights = cho_solve((cholesky, True), observed)
        outer = np.outer(weights, weights) - cho_solve((cholesky, True), np.eye(len(observed)))
        constant = 0.5 * len(observed) * np.log(2 * np.pi)
        value = 0.5 * float(observed @ weights) + log_root_determinant(cholesky) + constant
        return value, np.array([-0.5 * (outer * slope).sum() for slope in (process, by_length)])

    found = minimize(minus_log_likelihood, np.log(START), jac=True, method="L-BFGS-B", bounds=np.log(RANGES))
    return np.asarray(found.x)


def log_root_determinant(cholesky: FloatArray) -> float:
    """Logarithm of the square root of the determinant of C = L Lᵀ, from L, shape (n, n).

    By the C library's logarithm: NumPy's of a diagonal differs in its last bit with the memory that happens
    to follow the matrix, and the search for the hyperparameters turns that into a millionth of them.
    """
    return sum(map(math.log, cholesky.diagonal().tolist()))
