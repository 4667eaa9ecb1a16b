"""`statfem`: finite elements with an uncertain load, plus a Gaussian process for the model discrepancy.

The observations are d = ρ B u + δ + e: the displacement u of finite elements at the markers, times a
factor ρ, a discrepancy δ and the error e of the observations. Random, and normal a priori, are:

- the prescribed displacement of the contact, about its nominal value, each component with the standard
  deviation `stroke_deviation`; as the problem is linear, u is a sum of one field for each component;
- δ, a process of mean zero with one of Matérn's kernels, one length, an amplitude each for u and v;
- e, with the observations' standard deviations.

ρ, the amplitudes and the length maximise the marginal likelihood. The displacement returned is the posterior
mean of ρ u + δ.

Source: M. Girolami, E. Febrianto, G. Yin, F. Cirak, The statistical finite element method (statFEM) for
coherent synthesis of observation data and model predictions, Comput. Methods Appl. Mech. Engrg. 375 (2021)
113533: the model of the data, its conditioning and its marginal likelihood. There the source term is random;
here it is the prescribed displacement.

At finite strain u is linearised about the nominal load: the shape of its largest component is the
secant from rest, the other is the tangent.
"""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from geometry.arrays import FloatArray
from geometry.errors import UserError
from geometry.observations import Observations
from solvers.assimilation.misfit import leave_one_out_displacements, standard_deviations
from solvers.energy_and_force import energy_and_force
from solvers.fem.finite_strain.solver import FemNonlinearSolver
from solvers.fem.linear import FemSolver
from solvers.lagrange import LagrangeField
from solvers.problem import Problem
from solvers.solution import Solution, Status, Uncertainty
from solvers.solver import Family, FieldSettings, Progress, check_problem, silent
from solvers.statistics.kernel_field import Kernel
from solvers.statistics.statistical_posterior import Posterior, StatFemData, StatFemField

TANGENT_STEP = 0.1
"""Change of a prescribed displacement for its tangent at finite strain, mm."""


@dataclass(frozen=True)
class StatFemSolver(FieldSettings):
    """Finite elements with an uncertain load and a discrepancy, conditioned on the markers.

    Attributes:
        degree: Degree of the elements, 1 or 2.
        stroke_deviation: Standard deviation of each component of the prescribed displacement, mm.
        kernel: Covariance function of the discrepancy, as of `gp`.
    """

    degree: int = 2
    stroke_deviation: float = 0.5
    kernel: Kernel = "matern52"
    name: ClassVar[str] = "statfem"
    family: ClassVar[Family] = "statistics"
    laws: ClassVar[tuple[str, ...]] = (*FemSolver.laws, *FemNonlinearSolver.laws)
    loads: ClassVar[tuple[str, ...]] = FemSolver.loads
    assimilates: ClassVar[bool] = True

    def __post_init__(self) -> None:
        self.check_degree(self.degree)
        if not (np.isfinite(self.stroke_deviation) and self.stroke_deviation >= 0):
            raise UserError(
                f"statfem: stroke_deviation must be zero or more, got {self.stroke_deviation} (mm)"
            )

    def solve(self, problem: Problem, progress: Progress = silent) -> Solution:
        """Condition on the problem's observations; see `Solver`. Without any it is `fem`."""
        check_problem(self, problem)
        if problem.observations is None:
            fem = self._fem(problem)
            plain = fem.solve(problem, progress)
            said = Status(plain.status.converged, f"without markers this is {fem.name}")
            return replace(plain, solver=self.name, status=said)
        started = time.perf_counter()
        shapes = self._shapes(problem, progress)
        data = self._data(problem, problem.observations, shapes)
        solution = self._conditioned(problem, data, shapes)
        residuals, spread = _leave_one_out(data, progress)
        within = float((np.abs(residuals) < 2 * spread).mean())
        seconds = time.perf_counter() - started
        stats = {**solution.stats, "seconds": seconds, "left_out_within_2sd": within}
        return replace(solution, stats=stats, left_out=leave_one_out_displacements(problem, residuals))

    def refitter(self, problem: Problem) -> Callable[[Observations], Solution]:
        """A function that solves for other observations with the same finite elements; see `Refittable`."""
        shapes = self._shapes(problem, silent)

        def refit(observations: Observations) -> Solution:
            data = self._data(problem, observations, shapes)
            return self._conditioned(replace(problem, observations=observations), data, shapes)

        return refit

    def _data(self, problem: Problem, observations: Observations, shapes: Sequence[Solution]) -> StatFemData:
        points = observations.points[observations.visible]
        return StatFemData(
            points=points,
            observed=observations.displacements[observations.visible],
            deviations=standard_deviations(observations),
            shapes=np.stack([shape.displacement(points) for shape in shapes]),
            load=problem.load.values,
            load_deviation=self.stroke_deviation,
            kernel=self.kernel,
        )

    def _shapes(self, problem: Problem, progress: Progress) -> list[Solution]:
        """Finite elements for a unit displacement of each prescribed component of the contact."""
        fem = self._fem(problem)
        if problem.material.law != "linear":
            return _linearised_shapes(fem, replace(problem, observations=None), progress)
        shapes = []
        for axis in problem.load.prescribed:
            unit = [None if value is None else 0.0 for value in problem.load.displacement]
            unit[axis] = 1.0
            load = problem.load.model_copy(update={"displacement": tuple(unit)})
            shapes.append(fem.solve(replace(problem, load=load, observations=None), progress))
        return shapes

    def _fem(self, problem: Problem) -> FemSolver | FemNonlinearSolver:
        """The model of the problem's law."""
        if problem.material.law == "linear":
            return FemSolver(degree=self.degree, estimate=False)
        return FemNonlinearSolver(degree=self.degree)

    def _conditioned(self, problem: Problem, data: StatFemData, shapes: Sequence[Solution]) -> Solution:
        started = time.perf_counter()
        posterior = Posterior.of(data, np.arange(len(data.points)))
        field = StatFemField(posterior, tuple(shape.field for shape in shapes))
        energy, reaction = energy_and_force(problem, field, 4)
        constants = posterior.constants
        discrepancy = constants.amplitudes
        _, variances = posterior.at(data.points, data.shapes)
        return Solution(
            solver=self.name,
            problem=problem,
            field=field,
            energy=energy,
            reaction=reaction,
            status=Status(
                True,
                f"{self._fem(problem).name} times {constants.factor:.3g} plus a discrepancy of "
                f"{discrepancy[0]:.2g} mm in u and {discrepancy[1]:.2g} mm in v over "
                f"{constants.length:.3g} mm; its energy and force include the discrepancy's",
            ),
            stats={
                "seconds": time.perf_counter() - started,
                "unknowns": int(shapes[0].stats["unknowns"]),
                "factor": constants.factor,
                "discrepancy_u": float(discrepancy[0]),
                "discrepancy_v": float(discrepancy[1]),
                "length": constants.length,
                "log_evidence": posterior.log_evidence,
                "deviation_at_markers": float(np.sqrt(variances.max())),
            }
            | {
                f"load_{'uv'[axis]}": float(value)
                for axis, value in zip(problem.load.prescribed, posterior.load, strict=True)
            },
            uncertainty=Uncertainty(field.standard_deviation),
        )


