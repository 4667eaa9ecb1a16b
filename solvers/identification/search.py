"""Contact, walls and law from the markers: the search.

It starts from one contact of `STARTS` after another until noise explains the markers, and goes on from the
fit of the largest evidence. From there every other law is fitted, and the laws are weighed by their evidence.
A marker that makes it larger by being wrong than by being explained is left out.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cache

import numpy as np

from pinnray.geometry.observations import Observations
from pinnray.solvers.assimilation.estimation import COST_CHANGE
from pinnray.solvers.elasticity import LawName
from pinnray.solvers.identification.body import Body
from pinnray.solvers.identification.cylinder_model import response_model
from pinnray.solvers.identification.fit import Fit
from pinnray.solvers.identification.law_fits import LawFits
from pinnray.solvers.identification.model import MarkerData, ResponseModel
from pinnray.solvers.identification.result import Identified
from pinnray.solvers.identification.settings import IdentifyingSolver
from pinnray.solvers.identification.unknowns import INDENTATION, LAWS, Unknowns
from pinnray.solvers.problem import Problem
from pinnray.solvers.solver import NoSolutionError, Progress, silent

STARTS = ((0.0, 0.0), (0.0, 2.0), (0.0, 4.0), (-2.0, 0.0), (2.0, 0.0))
"""Standardised positions and widths of the contacts to start from: as drawn, wider, and elsewhere."""

ROUNDS = 2
"""Rounds for φ from a start."""

POLISHES, POLISHED, SHRUNK = 6, 0.5, 0.2
"""Steps of first order by a finer discretisation at most; the size of the last one in the posterior's metric,
in standard deviations, of which it leaves about a third; and the share of the step before it that a step has
where the derivatives serve."""


class Identifier:
    """Finds the unknowns of one finger for any observations; each search starts from the last result.

    Args:
        settings: Unknowns, priors and radius of the markers.
        problem: The finger; of its load the drawn contact and a cylinder count, of its law nothing unless
            it is given.
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
        self._settings, self._problem = settings, problem
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
        self._fits = LawFits(model, self.parameters, unknowns.prior(self.parameters), cost_change)
        self._known: dict[LawName, Fit] = {}

    def measurement(self, observations: Observations) -> MarkerData:
        """The markers that were seen and, if it was weighed, the force.

        Raises:
            UserError: If none was seen, or a force was weighed and the finger has no depth.
        """
        return MarkerData.of(self._problem, observations, self._settings.marker_radius)

    def identify(self, observations: Observations, progress: Progress = silent) -> Identified:
        """The unknowns under every law, and the laws' probabilities.

        Raises:
            UserError: If there are no markers, or the finger has no equilibrium near rest.
        """
        self._fits.progress = progress
        measurement, fits, lost = self.measurement(observations), list[Fit](), list[LawName]()
        for law in self.laws:
            near = self._known.get(law, fits[0] if fits else None)
            try:
                found = self._fits.fit(law, measurement, near) if near else self._started(law, measurement)
                fits.append(found)
            except NoSolutionError:
                lost.append(law)
                if len(lost) == len(self.laws):
                    raise
        self._known = {each.law: each for each in fits} | self._known
        return Identified.ranked(fits, lost)

    def _started(self, law: LawName, measurement: MarkerData) -> Fit:
        """The fit of the largest evidence from a contact of `STARTS`, till noise explains the markers.

        The feet are held: they would turn far to make up for a contact that is not found yet. That of a
        cylinder is known nearly.
        """
        if INDENTATION not in self._names:
            return self._fits.fit(law, measurement, self._fits.prior.mean)
        best: Fit | None = None
        for position, width in STARTS:
            contact = {"position": position, "width": width}
            start = self._fits.prior.mean + np.array([contact.get(name, 0.0) for name in self._names])
            try:
                fit = self._fits.fit(law, measurement, start, held=self._feet, rounds=ROUNDS)
            except NoSolutionError as error:
                reason = error
                continue
            best = fit if best is None else max(best, fit, key=lambda each: each.log_evidence)
            if best.estimate.explained:
                break
        if best is None:
            raise reason
        settled = best.estimate.converged and not self._feet
        return best if settled else self._fits.fit(law, measurement, best)

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
        measurement = self.measurement(observations)
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
        return Identified.ranked([self._fits.shifted(fit, measurement) for fit in found.fits], found.lost)
