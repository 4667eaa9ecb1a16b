"""Contact, walls and law from the markers: the search, and doubtful markers.

Source: R. D. Cook, S. Weisberg, Residuals and Influence in Regression, Chapman and Hall 1982, for the misfit
without an observation.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from geometry.arrays import FloatArray
from geometry.errors import UserError
from geometry.observations import Observations
from solvers.assimilation.estimation import COST_CHANGE, MAX_ROUNDS, MAX_STEPS, Estimate, Prediction, estimate
from solvers.elasticity import LawName
from solvers.identification.body import Body
from solvers.identification.fit import Fit, Identified
from solvers.identification.hypothesis import Unknowns
from solvers.identification.reading import Reading
from solvers.identification.response import EXACT, MarkerModel, ResponseModel
from solvers.problem import Problem
from solvers.solver import Progress, silent

DOUBTFUL = 30.0
"""Drop of the misfit, in squared standard deviations, by which a marker contradicts the others.

Noise alone drops it by more once in three million markers (χ² of two degrees of freedom).
"""
CLEARER = 2.0
"""Factor by which φ has to fall as well, so that a model that is wrong everywhere loses no marker."""
MOST_DOUBTFUL = 1 / 3
"""Largest share of the markers that are left out as doubtful."""
AWAY = (-2.0, 2.0)
"""Places of the contact from which the search starts again, in standard deviations of its prior."""
QUICK, MARGIN = 4, 15.0
"""Steps in which a law is judged first, and how much less its log evidence may be for it to be fitted on."""
UNEXPLAINED = 10.0
"""φ from which on the search is started again."""


class Identifier:
    """Finds the unknowns of one finger for any observations; each search starts from the last result.

    Args:
        problem: The finger; its law does not matter, its load only by the drawn contact.
        names: The unknowns.
        laws: The laws to choose from.
        body: Makes the discretised finger of a problem, whose law is set, and the unknowns.
        prior: Factor of the standard deviations of the priors.
        radius: Of the markers, mm; None: the observations'.
        cost_change: Relative change of the cost below which a search has converged.
    """

    def __init__(
        self,
        problem: Problem,
        names: Sequence[str],
        laws: Sequence[LawName],
        body: Callable[[Unknowns], Body],
        *,
        prior: float = 1.0,
        radius: float | None = None,
        cost_change: float = COST_CHANGE,
    ) -> None:
        self._laws, self._radius, self._cost_change = tuple(laws), radius, cost_change
        self.models: dict[LawName, ResponseModel] = {}
        for law in self._laws:
            own = replace(problem, material=problem.material.model_copy(update={"law": law}))
            unknowns = Unknowns.of(own, names)
            self.models[law] = ResponseModel(body(unknowns), unknowns)
        first = self.models[self._laws[0]]
        flexibility = first.flexibility()
        self.parameters = first.unknowns.parameters(flexibility, prior)
        self._known: dict[LawName, Fit] = {}

    def identify(
        self,
        observations: Observations,
        reaction: tuple[float, float] | None = None,
        progress: Progress = silent,
    ) -> Identified:
        """The unknowns under every law, and the laws' probabilities.

        Args:
            observations: The markers.
            reaction: Force along y per depth and its standard deviation, N/mm, if it was measured.
            progress: Told of the values that are tried.

        Raises:
            UserError: If there are no markers, or the finger has no equilibrium near rest.
        """
        reading = Reading.of(self._problem, observations, self._radius, reaction)
        rough = self._rough(reading, progress)
        best = max(rough, key=lambda fit: fit.log_evidence)
        fit, doubtful = self._believed(self._settled(best, progress), progress)
        fits = [fit]
        for other in rough:
            if other.law == fit.law:
                continue
            if doubtful:
                other = self._fit(other.law, fit.reading, fit, progress, rounds=1, steps=QUICK)
            if other.log_evidence > fit.log_evidence - MARGIN:
                other = self._fit(other.law, fit.reading, other, progress)
            if fit.estimate.inflation > 1:
                again = self._fit(other.law, fit.reading, fit, progress)
                other = max(other, again, key=lambda each: each.log_evidence)
            fits.append(other)
        for each in fits:
            self._known.setdefault(each.law, each)
        return Identified.ranked(fits, doubtful)

    def start_from(self, fit: Fit) -> None:
        """Start the next search from a fit, whose response has a state of this discretisation."""
        self._known[fit.law] = fit

    def refined(
        self, fit: Fit, model: ResponseModel, state: FloatArray, observations: Observations
    ) -> Fit | None:
        """A fit by a finer discretisation: its equilibrium, and from there the unknowns to first order.

        Args:
            fit: By a coarser one.
            model: The finger, of the same law, discretised more finely.
            state: Of the finer discretisation, near equilibrium for the fit's values.
            observations: Those of the fit, with the standard deviations for the finer discretisation.

        Returns:
            None if no equilibrium is found there.
        """
        slopes = np.zeros((len(fit.response.values), *state.shape))
        response = model.equilibrium(replace(fit.response, state=state, slopes=slopes))
        if response is None:
            return None
        about = fit._replace(model=model, response=response, coarser=None)
        reading = Reading.of(self._problem, observations, self._radius, fit.reading.reaction)
        return self.shifted(about, reading.only(fit.reading.kept))._replace(coarser=fit)

    def updated(
        self, found: Identified, observations: Observations, reaction: tuple[float, float] | None = None
    ) -> Identified:
        """The unknowns for other observations, to first order about fits: no equilibrium is solved.

        Args:
            found: The fits.
            observations: Near those of the fits, in noise or in which markers were seen.
            reaction: As in `identify`.
        """
        reading = Reading.of(self._problem, observations, self._radius, reaction)
        return Identified.ranked([self.shifted(fit, reading) for fit in found.fits], {})

    def shifted(self, fit: Fit, reading: Reading) -> Fit:
        """The fit to a reading, to first order about another fit."""
        model, about = fit.model, fit.response
        markers = MarkerModel.of(model.body, model.unknowns, reading.misfit)
        predicted, slopes = reading.predicted(markers, about)
        found = estimate(
            lambda values: (predicted + slopes @ (values - about.values), slopes),
            reading.observed,
            reading.noise,
            self.parameters,
            fit.estimate.z,
        )
        response = model.extrapolated(about, found.values)
        coarser = None if fit.coarser is None else self.shifted(fit.coarser, reading)
        return Fit(model, found, response, markers, reading, fit.exact, coarser)

    @property
    def _problem(self) -> Problem:
        return self.models[self._laws[0]].unknowns.problem

    def _rough(self, reading: Reading, progress: Progress) -> list[Fit]:
        """A fit of every law with φ = 1, but for the first one in a few steps from that."""
        law, *others = self._laws
        fits = [self._fit(law, reading, self._known.get(law), progress, rounds=1)]
        for law in others:
            near = self._known.get(law, fits[0])
            fits.append(self._fit(law, reading, near, progress, rounds=1, steps=QUICK))
        return fits

    def _settled(self, rough: Fit, progress: Progress) -> Fit:
        """The fit of a law; where it explains little, the best of several from other places of contact."""
        if rough.estimate.converged:
            return rough
        best = self._fit(rough.law, rough.reading, rough, progress)
        if best.estimate.inflation < UNEXPLAINED or "position" not in self._names or self._known:
            return best
        for away in AWAY:
            start = np.zeros(len(self._names))
            start[self._names.index("position")] = away
            other = self._fit(rough.law, rough.reading, None, progress, start)
            best = max(best, other, key=lambda fit: fit.log_evidence)
        return best

    @property
    def _names(self) -> tuple[str, ...]:
        return self.models[self._laws[0]].unknowns.names

    def _fit(
        self,
        law: LawName,
        reading: Reading,
        near: Fit | None,
        progress: Progress,
        start: FloatArray | None = None,
        *,
        rounds: int = MAX_ROUNDS,
        steps: int = MAX_STEPS,
    ) -> Fit:
        model = self.models[law]
        markers = MarkerModel.of(model.body, model.unknowns, reading.misfit)
        model.restart(None if near is None else near.response)

        def predict(values: FloatArray) -> Prediction | None:
            force = np.linalg.norm(model.unknowns.hypothesis(values).force)
            progress(0.5, f"{law}: force {force:.4g} N/mm")
            found = model.response(values)
            if found is None and model.evaluations == first:  # the start is too far from that of another law
                model.restart(None)
                found = model.response(values)
            return None if found is None else reading.predicted(markers, found)

        if near is not None:
            start = near.estimate.z
        elif start is None:
            start = self._pressed(model, markers, reading)
        first = model.evaluations + 1
        found = estimate(
            predict,
            reading.observed,
            reading.noise,
            self.parameters,
            start,
            rounds=rounds,
            steps=steps,
            cost_change=self._cost_change,
        )
        response = model.response(found.values, EXACT)
        exact = response is not None
        if response is None:
            response = model.response(found.values)
        if response is None:
            raise UserError(
                f"no equilibrium of the {law} law was found near the markers; take a smaller prior"
            )
        return Fit(model, found, response, markers, reading, exact)

    def _pressed(self, model: ResponseModel, markers: MarkerModel, reading: Reading) -> FloatArray:
        """Standardised values with the normal force that a linear finger would need, the rest as expected."""
        z = np.zeros(len(self._names))
        drawn = np.array([float(parameter.value(0.0)) for parameter in self.parameters])
        at_rest = model.response(drawn)
        if at_rest is not None:
            which = self._names.index("normal_force")
            slope = reading.predicted(markers, at_rest)[1][:, which] / reading.noise
            force = float(slope @ (reading.observed / reading.noise) / (slope @ slope))
            z[which] = force / self.parameters[which].scale
        return z

    def _believed(self, fit: Fit, progress: Progress) -> tuple[Fit, dict[int, FloatArray]]:
        """The fit without markers that contradict the others, and by how much they are off, mm."""
        doubtful: dict[int, FloatArray] = {}
        most = int(MOST_DOUBTFUL * len(fit.reading.kept))
        while fit.estimate.inflation > 1 and len(doubtful) < most:
            count = len(fit.reading.kept)
            drops = [_drop(fit.estimate, marker) for marker in range(count)]
            worst = int(np.argmax(drops))
            if drops[worst] < DOUBTFUL:
                break
            reading = fit.reading.without(worst)
            without = self._fit(fit.law, reading, fit, progress)
            if without.estimate.inflation * CLEARER > fit.estimate.inflation:
                break
            doubtful[int(fit.reading.kept[worst])] = self._missed(without, fit.reading, worst)
            fit = without
        return fit, doubtful

    def _missed(self, fit: Fit, reading: Reading, marker: int) -> FloatArray:
        """Computed by a fit without it minus observed displacement of a marker, shape (2,), mm."""
        values, _ = MarkerModel.of(fit.model.body, fit.model.unknowns, reading.misfit).predicted(fit.response)
        return np.asarray(values.reshape(-1, 2)[marker] - reading.misfit.observed[marker])


def _drop(found: Estimate, marker: int) -> float:
    """Drop of the misfit without a marker, to first order, in squared standard deviations."""
    rows = np.array([2 * marker, 2 * marker + 1])
    return float(found.residuals[rows] @ found.left_out(rows)) * found.inflation**2