def _linearised_shapes(
    fem: FemSolver | FemNonlinearSolver, problem: Problem, progress: Progress
) -> list[Solution]:
    """Fields whose sum, times the nominal displacements, is the solution; a change of load adds tangents.

    Raises:
        UserError: If the finger has no equilibrium under the nominal load or near it.
    """
    values = problem.load.values
    main = int(np.abs(values).argmax())
    if not values[main]:
        raise UserError("statfem at finite strain needs a load that moves the contact")
    whole = _reached(fem, problem, progress)
    shapes: list[Solution] = []
    for number, axis in enumerate(problem.load.prescribed):
        if number == main:
            shapes.append(whole)
            continue
        moved = list(problem.load.displacement)
        moved[axis] = values[number] + TANGENT_STEP
        load = problem.load.model_copy(update={"displacement": tuple(moved)})
        there = _reached(fem, replace(problem, load=load), progress)
        shapes.append(
            replace(whole, field=_combined([(there, 1 / TANGENT_STEP), (whole, -1 / TANGENT_STEP)]))
        )
    rest = [(shape, -value) for shape, value in zip(shapes, values, strict=True) if shape is not whole]
    scaled = [(each, factor / values[main]) for each, factor in [(whole, 1.0), *rest]]
    shapes[main] = replace(whole, field=_combined(scaled))
    return shapes


def _reached(fem: FemNonlinearSolver | FemSolver, problem: Problem, progress: Progress) -> Solution:
    solution = fem.solve(problem, progress)
    if not solution.status.converged:
        raise UserError(f"statfem: {fem.name} {solution.status.message}")
    return solution


def _combined(parts: Sequence[tuple[Solution, float]]) -> LagrangeField:
    """A sum of finite-element fields, each times a factor."""
    fields = [(solution.field, factor) for solution, factor in parts]
    nodal = [factor * field.values for field, factor in fields if isinstance(field, LagrangeField)]
    first = fields[0][0]
    if not isinstance(first, LagrangeField) or len(nodal) < len(fields):
        raise TypeError("statfem adds fields of finite elements")
    return LagrangeField(first.space, np.sum(nodal, axis=0))


def _leave_one_out(data: StatFemData, progress: Progress) -> tuple[FloatArray, FloatArray]:
    """Leave-one-out residuals of the markers and their standard deviations, each (m, 2), mm."""
    every = np.arange(len(data.points))
    residuals, spread = np.zeros((2, len(every), 2))
    for marker in every:
        progress(0.5 + marker / len(every) / 2, "leaving each marker out")
        others = Posterior.of(data, np.delete(every, marker))
        mean, covariance = others.at(data.points[[marker]], data.shapes[:, [marker]])
        residuals[marker] = data.observed[marker] - mean[0]
        spread[marker] = np.sqrt(covariance[0] + data.deviations[marker] ** 2)
    return residuals, spread
