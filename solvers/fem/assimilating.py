"""`fem-asm`: the displacement of least energy plus misfit to the markers, exactly, on the shared mesh.

Here for the linear law; `assimilated` does it at finite strain.
"""

import time
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from typing import ClassVar

import numpy as np

from geometry.errors import UserError
from geometry.observations import Observations
from solvers.assimilation.marker_weight import Choice, WeightChoice
from solvers.assimilation.misfit import (
    Misfit,
    Weighting,
    check_weighting,
    leave_one_out_displacements,
    misfit_of,
)
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
    """`fem` that is pulled toward the markers: one factorisation, and a solve for each component of a marker.

    With a law of finite strain it is `fem-nonlinear` that is pulled, and markers are left out by solving on.

    Attributes:
        degree: Degree of the elements, 1 or 2.
        weights: Of the markers, see `misfit_of`: "paper" or "precision".
        asm_weight: λ_ASM for "paper", MPa/mm².
        scale: For "precision", energy of the model's own error, N mm / mm.
        marker_radius: Radius of the discs over which the displacement is averaged, mm; None: that of the
            observations; zero: the markers' centres alone.
        contact_deviation: Standard deviation of the contact's displacement about what is prescribed, mm,
            where the prior is exp(-E / scale): a spring of the stiffness scale / contact_deviation² between
            contact and indenter. Zero: the contact moves as prescribed, as it does for other solvers.
        choose: "given": the weights as they are; "left-out" or "evidence": times a factor, see
            `WeightChoice`; for the linear law.
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
        check_weighting(self.name, self.weights, self.asm_weight, self.scale, self.marker_radius)
        if not (np.isfinite(self.contact_deviation) and self.contact_deviation >= 0):
            raise UserError(
                f"fem-asm: contact_deviation must be zero or more, got {self.contact_deviation} (mm)"
            )
        _ = self.choice

    def settings(self) -> dict[str, object]:
        """The element degree, and what the markers weigh."""
        return asdict(self)

    def solve(self, problem: Problem, progress: Progress = silent) -> Solution:
        """Solve for the minimiser; see `Solver`. Without observations it is that of the law's own solver.

        Raises:
            UserError: If weights are to be chosen at finite strain, or a patch is to have a deviation.
        """
        check_problem(self, problem)
        linear = problem.material.law in FemSolver.laws
        if not linear and self.choose != "given":
            raise UserError(f"fem-asm: choose={self.choose} is for the linear law; take given")
        if problem.observations is not None and self.asm_weight * self.scale:
            return on_all_ranks(self._solve if linear else self._solve_nonlinear, problem, progress)
        if linear:
            plain = FemSolver(degree=self.degree, estimate=False).solve(problem, progress)
            status = Status(True, "without markers, or with weights of zero, this is fem")
            return replace(plain, solver=self.name, status=status)
        stiff = FemNonlinearSolver(degree=self.degree).solve(problem, progress)
        said = f"without markers, or with weights of zero, this is fem-nonlinear: {stiff.status.message}"
        return replace(stiff, solver=self.name, status=replace(stiff.status, message=said))

    @property
    def choice(self) -> WeightChoice:
        """How the factor of the weights is chosen."""
        return WeightChoice.of(self.name, self.choose, self.weights, self.scale)

    def prepare(self, problem: Problem) -> tuple[MarkerCompliance, Misfit]:
        """Factorise, and solve for the forces at the markers; further weights and markers cost no solve.

        Raises:
            UserError: If the problem has no observations, or a patch is to have a deviation.
        """
        misfit = self.misfit(problem)
        return MarkerCompliance.of(problem, self.degree, misfit, self.slack), misfit

    @property
    def slack(self) -> float:
        """Compliance of the springs between contact and indenter, mm per N/mm."""
        return self.contact_deviation**2 / self.scale

    def misfit(self, problem: Problem) -> Misfit:
        """The misfit to the problem's observations.

        Raises:
            UserError: If there are none, or a patch is to have a deviation.
        """
        if self.contact_deviation and problem.load.kind == "patch":
            raise UserError(
                "fem-asm: every point of a patch moves as prescribed; contact_deviation must be 0"
            )
        misfit = misfit_of(
            problem,
            weights=self.weights,
            asm_weight=self.asm_weight,
            scale=self.scale,
            marker_radius=self.marker_radius,
        )
        if misfit is None:
            raise UserError("fem-asm was given no markers to assimilate")
        return misfit

    def refitter(self, problem: Problem) -> Callable[[Observations], Solution]:
        """What solves for other observations of these markers, by one factorisation if the law is linear."""
        whole: list[tuple[MarkerCompliance, Misfit]] = []

        def refit(observations: Observations) -> Solution:
            own, every = (
                replace(problem, observations=replace(observations, visible=seen))
                for seen in (observations.visible, np.ones_like(observations.visible))
            )
            if problem.material.law not in FemSolver.laws:
                return self.solve(own)
            misfit = self.misfit(own)
            if not whole:
                whole.append(self.prepare(every))
            finger, markers = whole[0]
            if misfit.radius != markers.radius or not np.array_equal(markers.points, observations.points):
                return self.solve(own)
            return self._fitted(own, finger.of_markers(observations.visible), misfit)

        return refit

    def _solve_nonlinear(self, problem: Problem, progress: Progress) -> Solution:
        return assimilated(
            self.name,
            problem,
            degree=self.degree,
            misfit=self.misfit(problem),
            slack=self.slack,
            progress=progress,
        )

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
        factor = self.choice.factor(forces)
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
                "misfit": misfit.scaled(factor).value(misfit.observed - fit.residual),
                "marker_force": float(np.linalg.norm(fit.forces, axis=1).max()),
            },
            history=self.choice.curve(forces),
            left_out=leave_one_out_displacements(problem, fit.left_out),
        )
