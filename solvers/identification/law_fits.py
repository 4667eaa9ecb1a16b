"""Fits of the unknowns under one law each, from a start or from another fit."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from pinnray.runtime.arrays import FloatArray
from pinnray.solvers.assimilation.estimation import (
    MAX_ROUNDS,
    Parameter,
    Prediction,
    Prior,
    estimate,
    values_of,
)
from pinnray.solvers.elasticity import LawName
from pinnray.solvers.identification.fit import Fit
from pinnray.solvers.identification.model import EXACT, MarkerData, MarkerModel, Response, ResponseModel
from pinnray.solvers.identification.unknowns import INDENTATION
from pinnray.solvers.solver import NoSolutionError, Progress, silent

HELD = 1e-3
"""Factor of the standard deviation of a parameter that is held."""

MOST_LOST = 8
"""Hypotheses without equilibrium at which a search ends: each costs all halvings of the way to it."""


@dataclass(eq=False)
class LawFits:
    """Fits the unknowns of one finger under any of the laws."""

    model: Callable[[LawName], ResponseModel]  # The finger by a law
    parameters: Sequence[Parameter]  # The unknowns, which the laws share
    prior: Prior  # Of their standardised values
    cost_change: float  # Relative change of the cost below which a search has converged
    progress: Progress = silent

    def __post_init__(self) -> None:
        self._names = [parameter.name for parameter in self.parameters]

    def shifted(self, fit: Fit, measurement: MarkerData) -> Fit:
        """The fit to a measurement, to first order about another fit."""
        about = fit.response
        predicted, slopes = MarkerModel(fit.model, measurement).predicted(about)
        found = estimate(
            lambda values: (predicted + slopes @ (values - about.values), slopes),
            measurement.observed,
            measurement.noise,
            self.parameters,
            fit.estimate.z,
            measurement.errors,
            prior=self.prior,
        )
        return fit._replace(
            estimate=found, response=fit.model.extrapolated(about, found.values), measurement=measurement
        )

    def fit(
        self,
        law: LawName,
        measurement: MarkerData,
        near: Fit | FloatArray,
        *,
        held: Sequence[str] = (),
        rounds: int = MAX_ROUNDS,
    ) -> Fit:
        """The fit of a law from another fit or from standardised values (p,), in some rounds of `estimate`.

        The values are at rest: the indentation that a linear finger would need is added. What is `held`
        stays, and its value in the fit is zero.
        """
        model = self.model(law)
        markers = MarkerModel(model, measurement)
        model.restart(near.response if isinstance(near, Fit) else None)

        def predict(values: FloatArray) -> Prediction | None:
            found = model.response(values)
            if found is None and model.evaluations == first:  # another law's start was too far away
                model.restart(None)
                found = model.response(values)
            if found is not None:
                self.progress(0.5, f"{law}: force {np.linalg.norm(found.force):.4g} N/mm")
                reached[values.tobytes()] = found
                return markers.predicted(found)
            lost.append(values)
            nowhere = not reached and len(lost) > most  # nor, from values, where the priors are
            if nowhere or len(lost) > MOST_LOST:
                raise nothing
            return None

        kept, most = None, 1
        if isinstance(near, Fit):  # where one law explains the markers, another one does as well, or nowhere
            start, most = near.estimate.z, 0
            if len(near.estimate.kept) == len(measurement.observed):
                kept = near.estimate.kept
        else:
            start = self._pressed(model, markers, near)
        parameters, prior = self.parameters, self.prior
        if held:
            still = np.isin(self._names, held)
            parameters, prior = self._holding(held, start), prior.apart(still)
            start = np.where(still, 0.0, start)
        first, lost, reached = model.evaluations + 1, list[FloatArray](), dict[bytes, Response]()
        nothing = NoSolutionError(
            f"no equilibrium of the {law} law was found near the markers, from rest or from where a linear "
            "finger would be; see whether the markers are of this finger and load, or take a smaller prior"
        )
        found = estimate(
            predict,
            measurement.observed,
            measurement.noise,
            parameters,
            start,
            measurement.errors,
            kept,
            prior=prior,
            cost_change=self.cost_change,
            rounds=rounds,
        )
        if (rough := reached.get(found.values.tobytes())) is None:
            raise nothing
        model.restart(rough)
        exact = model.response(found.values, EXACT)
        return Fit(model, found, exact or rough, measurement, exact is not None)

    def _pressed(self, model: ResponseModel, markers: MarkerModel, start: FloatArray) -> FloatArray:
        """Standardised values with the indentation of a linear finger; a cylinder has the start's travel."""
        z = start.copy()
        if INDENTATION not in self._names:
            return z
        at_rest = model.response(values_of(self.parameters, start)[0])
        if at_rest is not None:
            which, noise = self._names.index(INDENTATION), markers.measurement.noise
            slope = markers.predicted(at_rest)[1][:, which] / noise
            pressed = float(slope @ (markers.measurement.observed / noise) / (slope @ slope))
            z[which] = pressed / self.parameters[which].scale
        return z

    def _holding(self, held: Sequence[str], z: FloatArray) -> list[Parameter]:
        """The parameters, some of them held at their standardised value among all, shape (p,)."""
        return [
            replace(each, start=float(each.value(at)), scale=HELD * each.scale) if each.name in held else each
            for each, at in zip(self.parameters, z.tolist(), strict=True)
        ]
