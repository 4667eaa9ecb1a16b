"""The misfit of a displacement to the markers: one definition for every solver that assimilates them.

What is minimised is, per depth, elastic energy plus misfit:

    J(u) = E(u) + 1/2 (B u - d)^T W (B u - d)

with the displacements B u at the markers, d observed there, and a diagonal of weights W.

Sources: X. Wang et al., PINN-Ray, arXiv:2407.08222, section "Loss function", whose loss times the body's area
this is; A. M. Stuart, Inverse problems: a Bayesian perspective, Acta Numerica 19 (2010) 451-559, section 2,
for the posterior's mode.
"""

from dataclasses import dataclass, replace
from typing import Literal, get_args

import numpy as np

from geometry.arrays import FloatArray
from geometry.errors import UserError
from geometry.observations import Observations
from solvers.problem import Problem
from solvers.solver import Solver

Weighting = Literal["paper", "precision"]

SMALLEST_DEVIATION = 0.005
"""Standard deviation that an observation has at least, mm.

Simulated displacements have none at all; a camera that is calibrated well knows a marker to about this.
"""


@dataclass(frozen=True, eq=False)
class Misfit:
    """1/2 (B u - d)^T W (B u - d) at the m markers that were seen, per depth.

    Attributes:
        points: Positions of the markers at rest, shape (m, 2), mm.
        observed: Displacements d, shape (m, 2), mm.
        weights: The diagonal of W, shape (m, 2), MPa: N/mm of force per depth for 1 mm of misfit.
    """

    points: FloatArray
    observed: FloatArray
    weights: FloatArray

    def value(self, displacement: FloatArray) -> float:
        """The misfit of displacements at the markers, shape (m, 2), mm: N mm / mm."""
        return 0.5 * float((self.weights * (displacement - self.observed) ** 2).sum())

    def forces(self, displacement: FloatArray) -> FloatArray:
        """Forces W (d - B u) that pull at the markers, shape (m, 2), N/mm: minus the gradient."""
        return self.weights * (self.observed - displacement)

    def without(self, marker: int) -> "Misfit":
        """The misfit of the other markers, whose weights stay what they are."""
        rest = (np.delete(values, marker, axis=0) for values in (self.points, self.observed, self.weights))
        return Misfit(*rest)

    def scaled(self, factor: float) -> "Misfit":
        """The misfit times a factor."""
        return replace(self, weights=factor * self.weights)


def misfit_of(
    problem: Problem, *, weights: Weighting = "paper", asm_weight: float = 1000.0, scale: float = 1.0
) -> Misfit | None:
    """The misfit to a problem's observations; None where it has none.

    Args:
        problem: With the observations; markers that were not seen are left out.
        weights: "paper": the loss λ_ASM 1/m Σ |u - d|² beside the mean energy density, times the body's area
            A, is W = 2 A λ_ASM / m. "precision": W = scale / σ², by the observations' standard deviations,
            of which none counts as less than `SMALLEST_DEVIATION`. The minimiser of J is then the mode of
            the posterior for the prior exp(-E / scale) and independent normal errors of the observations.
        asm_weight: λ_ASM, MPa/mm², for "paper".
        scale: For "precision", the model's own error as an energy per depth, N mm / mm: a typical deviation
            from the model's solution has half of it in every degree of freedom. The less, the more the model
            is believed.
    """
    observations = problem.observations
    if observations is None:
        return None
    seen = observations.visible
    if weights == "paper":
        area = float(problem.mesh.areas.sum())
        diagonal = np.full((int(seen.sum()), 2), 2 * area * asm_weight / seen.sum())
    else:
        diagonal = scale / standard_deviations(observations) ** 2
    return Misfit(observations.points[seen], observations.displacements[seen], diagonal)


def standard_deviations(observations: Observations) -> FloatArray:
    """Those of the markers seen, shape (m, 2), mm, none of them less than `SMALLEST_DEVIATION`."""
    return np.maximum(observations.standard_deviations[observations.visible], SMALLEST_DEVIATION)


def check_weighting(solver: str, weights: str, asm_weight: float, scale: float) -> None:
    """Raise a `UserError` if a solver's settings make no misfit."""
    if weights not in get_args(Weighting):
        raise UserError(f"{solver}: weights must be {' or '.join(get_args(Weighting))}, got {weights!r}")
    for name, value in (("asm_weight", asm_weight), ("scale", scale)):
        if not (np.isfinite(value) and value >= 0):
            raise UserError(f"{solver}: {name} must be zero or more, got {value}")


def assimilates(solver: Solver) -> bool:
    """Whether a solver uses the observations of a problem: those only that say so are given any."""
    return bool(getattr(solver, "assimilates", False))
