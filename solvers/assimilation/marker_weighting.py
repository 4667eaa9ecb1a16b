"""Weighting of the markers' misfit: checked settings, the L-curve, and the choice of a factor on it."""

from dataclasses import dataclass, fields
from typing import get_args

import numpy as np

from pinnray.runtime.arrays import FloatArray
from pinnray.runtime.errors import UserError
from pinnray.solvers.assimilation.marker_forces import MarkerForces, root_mean_square
from pinnray.solvers.assimilation.misfit import Choice, MarkerSettings, Misfit, Weighting, misfit_of
from pinnray.solvers.problem import Problem
from pinnray.solvers.solver import Solver

FACTORS: FloatArray = 10.0 ** np.arange(-9, 3.25, 0.25)
"""Factors of the weights on the L-curve, among which one can be chosen."""


@dataclass(frozen=True, kw_only=True)
class MarkerWeighting(MarkerSettings):
    """Weights of the misfit by the settings of a solver, which messages name."""

    solver_name: str

    def __post_init__(self) -> None:
        for setting, kind in (("weights", Weighting), ("choose", Choice)):
            names, value = get_args(kind), getattr(self, setting)
            if value not in names:
                raise UserError(f"{self.solver_name}: {setting} must be {' or '.join(names)}, got {value!r}")
        for setting in ("asm_weight", "scale", "marker_radius", "contact_deviation"):
            value = getattr(self, setting)
            if value is not None and not 0 <= value < np.inf:
                raise UserError(f"{self.solver_name}: {setting} must be zero or more, got {value}")

    @classmethod
    def of(cls, solver: Solver) -> "MarkerWeighting":
        """The weighting by a solver's settings, checked."""
        names = [entry.name for entry in fields(cls) if hasattr(solver, entry.name)]
        return cls(solver_name=solver.name, **{name: getattr(solver, name) for name in names})

    @property
    def slack(self) -> float:
        """Compliance of the springs between contact and indenter, mm per N/mm."""
        return self.contact_deviation**2 / self.scale

    def misfit(self, problem: Problem) -> Misfit | None:
        """The misfit to a problem's markers; None without markers, or with weights of zero.

        A `UserError` refuses to choose a factor at finite strain, and a patch with a deviation.
        """
        if problem.observations is None or not self.asm_weight * self.scale:
            return None
        if problem.material.law != "linear" and self.choose != "given":
            raise UserError(f"{self.solver_name}: choose={self.choose} is for the linear law; take given")
        if problem.load.kind == "patch" and self.contact_deviation:
            raise UserError(
                f"{self.solver_name}: every point of a patch moves as prescribed; contact_deviation must be 0"
            )
        return misfit_of(problem, self)

    def curve(self, forces: MarkerForces) -> dict[str, FloatArray]:
        """The L-curve: energy and misfits over the factors of the weights."""
        fits = [forces.fit(factor) for factor in FACTORS]
        return {
            "weight_factor": FACTORS,
            "curve_energy": np.array([fit.energy for fit in fits]),
            "curve_in_sample_mm": np.array([root_mean_square(fit.residual) for fit in fits]),
            "curve_left_out_mm": np.array([root_mean_square(fit.residual_without) for fit in fits]),
        }

    def factor(self, forces: MarkerForces) -> float:
        """The factor chosen."""
        if self.choose == "given":
            return 1.0
        return float(FACTORS[self.curve(forces)["curve_left_out_mm"].argmin()])
