"""Contact, walls and law from the markers: the search, and markers that contradict the others.

Source: R. D. Cook, S. Weisberg, Residuals and Influence in Regression, Chapman and Hall 1982, for the misfit
without an observation.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import cache

import numpy as np
from scipy.special import chdtri

from pinnray.geometry.observations import Observations
from pinnray.runtime.arrays import BoolArray, FloatArray
from pinnray.solvers.assimilation.estimation import COST_CHANGE, MAX_STEPS
from pinnray.solvers.elasticity import LawName
from pinnray.solvers.identification.body import Body
from pinnray.solvers.identification.cylinder_model import response_model
from pinnray.solvers.identification.fit import Fit
from pinnray.solvers.identification.law_fits import LawFits
from pinnray.solvers.identification.model import MarkerData, MarkerModel, ResponseModel
from pinnray.solvers.identification.result import Identified
from pinnray.solvers.identification.settings import IdentifyingSolver
from pinnray.solvers.identification.unknowns import INDENTATION, LAWS, Unknowns
from pinnray.solvers.problem import Problem
from pinnray.solvers.solver import NoSolutionError, Progress, silent

QUICK, ROUGH = 4, 2
"""Steps in which a law is judged first, and rounds for φ in which the contacts to start from are."""

WIDE = (2.0, 4.0)
"""Standardised widths of a contact from which to start again where none explains the markers."""

POLISHES, POLISHED, SHRUNK = 6, 0.5, 0.2
"""Steps of first order by a finer discretisation at most; the size of the last one in the posterior's metric,
in standard deviations, of which it leaves about a third; and the share of the step before it that a step has
where the derivatives serve."""

IMPROBABLE = 15.0
"""Logarithm of the ratio of probabilities from which on a law is not fitted to the end."""

ASTRAY, HOPELESS = 10.0, 100.0
"""φ from which the contact is elsewhere or a marker is wrong, and from which neither a wide contact nor
another law explains the markers: another order or finger does."""


class Identifier:
    """Finds the unknowns of one finger for any observations; each search starts from the last result.

    Args:
        settings: Unknowns, priors, radius of the markers and reaction.
        problem: The finger; of its load only the drawn contact counts, of its law nothing unless it is given.
        body: Makes the discretised finger of a problem, whose law is set, and the unknowns.
        names: Of the unknowns; those of the settings by default.
        cost_change: Relative change of the cost below which a search has converged.
        flexibility: Of the finger if it is known, mm per N/mm; see `ResponseModel.flexibility`.
        weighed: See `ResponseModel`.
    """

    def __init__(
        self,
        settings: IdentifyingSolver,
        problem: Problem,
        body: Callable[[Unknowns], Body],
        names: Sequence[str] | None = None,
        *,
        cost_change: float = COST_CHANGE,
        flexibility: float | None = None,
        weighed: bool = False,
    ) -> None:
        self._settings, self._mesh = settings, problem.mesh
        sought = settings.unknowns if names is None else names
        names = [INDENTATION if name == "normal_force" else name for name in sought]

        @cache
        def model(law: LawName) -> ResponseModel:
            own = replace(problem, material=problem.material.model_copy(update={"law": law}))
            unknowns = Unknowns(own, names)
            return response_model(body(unknowns), unknowns, weighed=weighed)

        self.laws = LAWS if settings.law == "evidence" else (problem.material.law,)
        self.model = model
        self.flexibility = model(self.laws[0]).flexibility() if flexibility is None else flexibility
        unknowns = Unknowns(problem, names)
        self._names, self._feet = unknowns.names, unknowns.feet.names
        self.parameters = unknowns.parameters(self.flexibility, settings.prior)
        self._fits = LawFits(model, self.parameters, cost_change)
        self._known: dict[LawName, Fit] = {}

    def measurement(self, observations: Observations) -> MarkerData:
        """The markers that were seen and, if the settings have one, the reaction."""
        chosen, reaction = self._settings, None
        if chosen.reaction is not None:
            reaction = chosen.reaction, chosen.reaction_error * abs(chosen.reaction)
        return MarkerData.of(self._mesh, observations, chosen.marker_radius, reaction)

    def identify(self, observations: Observations, progress: Progress = silent) -> Identified:
        """The unknowns under every law, and the laws' probabilities.

        Raises:
            UserError: If there are no markers, or the finger has no equilibrium near rest.
        """
        self._fits.progress = progress
        measurement, untried, lost = self.measurement(observations), list(self.laws), list[LawName]()
        rough: list[Fit] = []
        while True:
            if not rough:
                rough = self._rough(measurement, untried, lost)
            best = max(rough, key=lambda fit: fit.log_posterior)
            try:
                fit, doubtful = self._settled(best)
                break
            except NoSolutionError:
                lost.append(best.law)
                if len(lost) == len(self.laws):
                    raise
                rough = [each for each in rough if each.law != best.law]
        fits = [fit]
        rivals = [law for law in self.laws if law != fit.law and law not in lost]
        for law in rivals if fit.estimate.inflation < HOPELESS else ():
            try:
                fits.append(self._rival(law, fit))
            except NoSolutionError:
                lost.append(law)
        for each in fits:
            self._known.setdefault(each.law, each)
        return Identified.ranked(fits, doubtful, lost)

    def _rival(self, law: LawName, fit: Fit) -> Fit:
        """The fit of another law than the best one, to its end unless it could not be probable even there."""
        other = self._fits.fit(law, fit.measurement, fit, rounds=1, steps=QUICK)
        if self._fits.shifted(other, fit.measurement).log_posterior > fit.log_posterior - IMPROBABLE:
            other = self._fits.fit(law, fit.measurement, other)
        return other

    def polished(self, fit: Fit, observations: Observations, least: float = -np.inf) -> Fit:
        """A fit after steps of first order, each from an equilibrium, with the derivatives that the fit has.

        They are computed anew where the steps do not settle. If that does not help, the unknowns are sought
        from there; where there is no equilibrium either, the fit is marked as inexact.

        Args:
            fit: Its response is near equilibrium, with derivatives that are nearly those there.
            observations: Those of the fit.
            least: Logarithm of the probability below which the first step is the last one.
        """
        model, start, before = fit.model, fit, np.inf
        settling = not model.body.thick  # whose derivatives are not those of the plane
        measurement = self.measurement(observations).only(fit.measurement.kept)
        model.restart(fit.response)
        for _ in range(POLISHES):
            values, slopes = fit.response.values, fit.response.slopes if settling else None
            response = model.response(values, iterations=20, halvings=0, slopes=slopes)
            if response is None:
                break
            start = fit._replace(response=response)
            fit = self._fits.shifted(start, measurement)
            step = fit.estimate.z - start.estimate.z
            size = float(np.sqrt(step @ np.linalg.solve(fit.estimate.covariance, step)))
            if size < POLISHED or fit.log_posterior < least:
                return fit
            settling, before = size < SHRUNK * before, size
        try:
            return self._fits.fit(fit.law, measurement, start)
        except NoSolutionError:
            return fit._replace(exact=False)

    def updated(self, found: Identified, observations: Observations) -> Identified:
        """The unknowns for observations near those of fits, to first order: no equilibrium is solved."""
        measurement = self.measurement(observations)
        return Identified.ranked([self._fits.shifted(fit, measurement) for fit in found.fits], {}, found.lost)

    def _rough(self, measurement: MarkerData, untried: list[LawName], lost: list[LawName]) -> list[Fit]:
        """Fits with φ = 1, the first one to its end, others in a few steps from it, till one explains all.

        Args:
            measurement: The markers.
            untried: The laws, of which those that are fitted are taken.
            lost: Takes the laws that have no equilibrium near the markers.
        """
        found: list[Fit] = []
        while untried and not (found and _explained(found[-1])):
            law = untried.pop(0)
            steps = QUICK if found else MAX_STEPS
            near = self._known.get(law, found[0] if found else None)
            try:
                found.append(self._fits.fit(law, measurement, near, held=self._loose, rounds=1, steps=steps))
            except NoSolutionError as error:
                lost.append(law)
                reason = error
        if not found:
            raise reason
        return found

    def _settled(self, rough: Fit) -> tuple[Fit, dict[int, FloatArray]]:
        """The fit of a law without markers that contradict the others, and by how much they are off, mm.

        Where it does not explain the markers, it is the best from several contacts. The feet are held till
        then: they would turn far to make up for a contact that is not found yet.
        """
        if rough.estimate.converged:
            return self._ended(rough), {}
        best = self._fits.fit(rough.law, rough.measurement, rough, held=self._loose, rounds=ROUGH)
        if best.estimate.inflation == 1 or self._known:
            return self._believed(self._ended(best))
        if self._loose or best.estimate.inflation < ASTRAY:
            return self._believed(self._ended(self._of_contacts(best)))
        found, doubtful = self._believed(best)
        if _explained(found):
            return found, doubtful
        ended = self._ended(self._of_contacts(best))
        return (found, doubtful) if ended is best else self._believed(ended)

    def _ended(self, fit: Fit) -> Fit:
        """The fit with the feet that a first search holds, and to the end if that is worth while."""
        if not self._loose and (fit.estimate.converged or fit.estimate.inflation > HOPELESS):
            return fit
        try:
            return self._fits.fit(fit.law, fit.measurement, fit)
        except NoSolutionError:  # the way there leads astray; it stays as it is, not converged
            return fit

    def _of_contacts(self, best: Fit) -> Fit:
        """The best of a fit and those that start from other contacts."""
        law, measurement = best.law, best.measurement
        for start in self._elsewhere(best):
            try:
                if start @ self._is_width:
                    held = ("width", *self._loose)
                    near = self._fits.fit(law, measurement, None, start, held=held, rounds=1, steps=QUICK)
                    start = np.where(self._is_width, start, near.estimate.z)
                other = self._fits.fit(law, measurement, None, start, held=self._loose, rounds=ROUGH)
            except NoSolutionError:
                continue
            best = max(best, other, key=lambda fit: fit.log_evidence)
            if best.estimate.inflation == 1:
                break
        return best

    def _elsewhere(self, fit: Fit) -> Iterator[FloatArray]:
        """Standardised values, shape (p,), to start again from: wider contacts.

        Where little is explained, places far away follow; where nothing is, they are all.
        """
        found = fit.estimate
        if "width" in self._names and found.inflation <= HOPELESS:
            yield from (np.where(self._is_width, wide, found.z) for wide in WIDE)
        if "position" in self._names and found.inflation > ASTRAY:
            for away in (-2.0, 2.0):
                start = np.zeros(len(self._names))
                start[self._names.index("position")] = away
                yield start

    @property
    def _is_width(self) -> BoolArray:
        """Mask of the contact's width, shape (p,)."""
        return np.array([name == "width" for name in self._names])

    @property
    def _loose(self) -> tuple[str, ...]:
        """Names of the motions that a first search holds."""
        return () if self._known else self._feet

    def _believed(self, fit: Fit) -> tuple[Fit, dict[int, FloatArray]]:
        """The fit without markers that contradict the others, and by how much they are off, mm.

        To first order, the misfit without such a marker falls by more than 30 squared standard deviations:
        noise alone drops it by more once in three million markers (χ² of two degrees of freedom). φ has to
        fall by half as well, so that a model that is wrong everywhere loses no marker.
        """
        doubtful: dict[int, FloatArray] = {}
        most = len(fit.measurement.kept) // 3
        while not _explained(fit) and len(doubtful) < most:
            found, measurement = fit.estimate, fit.measurement
            pairs = np.arange(2 * len(measurement.kept)).reshape(-1, 2)
            drops = [
                float(found.residuals[rows] @ found.residuals_without(rows)) * found.inflation**2
                for rows in pairs
            ]
            worst = int(np.argmax(drops))
            if drops[worst] < 30:
                break
            number = int(measurement.kept[worst])
            without = self._fits.fit(fit.law, measurement.only(np.delete(measurement.kept, worst)), fit)
            if 2 * without.estimate.inflation > found.inflation and not _explained(without):
                break
            computed, _ = MarkerModel(without.model, measurement).predicted(without.response)
            doubtful[number] = (computed - measurement.observed)[pairs[worst]]
            fit = without
        return fit, doubtful


def _explained(fit: Fit) -> bool:
    """Whether noise and priors explain the markers: neither is φ above one, nor are the values far astray."""
    found = fit.estimate
    cost = float(found.residuals @ found.residuals + found.z @ found.z)
    return found.inflation == 1 and cost < chdtri(len(found.residuals), 1e-3)
