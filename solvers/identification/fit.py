"""A fit of the unknowns under one law, with its evidence, force and place.

The evidence of a law is Laplace's approximation of the integral of likelihood times prior: with the
residuals r over φ σ, the sensitivities A and the standardised values z of `Estimate`, whose prior has the
mean m and the precision P, for n observations

    log Z = -n log φ - (r . r + (z - m) . P (z - m)) / 2 - log det(A^T A + P) / 2 + log det P / 2

Source: D. J. C. MacKay, Bayesian interpolation, Neural Computation 4 (1992) 415-447.
"""

from collections.abc import Mapping
from dataclasses import replace
from typing import Literal, NamedTuple

import numpy as np
from scipy.special import ndtri

from pinnray.geometry.finger.learned import Learned
from pinnray.geometry.mesh.boundary import mean_thickness
from pinnray.runtime.arrays import FloatArray, IntArray
from pinnray.solvers.assimilation.estimation import LEVEL, Estimate, Prior
from pinnray.solvers.elasticity import LawName
from pinnray.solvers.identification.field import STEP, Snapshot
from pinnray.solvers.identification.model import MarkerData, Response, ResponseModel
from pinnray.solvers.identification.unknowns import (
    CONTACT,
    CONTACT_ODDS,
    CYLINDER,
    INDENTATION,
    LAW_ODDS,
    SHARE,
)
from pinnray.solvers.problem import Problem

NORMAL = float(ndtri((1 + LEVEL) / 2))
"""Half of an interval over the standard deviation, of a normal distribution."""
SOURCES = {
    "third dimension": "the third dimension",
    "markers": "the errors of the markers",
    "misfit": "what no finger of this drawing explains",
    "contact": "place, width and pressure of the contact",
    "corners": "the roundings of the cavities' corners, which the drawing leaves out",
    "modulus": "Young's modulus",
    "finger": "walls, clamp and Poisson's ratio",
    "frames": "the frames of the pictures",
    "law": "the choice between the laws",
    "loss": "the material's loss",
}
"""What the variance of a force comes from, in words."""


LEAST_SHARE = 0.01
"""Least share of the variance of a force that is told."""
SIDE_ODDS = 150.0
"""Of free side faces to plane strain before the markers are seen: what `LAW_ODDS` calls very strong evidence
is asked for plane strain, which only simulated markers have."""


class FoundParameter(NamedTuple):
    """An unknown with its standard deviation, interval and resolution; see `Estimate`."""

    name: str
    unit: str
    value: float
    deviation: float
    low: float
    high: float
    resolution: float


class ForcePosterior(NamedTuple):
    """A response whose p standardised unknowns z are known so well, and its force."""

    model: ResponseModel
    response: Response
    prior: Prior
    covariance: FloatArray  # Of z, shape (p, p)
    inflation: float  # φ
    quantile: float  # Half an interval over the standard deviation
    slopes: FloatArray  # Derivatives of the values by z, shape (p,)

    @property
    def errors(self) -> FloatArray:
        """Independent errors in the values, columns of shape (p, p), of one standard deviation each.

        They are widened where Student's interval is wider than the normal one.
        """
        wider = self.quantile / NORMAL
        return np.asarray(wider * self.slopes[:, None] * np.linalg.cholesky(self.covariance))

    @property
    def place(self) -> tuple[float, float]:
        """Abscissa on the drawn front at which the force acts, and its standard deviation, mm."""
        # A tangential force of half of the normal one, on a face that is half a wall from the wall's middle.
        couple = 0.25 * mean_thickness(self.model.unknowns.problem.mesh)
        around = np.linalg.norm(self.response.place_slopes @ self.errors)
        return self.response.place, float(np.hypot(around, couple))

    def component(self, direction: FloatArray) -> tuple[float, float]:
        """Component of the indenter's force in a direction, (2,), and its standard deviation, N/mm."""
        component, doubt = float(self.response.force @ direction), self.model.doubt
        spread = np.linalg.norm(self.response.force_slopes @ direction @ self.errors)
        return component, float(np.hypot(spread, np.hypot(doubt.force, doubt.corners) * component))

    def variances(self, direction: FloatArray) -> dict[str, float]:
        """Variance of that component, (N/mm)^2, by what it comes from: of `SOURCES`.

        With the estimate's error C A^T e - C R^T p, for unit errors e of the observations and p of the prior,
        it is the sum of independent parts; of unknowns that are known together each has its share. Where φ
        is above one, all but 1 / φ^2 of the observations' is misfit.
        """
        slopes, wider = self.response.force_slopes @ direction * self.slopes, self.quantile / NORMAL
        spread = wider * self.covariance @ slopes
        shares = spread * (self.prior.precision @ spread)
        noise = max(wider * float(spread @ slopes) - float(shares.sum()), 0.0)
        misfit, value = 1 - 1 / self.inflation**2, float(self.response.force @ direction)
        parts, doubt = dict.fromkeys(SOURCES, 0.0), self.model.doubt
        parts["third dimension"], parts["corners"] = (doubt.force * value) ** 2, (doubt.corners * value) ** 2
        parts["markers"], parts["misfit"] = noise * (1 - misfit), noise * misfit
        for name, part in zip(self.model.unknowns.names, shares.tolist(), strict=True):
            contact = name in (*CONTACT, *CYLINDER, SHARE, INDENTATION)
            frame = name.startswith(("pressed", "drawn"))
            finger = "modulus" if name == "young" else "finger"
            parts["contact" if contact else "frames" if frame else finger] += part
        return parts


