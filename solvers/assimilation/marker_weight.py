"""Which weights of the markers to take: the L-curve, and the factors that speak for themselves on it."""

from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np

from geometry.arrays import FloatArray
from geometry.errors import UserError
from solvers.assimilation.marker_forces import MarkerForces, root_mean_square
from solvers.assimilation.misfit import Weighting

Choice = Literal["given", "left-out", "evidence"]

FACTORS: FloatArray = 10.0 ** np.arange(-9, 3.25, 0.25)
"""Factors of the weights on the L-curve, among which one can be chosen."""


@dataclass(frozen=True)
class WeightChoice:
    """How a solver chooses a factor of its weights.

    Attributes:
        choose: "given": one; "left-out": that one of `FACTORS` for which markers that are left out, one at a
            time, are missed least; "evidence": that of the largest evidence, for the weights "precision".
        scale: Of the weights "precision", N mm / mm; None for the paper's.
    """

    choose: Choice
    scale: float | None

    @classmethod
    def of(cls, solver: str, choose: Choice, weights: Weighting, scale: float) -> "WeightChoice":
        """The choice that a solver's settings ask for.

        Raises:
            UserError: If there is no such choice.
        """
        if choose not in get_args(Choice):
            raise UserError(f"{solver}: choose must be {', '.join(get_args(Choice))}, got {choose!r}")
        if choose == "evidence" and weights != "precision":
            raise UserError(
                f"{solver}: choose=evidence needs weights=precision: the paper's are no precision"
            )
        return cls(choose, scale if weights == "precision" else None)

    def curve(self, forces: MarkerForces) -> dict[str, FloatArray]:
        """The L-curve: energy and misfit over the factors of the weights, and what speaks for each factor."""
        fits = [forces.fit(factor) for factor in FACTORS]
        columns = {
            "weight_factor": FACTORS,
            "curve_energy": np.array([fit.energy for fit in fits]),
            "curve_in_sample_mm": np.array([root_mean_square(fit.residual) for fit in fits]),
            "curve_left_out_mm": np.array([root_mean_square(fit.left_out) for fit in fits]),
        }
        if self.scale is not None:
            evidence = [forces.log_evidence(self.scale, factor) for factor in FACTORS]
            columns["curve_log_evidence"] = np.array(evidence)
        return columns

    def factor(self, forces: MarkerForces) -> float:
        """The factor chosen."""
        if self.choose == "given":
            return 1.0
        curve = self.curve(forces)
        if self.choose == "left-out":
            return float(FACTORS[curve["curve_left_out_mm"].argmin()])
        return float(FACTORS[curve["curve_log_evidence"].argmax()])
