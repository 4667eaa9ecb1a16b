"""`fem-asm`: the displacement of least energy plus misfit to the markers, exactly, on the shared mesh.

This module has the linear law; `assimilated` has finite strain.
"""

import time
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from typing import ClassVar

import numpy as np

from geometry.errors import UserError
from geometry.observations import Observations
from solvers.assimilation.marker_weighting import Choice, MarkerWeighting
from solvers.assimilation.misfit import Misfit, Weighting, leave_one_out_displacements
from solvers.fem.boundary_conditions import reaction_by_residual_work
from solvers.fem.finite_strain.assimilation import assimilated
from solvers.fem.finite_strain.solver import FemNonlinearSolver
from solvers.fem.linear import FemSolver
from solvers.fem.marker_compliance import MarkerCompliance
from solvers.fem.ranks import on_all_ranks
from solvers.lagrange import LagrangeField
from solvers.problem import Problem
from solvers.solution import Solution, Status
from solvers.solver import Progress, check_problem, silent


@dataclass(frozen=True)
class FemAsmSolver:
    """`fem` with the markers' misfit: one factorisation, and one solve for each component of a marker.

    For a law of finite strain it is `fem-nonlinear` with the misfit, solved again without each marker.

    Attributes:
        degree: Degree of the elements, 1 or 2.

    The other settings are those of `MarkerSettings`.
    """

    degree: int = 2
    weights: Weighting = "paper"
    asm_weight: float = 1000.0
    scale: float = 1.0
    marker_radius: float | None = None
    contact_deviation: float = 0.0
    choose: Choice = "given"
    name: ClassVar[str] = "fem-asm"
    laws: ClassVar[tuple[str, ...]] = FemSolver.laws + FemNonlinearSolver.laws
    loads: ClassVar[tuple[str, ...]] = FemSolver.loads
    assimilates: ClassVar[bool] = True

    def __post_init__(self) -> None:
        if self.degree not in (1, 2):
            raise UserError(f"fem-asm has elements of degree 1 and 2, not {self.degree}")
        _ = self.weighting

    def settings(self) -> dict[str, object]:
        """The element degree and the markers' weighting."""
        return asdict(self)

    def solve(self, problem: Problem, progress: Progress = silent) -> Solution:
        """Solve for the minimiser; see `Solver`. Without markers it is that of `fem` or `fem-nonlinear`.

        Raises:
            UserError: If a factor is to be chosen at finite strain, or a patch is to have a deviation.
        """
        check_problem(self, problem)
        linear = problem.material.law in FemSolver.laws
        if self.weighting.misfit(problem) is not None:
            return on_all_ranks(self._solve if linear else self._solve_nonlinear, problem, progress)
        if linear:
            plain = FemSolver(degree=self.degree, estimate=False).solve(problem, progress)
            status = Status(True, "without markers, or with weights of zero, this is fem")
            return replace(plain, solver=self.name, status=status)
        stiff = FemNonlinearSolver(degree=self.degree).solve(problem, progress)
        said = f"without markers, or with weights of zero, this is fem-nonlinear: {stiff.status.message}"
        return replace(stiff, solver=self.name, status=replace(stiff.status, message=said))

    @property
    def weighting(self) -> MarkerWeighting:
        """The weights of the markers and the choice of their factor."""
        return MarkerWeighting.of(self)

    def prepare(self, problem: Problem) -> tuple[MarkerCompliance, Misfit]:
        """Factorise, and solve for the forces at the markers; further weights and markers cost no solve.

        Raises:
            UserError: If the problem has no markers that weigh anything, or a patch is to have a deviation.
        """
        misfit = self.weighting.misfit(problem)
        if misfit is None:
            raise UserError("fem-asm was given no markers to assimilate")
        return MarkerCompliance.of(problem, self.degree, misfit, self.weighting.slack), misfit

    def refitter(self, problem: Problem) -> Callable[[Observations], Solution]:
        """See `Refittable`; one factorisation for all observations if the law is linear."""
        whole: list[tuple[MarkerCompliance, Misfit]] = []

        def refit(observations: Observations) -> Solution:
            own, every = (
                replace(problem, observations=replace(observations, visible=seen))
                for seen in (observations.visible, np.ones_like(observations.visible))
            )
            misfit = self.weighting.misfit(own)
            if misfit is None or problem.material.law not in FemSolver.laws:
                return self.solve(own)
            if not whole:
                whole.append(self.prepare(every))
            finger, markers = whole[0]
            if misfit.radius != markers.radius or not np.array_equal(markers.points, observations.points):
                return self.solve(own)
            return self._fitted(own, finger.of_markers(observations.visible), misfit)

        return refit

    def _solve_nonlinear(self, problem: Problem, progress: Progress) -> Solution:
        return assimilated(problem, self.weighting, degree=self.degree, progress=progress)

    def _solve(self, problem: Problem, progress: Progress) -> Solution:
        started = time.perf_counter()
        finger, misfit = self.prepare(problem)
        progress(0.9, "solved for the forces at the markers")
        solution = self._fitted(problem, finger, misfit)
        finger.equilibrium.factors.destroy()
        return replace(solution, stats={**solution.stats, "seconds": time.perf_counter() - started})

    def _fitted(self, problem: Problem, finger: MarkerCompliance, misfit: Misfit) -> Solution:
        started = time.perf_counter()
        forces = finger.forces(misfit)
        factor = self.weighting.factor(forces)
        fit = forces.fit(factor)
        nodal, elasticity = finger.under(fit.forces), finger.equilibrium.elasticity
        space = elasticity.distributed.space
        residual = elasticity.internal_force(nodal)
        return Solution(
            solver=self.name,
            problem=problem,
            field=LagrangeField(space, nodal),
            energy=0.5 * float((nodal * residual).sum()),
            reaction=reaction_by_residual_work(space, residual) - fit.forces.sum(axis=0),
            status=Status(True, f"the minimiser on this mesh; {fit.phrase}"),
            stats={
                "seconds": time.perf_counter() - started,
                "unknowns": nodal.size,
                "triangles": len(problem.mesh.triangles),
                "degree": self.degree,
                "ranks": elasticity.distributed.comm.size,
                "weight_factor": factor,
                "misfit": factor * misfit.value(misfit.observed - fit.residual),
                "marker_force": float(np.linalg.norm(fit.forces, axis=1).max()),
            },
            history=self.weighting.curve(forces),
            left_out=leave_one_out_displacements(problem, fit.left_out),
        )