class Fit(NamedTuple):
    """The best values of the unknowns under one law."""

    model: ResponseModel  # The finger of that law as a function of the unknowns
    estimate: Estimate  # Values, covariance, residuals
    response: Response  # The equilibrium there
    measurement: MarkerData
    exact: bool  # Whether the equilibrium was found to the last digit, and by the finest discretisation

    @property
    def law(self) -> LawName:
        """Name of the law."""
        return self.model.unknowns.problem.material.law

    @property
    def contact(self) -> Literal["cylinder", "patch"]:
        """What presses: `cylinder` or `patch`."""
        return "cylinder" if self.response.way else "patch"

    @property
    def log_evidence(self) -> float:
        """Logarithm of the evidence, up to a constant that all laws share."""
        found = self.estimate
        a, r = found.sensitivities[found.kept], found.residuals[found.kept]
        misfit = float(r @ r) + found.prior.misfit(found.z)
        wrong = float(self.measurement.errors.log_odds[self.doubted].sum())
        return wrong - len(r) * float(np.log(found.inflation)) - 0.5 * (misfit + found.prior.log_volume(a))

    @property
    def doubted(self) -> IntArray:
        """Numbers, among the markers that were seen, of those that were left out as wrong."""
        return np.flatnonzero(~self.estimate.kept[: 2 * len(self.measurement.points) : 2])

    @property
    def log_posterior(self) -> float:
        """Logarithm of the probability of law, contact and side faces, up to a constant that all share."""
        odds = LAW_ODDS.get(self.law, 1.0) * CONTACT_ODDS[self.contact]
        odds *= SIDE_ODDS if self.model.body.thick else 1.0
        return self.log_evidence + float(np.log(odds))

    @property
    def posterior(self) -> ForcePosterior:
        """The force and how well it is known."""
        known, model = self.estimate, self.model
        own = known.prior, known.covariance, known.inflation, known.quantile, known.slopes
        return ForcePosterior(model, self.response, *own)

    @property
    def parameters(self) -> list[FoundParameter]:
        """What was found of each unknown; of the indentation, the normal force that goes with it."""
        found, response = self.estimate, self.response
        known = zip(found.values.tolist(), found.deviations.tolist(), found.intervals.tolist(), strict=True)
        listed = []
        for parameter, (value, deviation, (low, high)), share in zip(
            found.parameters, known, found.resolution.tolist(), strict=True
        ):
            name, unit = parameter.name, parameter.unit
            if name == INDENTATION:
                into = self.model.unknowns.directions[0]
                name, unit, value = "normal_force", "N/mm", float(response.force @ into)
                slopes = response.force_slopes @ into * found.slopes
                deviation = float(np.sqrt(slopes @ found.covariance @ slopes))
                low, high = value - found.quantile * deviation, value + found.quantile * deviation
            listed.append(FoundParameter(name, unit, value, deviation, low, high, share))
        return listed

    def snapshots(self, problem: Problem) -> tuple[Snapshot, list[Snapshot]]:
        """The finger, and that `STEP` times each of the independent standard errors away, to first order."""
        found, *steps = (self._snapshot(problem, each) for each in (0.0, *(STEP * self.posterior.errors).T))
        return found, steps

    def _snapshot(self, problem: Problem, error: FloatArray | float) -> Snapshot:
        """The finger with the values of the fit plus an error, shape (p,)."""
        unknowns = self.model.unknowns
        there = self.model.extrapolated(self.response, self.response.values + error)
        return Snapshot(
            problem=replace(problem, material=unknowns.material(there.values)),
            walls=unknowns.motion,
            changes=there.hypothesis.changes,
            clamp=there.motion,
            body=self.model.body,
            state=there.state,
            pictures=there.hypothesis.pictures,
        )

    @property
    def learned(self) -> Learned | None:
        """What the markers, and those of earlier pictures, say of the finger; None if it has no unknowns."""
        found = self.estimate
        wider = (found.quantile / NORMAL) ** 2
        return self.model.unknowns.learned(found.parameters, found.z, wider * found.covariance)


def split_phrase(variances: Mapping[str, float]) -> str:
    """What a variance comes from in words, by names of `SOURCES`, the largest first."""
    whole = sum(variances.values()) or 1.0
    ordered = sorted(variances, key=variances.__getitem__, reverse=True)
    told = [name for name in ordered if variances[name] >= LEAST_SHARE * whole]
    return ", ".join(f"{100 * variances[name] / whole:.0f} % {SOURCES[name]}" for name in told)
