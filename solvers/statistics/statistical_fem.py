"""`statfem`: finite elements with an uncertain load, plus a Gaussian process for the model discrepancy.

The observations are d = ρ B u + δ + e: the displacement u of finite elements at the markers, times a
factor ρ, a discrepancy δ and the error e of the observations. Random, and normal a priori, are:

- the prescribed displacement of the contact, about its nominal value, each component with the standard
  deviation `stroke_deviation`; as the problem is linear, u is a sum of one field for each component;
- δ, a process of mean zero with a kernel of Matérn, one length, an amplitude each for u and v;
- e, with the observations' standard deviations.

ρ, the amplitudes and the length maximise the marginal likelihood. The displacement returned is the posterior
mean of ρ u + δ.

Source: M. Girolami, E. Febrianto, G. Yin, F. Cirak, The statistical finite element method (statFEM), Comput.
Methods Appl. Mech. Engrg. 375 (2021) 113533: the model of the data, its conditioning and its marginal
likelihood. There the source term is random; here it is the prescribed displacement.

At finite strain u is linearised about the nominal load: the shape of its largest component is the
secant from rest, the other is the tangent. Under the linear law the stroke of a cylinder is the mean
displacement of the contact.
"""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import cast

import numpy as np

from pinnray.geometry.observations import Observations
from pinnray.runtime.errors import UserError
from pinnray.solvers.assimilation.misfit import standard_deviations
from pinnray.solvers.assimilation.picture_frames import FramedData, FreePictures
from pinnray.solvers.fem.finite_strain.solver import FemNonlinearSolver
from pinnray.solvers.fem.linear import FemSolver
from pinnray.solvers.lagrange import LagrangeField
from pinnray.solvers.problem import Load, Problem
from pinnray.solvers.solution import Solution, Status
from pinnray.solvers.solver import Cost, ElementSettings, NoSolutionError, Progress, check_problem, silent
from pinnray.solvers.statistics.kernel_field import MarkerPrediction, with_markers_left_out
from pinnray.solvers.statistics.statistical_posterior import (
    Posterior,
    StatFemData,
    StatFemField,
    framed_posterior,
    posterior_solution,
    predicted,
)

TANGENT_STEP = 0.1
"""Change of a prescribed displacement for its tangent at finite strain, mm."""


