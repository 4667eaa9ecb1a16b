"""`gp`: a Gaussian process through the markers, without mechanics: the null model.

A solver with mechanics has to predict held-out markers better than this.

Source: C. E. Rasmussen, C. K. I. Williams, Gaussian Processes for Machine Learning, MIT Press 2006, equations
2.23 to 2.26 and chapter 5, as scikit-learn has them.
"""

import time
import warnings
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np
from threadpoolctl import threadpool_limits

from geometry.arrays import FloatArray
from geometry.mesh.boundary import evenly_spaced_points
from geometry.mesh.point_location import LocatedPoints
from geometry.observations import Observations
from solvers.assimilation.misfit import (
    MarkerSettings,
    Misfit,
    leave_one_out_displacements,
    misfit_of,
    standard_deviations,
)
from solvers.energy_and_force import energy_and_force
from solvers.problem import Problem
from solvers.solution import Solution, Status, Uncertainty
from solvers.solver import Family, FieldSettings, Progress, UnsupportedProblemError, check_problem, silent
from solvers.statistics.kernel_field import SMOOTHNESS, Kernel, KernelField

MIN_MARKERS = 3
"""Minimum number of markers that determines the two hyperparameters of a kernel."""
BASE_POINTS = 5
"""Number of points at rest on the base, with `clamp`."""
LENGTHS, VARIANCES = (1.0, 1000.0), (1e-4, 1e6)
"""Search ranges of a kernel's length, mm, and variance, mm²."""
START_LENGTH, START_VARIANCE = 30.0, 10.0


@dataclass(frozen=True)
class GaussianProcessSolver(FieldSettings):
    """u and v as independent processes of mean zero with one of Matérn's kernels.

    Length and variance of each kernel maximise the marginal likelihood, also of the markers that remain when
    one is left out.

    Attributes:
        clamp: Whether the process is conditioned on a base at rest, a stronger null model.
        kernel: Covariance function: "matern32", "matern52" or "gaussian" (squared exponential).
    """

    clamp: bool = False
    kernel: Kernel = "matern52"
    name: ClassVar[str] = "gp"
    family: ClassVar[Family] = "statistics"
    laws: ClassVar[tuple[str, ...]] = ("linear",)
    loads: ClassVar[tuple[str, ...]] = ("mean", "point", "patch")
    assimilates: ClassVar[bool] = True

    def solve(self, problem: Problem, progress: Progress = silent) -> Solution:
        """Fit the processes to the problem's observations; see `Solver`.

        Raises:
            UnsupportedProblemError: If fewer than `MIN_MARKERS` markers and one to leave out were seen.
        """
        check_problem(self, problem)
        started = time.perf_counter()
        solution, misfit, deviations = self._fitted(problem, MIN_MARKERS + 1)
        base, count = self._base(problem), len(misfit.points)
        residuals, spread = np.zeros((2, count, 2))
        for marker in range(count):
            progress(marker / count, "leaving each marker out")
            others = _fit(misfit.without(marker), np.delete(deviations, marker, axis=0), base, self.kernel)
            there = problem.mesh.locate(misfit.points[[marker]])
            residuals[marker] = misfit.observed[marker] - others.displacement(there)[0]
            spread[marker] = np.hypot(others.standard_deviation(there)[0], deviations[marker])
        within = float((np.abs(residuals) < 2 * spread).mean())
        seconds = time.perf_counter() - started
        stats = {**solution.stats, "seconds": seconds, "left_out_within_2sd": within}
        return replace(solution, stats=stats, left_out=leave_one_out_displacements(problem, residuals))

    def refitter(self, problem: Problem) -> Callable[[Observations], Solution]:
        """A function that fits other observations, without leaving any out; see `Refittable`."""
        return lambda observations: self._fitted(replace(problem, observations=observations), MIN_MARKERS)[0]

    def _fitted(self, problem: Problem, least: int) -> tuple[Solution, Misfit, FloatArray]:
        """The solution, the misfit of the markers seen, and their standard deviations (m, 2), mm."""
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
        lengths = field.lengths
        solution = Solution(
            solver=self.name,
            problem=problem,
            field=field,
            energy=energy,
            reaction=reaction,
            status=Status(
                True,
                f"an interpolation of the markers without mechanics, over lengths of {lengths[0]:.3g} mm in "
                f"u and {lengths[1]:.3g} mm in v; its energy and force mean little",
            ),
            stats={
                "seconds": time.perf_counter() - started,
                "length_u": float(lengths[0]),
                "length_v": float(lengths[1]),
                "log_evidence": sum(
                    float(process.log_marginal_likelihood_value_) for process in field.processes
                ),
            },
            uncertainty=Uncertainty(field.standard_deviation),
        )
        return solution, misfit, deviations

    def _base(self, problem: Problem) -> FloatArray:
        """Points at rest, shape (b, 2), mm."""
        if not self.clamp:
            return np.zeros((0, 2))
        return evenly_spaced_points(problem.mesh, "base", BASE_POINTS)


@dataclass(frozen=True, eq=False)
class GaussianProcessField(KernelField):
    """The posterior mean of two processes, with the processes of scikit-learn for u and v."""

    processes: list[Any]

    def standard_deviation(self, location: LocatedPoints) -> FloatArray:
        """Standard deviation of the displacement, shape (n, 2), mm."""
        return np.stack(
            [process.predict(location.points, return_std=True)[1] for process in self.processes], 1
        )


def _fit(misfit: Misfit, deviations: FloatArray, base: FloatArray, kernel: Kernel) -> GaussianProcessField:
    """The processes through markers with standard deviations (m, 2), mm, and through points at rest."""
    from sklearn.exceptions import ConvergenceWarning
    from sklearn.gaussian_process import GaussianProcessRegressor
    from sklearn.gaussian_process.kernels import ConstantKernel, Matern

    points = np.concatenate([misfit.points, base])
    observed = np.concatenate([misfit.observed, np.zeros_like(base)])
    deviations = np.concatenate([deviations, np.full_like(base, deviations.min())])
    covariance = ConstantKernel(START_VARIANCE, VARIANCES) * Matern(START_LENGTH, LENGTHS, SMOOTHNESS[kernel])
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
