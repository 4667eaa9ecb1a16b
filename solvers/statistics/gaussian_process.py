"""`gp`: a Gaussian process through the markers, without mechanics: the null model.

A solver with mechanics has to predict held-out markers better than this.

Source: C. E. Rasmussen, C. K. I. Williams, Gaussian Processes for Machine Learning, MIT Press 2006, equations
2.23 to 2.26 and chapter 5, as scikit-learn has them.
"""

import time
import warnings
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from threadpoolctl import threadpool_limits

from geometry.arrays import FloatArray
from geometry.mesh.boundary import evenly_spaced_points
from geometry.mesh.point_location import LocatedPoints
from geometry.observations import Observations
from solvers.assimilation.misfit import MarkerSettings, Misfit, misfit_of, standard_deviations
from solvers.energy_and_force import energy_and_force
from solvers.problem import Problem
from solvers.solution import Solution, Status, Uncertainty
from solvers.solver import FieldSettings, Progress, UnsupportedProblemError, check_problem, silent
from solvers.statistics.kernel_field import (
    SMOOTHNESS,
    Kernel,
    KernelField,
    MarkerPrediction,
    with_markers_left_out,
)

MIN_MARKERS = 3
"""Minimum number of markers that determines the two hyperparameters of a kernel."""


@dataclass(frozen=True)
class GaussianProcessSolver(FieldSettings):
    """u and v as independent processes of mean zero with one of Matérn's kernels.

    Length and variance of each kernel maximise the marginal likelihood, also of the markers that remain when
    one is left out.
    """

    clamp: bool = False  # Whether the process is conditioned on a base at rest, a stronger null model
    kernel: Kernel = "matern52"  # "matern32", "matern52" or "gaussian" (squared exponential)
    name = "gp"
    family = "statistics"
    laws = ("linear",)
    loads = ("mean", "point", "patch")
    assimilates = True

    def solve(self, problem: Problem, progress: Progress = silent) -> Solution:
        """Fit the processes to the problem's observations, and again without each marker; see `Solver`."""
        check_problem(self, problem)
        started = time.perf_counter()
        solution, misfit, deviations = self._fitted(problem, MIN_MARKERS + 1)
        base = self._base(problem)

        def without(marker: int) -> MarkerPrediction:
            progress(marker / len(misfit.points), "leaving each marker out")
            others = _fit(misfit.without(marker), np.delete(deviations, marker, axis=0), base, self.kernel)
            there = problem.mesh.locate(misfit.points[[marker]])
            spread = np.hypot(others.standard_deviation(there)[0], deviations[marker])
            return others.displacement(there)[0], spread

        return with_markers_left_out(solution, misfit.observed, without, started)

    def refitter(self, problem: Problem) -> Callable[[Observations], Solution]:
        """A function that fits other observations, without leaving any out; see `Refittable`."""
        return lambda observations: self._fitted(replace(problem, observations=observations), MIN_MARKERS)[0]

    def _fitted(self, problem: Problem, least: int) -> tuple[Solution, Misfit, FloatArray]:
        """The solution, the misfit of at least so many markers, and their standard deviations (m, 2), mm."""
        started = time.perf_counter()
        misfit = misfit_of(problem, MarkerSettings(marker_radius=0.0))
        count = 0 if misfit is None else len(misfit.points)
        if misfit is None or problem.observations is None or count < least:
            raise UnsupportedProblemError(
                f"gp goes through markers: it needs {least} that were seen, not {count}"
            )
        deviations = standard_deviations(problem.observations)
        field = _fit(misfit, deviations, self._base(problem), self.kernel)
        energy, reaction = energy_and_force(problem, field, 4)
        u, v = field.lengths
        evidence = [float(process.log_marginal_likelihood_value_) for process in field.processes]
        solution = Solution(
            solver=self.name,
            problem=problem,
            field=field,
            energy=energy,
            reaction=reaction,
            status=Status(
                True,
                f"an interpolation of the markers without mechanics, over lengths of {u:.3g} mm in u and "
                f"{v:.3g} mm in v; its energy and force mean little",
            ),
            stats={
                "seconds": time.perf_counter() - started,
                "length_u": float(u),
                "length_v": float(v),
                "log_evidence": sum(evidence),
            },
            uncertainty=Uncertainty(field.standard_deviation),
        )
        return solution, misfit, deviations

    def _base(self, problem: Problem) -> FloatArray:
        """Points at rest, shape (b, 2), mm."""
        return evenly_spaced_points(problem.mesh, "base", 5) if self.clamp else np.zeros((0, 2))


@dataclass(frozen=True, eq=False)
class GaussianProcessField(KernelField):
    """The posterior mean of two processes, with the processes of scikit-learn for u and v."""

    processes: list[Any]

    def standard_deviation(self, location: LocatedPoints) -> FloatArray:
        """Standard deviation of the displacement, shape (n, 2), mm."""
        spreads = [process.predict(location.points, return_std=True)[1] for process in self.processes]
        return np.stack(spreads, axis=1)


def _fit(misfit: Misfit, deviations: FloatArray, base: FloatArray, kernel: Kernel) -> GaussianProcessField:
    """The processes through markers with standard deviations (m, 2), mm, and through points at rest."""
    from sklearn.exceptions import ConvergenceWarning
    from sklearn.gaussian_process import GaussianProcessRegressor
    from sklearn.gaussian_process.kernels import ConstantKernel, Matern

    points = np.concatenate([misfit.points, base])
    observed = np.concatenate([misfit.observed, np.zeros_like(base)])
    deviations = np.concatenate([deviations, np.full_like(base, deviations.min())])
    # Start and search range of variance, mm², and length, mm
    covariance = ConstantKernel(10.0, (1e-4, 1e6)) * Matern(30.0, (1.0, 1000.0), SMOOTHNESS[kernel])
    processes = []
    for axis in (0, 1):
        process = GaussianProcessRegressor(covariance, alpha=deviations[:, axis] ** 2)
        with threadpool_limits(1, user_api="blas"), warnings.catch_warnings():
            # On small matrices BLAS's threads wait for one another.
            # An end of the search range is a valid result: constant over the finger, or the markers alone.
            warnings.simplefilter("ignore", ConvergenceWarning)
            processes.append(process.fit(points, observed[:, axis]))
    variances, lengths = np.exp([process.kernel_.theta for process in processes]).T
    coefficients = variances * np.stack([process.alpha_ for process in processes], axis=1)
    return GaussianProcessField(points, coefficients, lengths, kernel, processes)