@dataclass(frozen=True)
class StatFemSolver(ElementSettings):
    """Finite elements with an uncertain load and a discrepancy, conditioned on the markers."""

    stroke_deviation: float = 0.5  # Standard deviation of each prescribed displacement, mm
    name = "statfem"
    family = "statistics"
    laws = (*FemSolver.laws, *FemNonlinearSolver.laws)
    loads = FemNonlinearSolver.loads
    friction = True
    assimilates = True
    cost = Cost(per_triangle=66)

    def __post_init__(self) -> None:
        super().__post_init__()
        self.check_not_negative("stroke_deviation")

    def solve(self, problem: Problem, progress: Progress = silent) -> Solution:
        """Condition on the problem's observations; see `Solver`. Without any it is `fem`."""
        check_problem(self, problem)
        if problem.observations is None:
            fem = self._fem(problem)
            plain = fem.solve(replace(problem, load=self._load(problem)), progress)
            said = Status(plain.status.converged, f"without markers this is {fem.name}")
            return replace(plain, solver=self.name, status=said)
        started = time.perf_counter()
        shapes = self._shapes(problem, progress)
        solution, posterior, pictures = self._conditioned(problem, problem.observations, shapes)
        data = posterior.data

        def without(marker: int) -> MarkerPrediction:
            progress(0.5 + marker / len(data.points) / 2, "leaving each marker out")
            others = Posterior.of(data.without(marker))
            return predicted(others, data, pictures, marker)

        return with_markers_left_out(solution, pictures.shown, without, started)

    def refitter(self, problem: Problem) -> Callable[[Observations], Solution]:
        """A function that solves for other observations with the same finite elements; see `Refittable`."""
        shapes = self._shapes(problem, silent)

        def refit(observations: Observations) -> Solution:
            return self._conditioned(replace(problem, observations=observations), observations, shapes)[0]

        return refit

    def _fem(self, problem: Problem) -> FemSolver | FemNonlinearSolver:
        if problem.material.law == "linear":
            return FemSolver(degree=self.degree, estimate=False)
        return FemNonlinearSolver(degree=self.degree)

    def _load(self, problem: Problem) -> Load:
        """The load that the finite elements take: a linear law knows no cylinder."""
        linear = problem.material.law == "linear"
        return problem.load.as_mean() if linear and problem.load.kind == "cylinder" else problem.load

    def _shapes(self, problem: Problem, progress: Progress) -> list[LagrangeField]:
        """Finite elements for a unit displacement of each prescribed component of the contact.

        At finite strain their sum, times the nominal displacements, is the solution; others add tangents. A
        `UserError` says that the finger has no equilibrium under the nominal load or near it.
        """
        fem, load = self._fem(problem), self._load(problem)

        def moved(displacement: Sequence[float | None]) -> LagrangeField:
            there = load.model_copy(update={"displacement": tuple(displacement)})
            solution = fem.solve(replace(problem, load=there, observations=None), progress)
            if not solution.status.converged:
                raise NoSolutionError(f"statfem needs {fem.name}: {solution.status.message}")
            return cast(LagrangeField, solution.field)

        if isinstance(fem, FemSolver):
            prepared = fem.prepare(replace(problem, load=load, observations=None))
            progress(0.3, "factorised")
            rest = [None if value is None else 0.0 for value in load.displacement]
            found = []
            for own in load.prescribed:
                unit = tuple(1.0 if axis == own else value for axis, value in enumerate(rest))
                found.append(prepared.solve(load.model_copy(update={"displacement": unit})).field)
            prepared.destroy()
            return cast(list[LagrangeField], found)
        main = int(np.abs(load.values).argmax())
        if not load.values[main]:
            raise UserError("statfem at finite strain needs a load that moves the contact")
        whole = moved(load.displacement)
        nodal, secant = {}, whole.values
        for number, axis in enumerate(load.prescribed):
            if number != main:
                beside = list(load.displacement)
                beside[axis] = load.values[number] + TANGENT_STEP
                nodal[number] = (moved(beside).values - whole.values) / TANGENT_STEP
                secant = secant - load.values[number] * nodal[number]
        nodal[main] = secant / load.values[main]
        return [LagrangeField(whole.space, nodal[number]) for number in sorted(nodal)]

    def _data(
        self,
        problem: Problem,
        observations: Observations,
        framed: FramedData,
        shapes: Sequence[LagrangeField],
    ) -> StatFemData:
        points = observations.points[observations.visible]
        location = problem.mesh.locate(points)
        return StatFemData(
            points=points,
            observed=framed.observed,
            deviations=standard_deviations(observations),
            frames=framed.frames,
            shapes=np.stack([shape.displacement(location) for shape in shapes]),
            load=problem.load.values,
            load_deviation=self.stroke_deviation,
        )

    def _conditioned(
        self, problem: Problem, observations: Observations, shapes: Sequence[LagrangeField]
    ) -> tuple[Solution, Posterior, FreePictures]:
        started, pictures = time.perf_counter(), FreePictures.of(observations)

        def conditioned(framed: FramedData) -> Posterior:
            return Posterior.of(self._data(problem, observations, framed, shapes))

        posterior = framed_posterior(pictures, conditioned)
        data = posterior.data
        factor, (u, v), (length, _) = posterior.constants
        _, variances = posterior.at(data.points, data.shapes)
        loads = zip(problem.load.prescribed, posterior.load, strict=True)
        solution = posterior_solution(
            self.name,
            problem,
            StatFemField(posterior, shapes),
            pictures,
            f"{self._fem(problem).name} times {factor:.3g} plus a discrepancy of {u:.2g} mm in u and "
            f"{v:.2g} mm in v over {length:.3g} mm; its energy and force include the discrepancy's",
            {
                "seconds": time.perf_counter() - started,
                "unknowns": shapes[0].values.size,
                "factor": factor,
                "discrepancy_u": float(u),
                "discrepancy_v": float(v),
                "length": float(length),
                "deviation_at_markers": float(np.sqrt(variances.max())),
                **{f"load_{'uv'[axis]}": float(value) for axis, value in loads},
            },
        )
        return solution, posterior, pictures
