"""`gp`: a Gaussian process through the markers, without mechanics: the null model.

A solver with mechanics has to predict held-out markers better than this.

Source: C. E. Rasmussen, C. K. I. Williams, Gaussian Processes for Machine Learning, MIT Press 2006, equations
2.23 to 2.26 and chapter 5.
"""

import time
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import cho_solve
from scipy.optimize import minimize
from threadpoolctl import threadpool_limits

from pinnray.geometry.mesh.boundary import evenly_spaced_points
from pinnray.geometry.observations import Observations
from pinnray.runtime.arrays import FloatArray
from pinnray.solvers.assimilation.misfit import standard_deviations
from pinnray.solvers.assimilation.picture_frames import FramedData, FreePictures
from pinnray.solvers.problem import Problem
from pinnray.solvers.solution import Solution
from pinnray.solvers.solver import (
    Cost,
    FieldSettings,
    Progress,
    UnsupportedProblemError,
    check_problem,
    silent,
)
from pinnray.solvers.statistics.kernel_field import (
    MarkerPrediction,
    correlation,
    derivative_by_log_length,
    with_markers_left_out,
)
from pinnray.solvers.statistics.statistical_posterior import (
    Hyperparameters,
    Posterior,
    StatFemData,
    StatFemField,
    framed_posterior,
    log_root_determinant,
    posterior_solution,
    predicted,
)

MIN_MARKERS = 3
"""Minimum number of markers that determines the two hyperparameters of a kernel."""

START, RANGES = (10.0, 30.0), ((1e-4, 1e6), (1.0, 1000.0))
"""Start and ranges of the search for variance, mm², and length, mm."""


@dataclass(frozen=True)
class GaussianProcessSolver(FieldSettings):
    """u and v as independent processes of mean zero with a kernel of Matérn.

    Length and variance of each kernel maximise the marginal likelihood, also of the markers that remain when
    one is left out.
    """

    clamp: bool = False  # Whether the process is conditioned on a base at rest, a stronger null model
    name = "gp"
    family = "statistics"
    laws = ("linear",)
    loads = ("mean", "point", "patch", "cylinder")  # it only needs to know where, for its force
    friction = True
    assimilates = True
    cost = Cost(per_triangle=38)

    def solve(self, problem: Problem, progress: Progress = silent) -> Solution:
        """Fit the processes to the problem's observations, and again without each marker; see `Solver`."""
        check_problem(self, problem)
        started = time.perf_counter()
        solution, posterior, pictures = self._fitted(problem, MIN_MARKERS + 1)

        def without(marker: int) -> MarkerPrediction:
            progress(marker / len(pictures.points), "leaving each marker out")
            return predicted(_fit(posterior.data.without(marker)), posterior.data, pictures, marker)

        return with_markers_left_out(solution, pictures.shown, without, started)

    def refitter(self, problem: Problem) -> Callable[[Observations], Solution]:
        """A function that fits other observations, without leaving any out; see `Refittable`."""
        return lambda observations: self._fitted(replace(problem, observations=observations), MIN_MARKERS)[0]

    def _fitted(self, problem: Problem, least: int) -> tuple[Solution, Posterior, FreePictures]:
        """The solution, and the processes conditioned on at least so many markers."""
        started, observations = time.perf_counter(), problem.observations
        count = 0 if observations is None else int(observations.visible.sum())
        if observations is None or count < least:
            raise UnsupportedProblemError(
                f"gp goes through markers: it needs {least} that were seen, not {count}"
            )
        pictures, base = FreePictures.of(observations), self._base(problem)
        deviations = standard_deviations(observations)

        def conditioned(framed: FramedData) -> Posterior:
            rest = np.zeros_like(base)  # in the drawing, whatever the pictures' frames are
            data = StatFemData(
                points=np.concatenate([pictures.points, base]),
                observed=np.concatenate([framed.observed, rest]),
                deviations=np.concatenate([deviations, np.full_like(base, deviations.min())]),
                frames=np.concatenate([framed.frames, np.zeros((len(framed.frames), *base.shape))], axis=1),
                shapes=np.zeros((0, count + len(base), 2)),
                load=np.zeros(0),
                load_deviation=0.0,
            )
            return _fit(data)

        posterior = framed_posterior(pictures, conditioned)
        u, v = map(float, posterior.constants.lengths)
        solution = posterior_solution(
            self.name,
            problem,
            StatFemField(posterior, []),
            pictures,
            f"an interpolation of the markers without mechanics, over lengths of {u:.3g} mm in u and "
            f"{v:.3g} mm in v; its energy and force mean little",
            {"seconds": time.perf_counter() - started, "length_u": u, "length_v": v},
        )
        return solution, posterior, pictures

    def _base(self, problem: Problem) -> FloatArray:
        """Points at rest, shape (b, 2), mm."""
        return evenly_spaced_points(problem.mesh, "base", 5) if self.clamp else np.zeros((0, 2))


def _fit(data: StatFemData) -> Posterior:
    """The processes with the hyperparameters of the largest marginal likelihood, frames as they are."""
    with threadpool_limits(1, user_api="blas"):  # on small matrices its threads wait for one another
        variances, lengths = np.exp([_most_likely(data, axis) for axis in (0, 1)]).T
    return Posterior.given(data, Hyperparameters(1.0, np.sqrt(variances), lengths))


def _most_likely(data: StatFemData, axis: int) -> FloatArray:
    """Logarithms of variance, mm², and length, mm, of the largest marginal likelihood of a component.

    An end of the search range is a valid result: constant over the finger, or the markers alone. The source
    has the likelihood in equation 2.30 and its gradient in 5.9.
    """
    observed, noise = data.observed[:, axis], np.diag(data.deviations[:, axis] ** 2)

    def minus_log_likelihood(logarithms: FloatArray) -> tuple[float, FloatArray]:
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
