"""Fits of the unknowns, one a law, and the evidence for each.

The evidence of a law is Laplace's approximation of the integral of likelihood times prior: with the
residuals r over φ σ, the sensitivities A and the standardised values z of `Estimate`, for n observations

    log Z = -n log φ - (r . r + z . z) / 2 - log det(A^T A + 1) / 2

Source: D. J. C. MacKay, Bayesian interpolation, Neural Computation 4 (1992) 415-447.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from geometry.arrays import FloatArray
from solvers.assimilation.estimation import Estimate
from solvers.elasticity import LawName
from solvers.identification.reading import Reading
from solvers.identification.response import MarkerModel, Response, ResponseModel

PROBABLE = 0.01
"""Least probability of a law whose field is kept."""


class Fit(NamedTuple):
    """The best values of the unknowns under one law.

    Attributes:
        model: The finger of that law as a function of the unknowns.
        estimate: Values, covariance, residuals.
        response: The equilibrium there.
        markers: The marker displacements as a function of a response.
        reading: The markers that were believed.
        exact: Whether the equilibrium was found to the last digit, and by the finest discretisation.
        coarser: The same fit by a coarser discretisation, whose difference estimates the error of this one.
    """

    model: ResponseModel
    estimate: Estimate
    response: Response
    markers: MarkerModel
    reading: Reading
    exact: bool
    coarser: "Fit | None" = None

    @property
    def law(self) -> LawName:
        """The law."""
        return self.model.unknowns.problem.material.law

    @property
    def log_evidence(self) -> float:
        """Logarithm of the evidence, up to what all laws share."""
        found = self.estimate
        a, r = found.sensitivities, found.residuals
        _, volume = np.linalg.slogdet(a.T @ a + np.eye(a.shape[1]))
        misfit = float(r @ r + found.z @ found.z)
        return -len(r) * float(np.log(found.inflation)) - 0.5 * (misfit + float(volume))


@dataclass(frozen=True, eq=False)
class Identified:
    """The fits of all laws to the same markers.

    Attributes:
        fits: The most probable law first.
        probabilities: Of the laws, shape (number of fits,).
        doubtful: Markers that contradict the others and were not used: number among those seen, and their
            computed minus their observed displacement, shape (2,), mm.
    """

    fits: Sequence[Fit]
    probabilities: FloatArray
    doubtful: Mapping[int, FloatArray]

    @classmethod
    def ranked(cls, fits: Sequence[Fit], doubtful: Mapping[int, FloatArray]) -> "Identified":
        """Of the fits in any order."""
        ordered = sorted(fits, key=lambda fit: -fit.log_evidence)
        logs = np.array([fit.log_evidence for fit in ordered])
        weights = np.exp(logs - logs.max())
        return cls(ordered, weights / weights.sum(), doubtful)

    @property
    def best(self) -> Fit:
        """The fit of the most probable law."""
        return self.fits[0]
