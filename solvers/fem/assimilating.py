"""`fem-asm`: the displacement of least energy plus misfit to the markers, exactly, on the shared mesh."""

import time
from dataclasses import asdict, dataclass, replace
from typing import ClassVar, Literal, get_args

import numpy as np

from geometry.arrays import FloatArray
from geometry.errors import UserError
from solvers.assimilation import (
    MARKER_RADIUS,
    Misfit,
    Weighting,
    check_weighting,
    misfit_of,
    without_each,
)
from solvers.fem.compliance import MarkerCompliance
from solvers.fem.conditions import reaction_by_residual_work
from solvers.fem.lagrange import LagrangeField
from solvers.fem.linear import FemSolver
from solvers.fem.ranks import on_all_ranks
from solvers.marker_forces import MarkerForces
from solvers.problem import Problem
from solvers.solution import Solution, Status
from solvers.solver import Progress, check_problem, silent

Choice = Literal["given", "left-out", "evidence"]

FACTORS: FloatArray = 10.0 ** np.arange(-9, 3.25, 0.25)
"""Factors of the weights on the L-curve, among which one can be chosen."""


@dataclass(frozen=True)
class FemAsmSolver:
    """`fem` that is pulled toward the markers: one factorisation, and a solve for each component of a marker.

    Attributes:
        degree: Degree of the elements, 1 or 2.
        weights: Of the markers, see `misfit_of`: "paper" or "precision".
        asm_weight: λ_ASM for "paper", MPa/mm².
        scale: For "precision", energy of the model's own error, N mm / mm.
        marker_radius: Of the discs over which the displacement is averaged, mm; zero for the points alone.
        choose: "given": the weights as they are; "left-out": times that one of `FACTORS` for which markers
            that are left out, one at a time, are missed least; "evidence": times that of the largest
            evidence, for "precision".
    """

    degree: int = 2
    weights: Weighting = "paper"
    asm_weight: float = 1000.0
    scale: float = 1.0
    marker_radius: float = MARKER_RADIUS
    choose: Choice = "given"
    name: ClassVar[str] = "fem-asm"
    laws: ClassVar[tuple[str, ...]] = FemSolver.laws
    loads: ClassVar[tuple[str, ...]] = FemSolver.loads
    assimilates: ClassVar[bool] = True

    def __post_init__(self) -> None:
        if self.degree not in (1, 2):
            raise UserError(f"fem-asm has elements of degree 1 and 2, not {self.degree}")
        check_weighting(self.name, self.weights, self.asm_weight, self.scale, self.marker_radius)
        if self.choose not in get_args(Choice):
            raise UserError(f"fem-asm: choose must be {', '.join(get_args(Choice))}, got {self.choose!r}")
        if self.choose == "evidence" and self.weights != "precision":
            raise UserError("fem-asm: choose=evidence needs weights=precision: the paper's are no precision")

    def settings(self) -> dict[str, object]:
        """The element degree, and what the markers weigh."""
        return asdict(self)

    def solve(self, problem: Problem, progress: Progress = silent) -> Solution:
        """Solve for the minimiser; see `Solver`. Without observations it is that of `fem`."""
        check_problem(self, problem)
        if problem.observations is not None and self.asm_weight * self.scale:
            return on_all_ranks(self._solve, problem, progress)
        plain = FemSolver(degree=self.degree, estimate=False).solve(problem, progress)
        status = Status(True, "without markers, or with weights of zero, this is fem")
        return replace(plain, solver=self.name, status=status)

    def prepare(self, problem: Problem) -> tuple[MarkerCompliance, Misfit]:
        """Factorise, and solve for the forces at the markers; further weights and markers cost no solve.

        Raises:
            UserError: If the problem has no observations.
        """
        misfit = misfit_of(
            problem,
            weights=self.weights,
            asm_weight=self.asm_weight,
            scale=self.scale,
            marker_radius=self.marker_radius,
        )
        if misfit is None:
            raise UserError("fem-asm was given no markers to assimilate")
        return MarkerCompliance.of(problem, self.degree, misfit), misfit

    def _solve(self, problem: Problem, progress: Progress) -> Solution:
        started = time.perf_counter()
        finger, misfit = self.prepare(problem)
        progress(0.9, "solved for the forces at the markers")
        forces = finger.forces(misfit)
        curve = self.curve(forces)
        factor = self._factor(curve)
        fit = forces.fit(factor)
        nodal, system = finger.under(fit.forces), finger.least.system
        space = system.distributed.space
        residual = system.residual(nodal)
        finger.least.factors.destroy()
        in_sample, left_out = _rms(fit.residual), _rms(fit.left_out)
        return Solution(
            solver=self.name,
            problem=problem,
            field=LagrangeField(space, nodal),
            energy=0.5 * float((nodal * residual).sum()),
            reaction=reaction_by_residual_work(space, residual) - fit.forces.sum(axis=0),
            status=Status(
                True,
                "the minimiser on this mesh; root mean square of what the markers are missed by: "
                f"{in_sample:.2g} mm in the fit, {left_out:.2g} mm when they are left out",
            ),
            stats={
                "seconds": time.perf_counter() - started,
                "unknowns": nodal.size,
                "triangles": len(problem.mesh.triangles),
                "degree": self.degree,
                "ranks": system.distributed.comm.size,
                "weight_factor": factor,
                "misfit": misfit.scaled(factor).value(misfit.observed - fit.residual),
                "marker_force": float(np.linalg.norm(fit.forces, axis=1).max()),
            },
            history=curve,
            left_out=without_each(problem, fit.left_out),
        )

    def curve(self, forces: MarkerForces) -> dict[str, FloatArray]:
        """The L-curve: energy and misfit over the factors of the weights, and what speaks for each factor."""
        fits = [forces.fit(factor) for factor in FACTORS]
        columns = {
            "weight_factor": FACTORS,
            "curve_energy": np.array([fit.energy for fit in fits]),
            "curve_in_sample_mm": np.array([_rms(fit.residual) for fit in fits]),
            "curve_left_out_mm": np.array([_rms(fit.left_out) for fit in fits]),
        }
        if self.weights == "precision":
            evidence = [forces.log_evidence(self.scale, factor) for factor in FACTORS]
            columns["curve_log_evidence"] = np.array(evidence)
        return columns

    def _factor(self, curve: dict[str, FloatArray]) -> float:
        if self.choose == "given":
            return 1.0
        if self.choose == "left-out":
            return float(FACTORS[curve["curve_left_out_mm"].argmin()])
        return float(FACTORS[curve["curve_log_evidence"].argmax()])


def _rms(values: FloatArray) -> float:
    return float(np.sqrt((values**2).mean()))
