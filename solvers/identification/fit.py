"""A fit of the unknowns under one law, with its evidence, force and place.

The evidence of a law is Laplace's approximation of the integral of likelihood times prior: with the
residuals r over φ σ, the sensitivities A and the standardised values z of `Estimate`, for n observations

    log Z = -n log φ - (r . r + z . z) / 2 - log det(A^T A + 1) / 2

Source: D. J. C. MacKay, Bayesian interpolation, Neural Computation 4 (1992) 415-447.
"""

from typing import NamedTuple

import numpy as np
from scipy.special import ndtri

from pinnray.geometry.mesh.boundary import mean_thickness
from pinnray.runtime.arrays import FloatArray
from pinnray.solvers.assimilation.estimation import LEVEL, Estimate
from pinnray.solvers.elasticity import LawName
from pinnray.solvers.identification.model import MarkerData, Response, ResponseModel
from pinnray.solvers.identification.unknowns import LAW_ODDS, doubt_of_the_plane

NORMAL = float(ndtri((1 + LEVEL) / 2))
"""Half of an interval over the standard deviation, of a normal distribution."""


class Fit(NamedTuple):
    """The best values of the unknowns under one law."""

    model: ResponseModel  # The finger of that law as a function of the unknowns
    estimate: Estimate  # Values, covariance, residuals
    response: Response  # The equilibrium there
    measurement: MarkerData  # The markers that were believed
    exact: bool  # Whether the equilibrium was found to the last digit, and by the finest discretisation

    @property
    def law(self) -> LawName:
        """Name of the law."""
        return self.model.unknowns.problem.material.law

    @property
    def log_evidence(self) -> float:
        """Logarithm of the evidence, up to a constant that all laws share."""
        found = self.estimate
        a, r = found.sensitivities, found.residuals
        _, volume = np.linalg.slogdet(a.T @ a + np.eye(a.shape[1]))
        misfit = float(r @ r + found.z @ found.z)
        return -len(r) * float(np.log(found.inflation)) - 0.5 * (misfit + float(volume))

    @property
    def log_posterior(self) -> float:
        """Logarithm of the law's probability, up to a constant that all laws share."""
        return self.log_evidence + float(np.log(LAW_ODDS.get(self.law, 1.0)))

    @property
    def standard_errors(self) -> FloatArray:
        """Independent errors in the values, columns of shape (p, p), of one standard deviation each.

        They are widened where Student's interval is wider than the normal one.
        """
        found = self.estimate
        wider = found.quantile / NORMAL
        return np.asarray(wider * found.slopes[:, None] * np.linalg.cholesky(found.covariance))

    @property
    def force(self) -> tuple[float, float]:
        """Size of the indenter's force and its standard deviation, N/mm."""
        unknowns, force = self.model.unknowns, self.response.hypothesis.force
        size = float(np.linalg.norm(force))
        along = force / size if size else unknowns.directions[0]
        slopes = unknowns.slopes(self.response.values).force @ along
        doubt = doubt_of_the_plane(unknowns.problem) * size
        return size, float(np.hypot(np.linalg.norm(slopes @ self.standard_errors), doubt))

    @property
    def place(self) -> tuple[float, float] | None:
        """Abscissa on the drawn front at which the force acts, and its standard deviation, mm; if unknown."""
        names = self.model.unknowns.names
        if "position" not in names:
            return None
        along = np.array([float(name in ("position", "eccentricity")) for name in names])
        # A tangential force of half of the normal one, on a face that is half a wall from the wall's middle.
        couple = 0.25 * mean_thickness(self.model.unknowns.problem.mesh)
        deviation = float(np.hypot(np.linalg.norm(along @ self.standard_errors), couple))
        return float(along @ self.estimate.values), deviation
