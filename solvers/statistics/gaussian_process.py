"""`gp`: a Gaussian process through the markers, which knows nothing of mechanics: the null model.

What a solver that knows the mechanics has to beat at markers that it was not given.

Source: C. E. Rasmussen, C. K. I. Williams, Gaussian Processes for Machine Learning, MIT Press 2006, equations
2.23 to 2.26 and chapter 5, as scikit-learn has them.
"""

import time
import warnings
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from typing import Any, ClassVar

import numpy as np

from geometry.arrays import FloatArray
from geometry.mesh.point_location import LocatedPoints
from geometry.mesh.quadrature import body_quadrature
from geometry.observations import Observations
from solvers.assimilation.misfit import Misfit, leave_one_out_displacements, misfit_of, standard_deviations
from solvers.elasticity import linear_energy_density
from solvers.problem import Problem
from solvers.section_force import section_force
from solvers.solution import Solution, Status
from solvers.solver import Progress, UnsupportedProblemError, check_problem, silent
from solvers.statistics.kernel_field import SMOOTHNESS, Kernel, KernelField

FEWEST = 3
"""Markers below which two constants of a kernel cannot be found."""
CLAMPED = 5
"""Points of the base that are known to be at rest, with `clamp`."""
LENGTHS, VARIANCES = (1.0, 1000.0), (1e-4, 1e6)
"""Between what a kernel's length, mm, and variance, mm², are looked for."""
START_LENGTH, START_VARIANCE = 30.0, 10.0


@dataclass(frozen=True)
class GaussianProcessSolver:
    """u and v as independent processes of mean zero with one of Matérn's kernels.

    Length and variance of each kernel have the largest marginal likelihood. A marker that is left out is left
    out of that choice too.

    Attributes:
        clamp: Whether the process is told that the base is at rest, which makes it a stronger null model. By
            default it is told the markers only.
        kernel: How smooth the processes are: "matern32", "matern52" or "gaussian" (squared exponential).
    """

    clamp: bool = False
    kernel: Kernel = "matern52"
    name: ClassVar[str] = "gp"
    laws: ClassVar[tuple[str, ...]] = ("linear",)
    loads: ClassVar[tuple[str, ...]] = ("mean", "point", "patch")
    assimilates: ClassVar[bool] = True

    def settings(self) -> dict[str, object]:
        """Whether the base is known to be at rest, and the kernel."""
        return asdict(self)

    def solve(self, problem: Problem, progress: Progress = silent) -> Solution:
        """Fit the processes to the problem's observations; see `Solver`.

        Raises:
            UnsupportedProblemError: If there are fewer markers than `FEWEST` and one that can be left out.
        """
        check_problem(self, problem)
        started = time.perf_counter()
        solution, misfit, deviations = self._through(problem, FEWEST + 1)
        base, count = self._base(problem), len(misfit.points)
        missed, spread = np.zeros((2, count, 2))
        for marker in range(count):
            progress(marker / count, "leaving each marker out")
            others = _fit(misfit.without(marker), np.delete(deviations, marker, axis=0), base, self.kernel)
            there = problem.mesh.locate(misfit.points[[marker]])
            missed[marker] = misfit.observed[marker] - others.displacement(there)[0]
            spread[marker] = np.hypot(others.standard_deviation(there)[0], deviations[marker])
        within = float((np.abs(missed) < 2 * spread).mean())
        seconds = time.perf_counter() - started
        stats = {**solution.stats, "seconds": seconds, "left_out_within_2sd": within}
        return replace(solution, stats=stats, left_out=leave_one_out_displacements(problem, missed))

    def refitter(self, problem: Problem) -> Callable[[Observations], Solution]:
        """What fits other observations, without leaving any out; see `Refittable`."""
        return lambda observations: self._through(replace(problem, observations=observations), FEWEST)[0]

    def _through(self, problem: Problem, least: int) -> tuple[Solution, Misfit, FloatArray]:
        """The processes through the markers that were seen; these; standard deviations (m, 2), mm."""
        started = time.perf_counter()
        misfit = misfit_of(problem, marker_radius=0.0)
        count = 0 if misfit is None else len(misfit.points)
        if misfit is None or problem.observations is None or count < least:
            raise UnsupportedProblemError(
                f"gp goes through markers: it needs {least} that were seen, not {count}"
            )
        deviations = standard_deviations(problem.observations)
        field = _fit(misfit, deviations, self._base(problem), self.kernel)
        rule = body_quadrature(problem.mesh, 4)
        gradient = field.gradient(rule.location)
        density = linear_energy_density(gradient, problem.material.lame)
        lengths = field.mean.lengths
        solution = Solution(
            solver=self.name,
            problem=problem,
            field=field,
            energy=float((rule.weights * density).sum()),
            reaction=section_force(problem, rule, gradient),
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
        )
        return solution, misfit, deviations

    def _base(self, problem: Problem) -> FloatArray:
        """Points that are known to be at rest, shape (b, 2), mm."""
        if not self.clamp:
            return np.zeros((0, 2))
        points = problem.mesh.points[problem.mesh.boundary("base").ravel()]
        low, high = points[points[:, 1].argmin()], points[points[:, 1].argmax()]
        return np.asarray(np.linspace(low, high, CLAMPED))


@dataclass(frozen=True, eq=False)
class GaussianProcessField:
    """The posterior of two processes.

    Attributes:
        mean: Its mean.
        processes: Those of scikit-learn, for u and v.
    """

    mean: KernelField
    processes: tuple[Any, Any]

    def displacement(self, location: LocatedPoints) -> FloatArray:
        """Displacement, shape (n, 2), mm."""
        return self.mean.displacement(location)

    def gradient(self, location: LocatedPoints) -> FloatArray:
        """Displacement gradient du_i/dx_j, shape (n, 2, 2)."""
        return self.mean.gradient(location)

    def standard_deviation(self, location: LocatedPoints) -> FloatArray:
        """Of the displacement, shape (n, 2), mm."""
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
        with warnings.catch_warnings():
            # An end of the range is a fair answer: constant over the finger, or nothing but the markers.
            warnings.simplefilter("ignore", ConvergenceWarning)
            processes.append(process.fit(points, observed[:, axis]))
    variances, lengths = np.exp([process.kernel_.theta for process in processes]).T
    coefficients = variances * np.stack([process.alpha_ for process in processes], axis=1)
    mean = KernelField(points, coefficients, lengths, kernel)
    return GaussianProcessField(mean, (processes[0], processes[1]))
