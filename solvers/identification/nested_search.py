"""The unknowns sought by a coarse discretisation and carried to others, under each contact."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from pinnray.geometry.observations import Observations
from pinnray.solvers.identification.fit import Fit
from pinnray.solvers.identification.model import Response, ResponseModel
from pinnray.solvers.identification.result import CONTRADICTED, Identified
from pinnray.solvers.identification.search import Identifier
from pinnray.solvers.solver import NoSolutionError, Progress, silent

IMPROBABLE = 8.0
"""Logarithm of the ratio of probabilities from which on a fit is not carried to a finer discretisation: that
changed it by up to 3.5, and a law of one in a hundred has no weight."""

ROUGHLY = 1e-2
"""Relative change of the cost below which a coarse search has converged: the steps of the fine one are as
large, and by a coarse one the force's place makes the cost rough."""


@dataclass(frozen=True, eq=False)
class NestedSearch:
    """Finds the unknowns by a coarse discretisation and carries them to others; see `Identifier`.

    Args:
        coarse: Seeks by coarse finite elements.
        carried: The response of a coarse fit, with its derivatives, in the discretisation of another model.
        fine: Of the same laws, discretised finely; None where the coarse elements are fine enough.
        thick: Of the same laws, with free side faces, which are weighed against the plane; None if the
            finger has no depth.
    """

    coarse: Identifier
    carried: Callable[[Fit, ResponseModel], Response]
    fine: Identifier | None = None
    thick: Identifier | None = None

    def identify(
        self, observations: Observations, progress: Progress = silent, rival: float = -np.inf
    ) -> Identified:
        """The unknowns under every law, with free side faces and without, and their probabilities.

        What is far less probable than a rival of a logarithm is not carried to other elements.
        """

        def carried(fits: Sequence[Fit], other: Identifier, said: str, least: float = -np.inf) -> list[Fit]:
            found = []
            for fit in fits:
                progress(0.6, f"{fit.law}: {said}")
                model = other.model(fit.law)
                start = fit._replace(model=model, response=self.carried(fit, model))
                found.append(other.polished(start, observations, least))
            return found

        found = self.coarse.identify(observations, lambda share, text: progress(0.6 * share, text))
        least = max(found.best.log_posterior, rival) - IMPROBABLE
        likely = [fit for fit in found.fits if fit.log_posterior > least]
        rest, thick = found.fits[len(likely) :], list[Fit]()
        plane = likely if self.fine is None else carried(likely, self.fine, "finer")
        if self.thick is not None and likely and found.best.estimate.inflation < CONTRADICTED:
            least = plane[0].log_posterior - IMPROBABLE
            thick = carried(likely, self.thick, "with free side faces", least)
        return Identified.ranked([*plane, *thick, *rest], found.lost)

    def updated(self, found: Identified, observations: Observations) -> Identified:
        """The unknowns for observations near those of fits, to first order; see `Identifier`."""
        return self.coarse.updated(found, observations)


def identified(
    searches: Sequence[NestedSearch], observations: Observations, progress: Progress = silent
) -> Identified:
    """The unknowns under every law and every contact that a load may make.

    Args:
        searches: One for each contact.
        observations: Of the markers.
        progress: Called as the searches go on.

    Raises:
        UserError: If no contact has a solution.
    """
    found: list[Identified] = []
    for search in searches:
        try:
            least = max((each.best.log_posterior for each in found), default=-np.inf)
            found.append(search.identify(observations, progress, least))
        except NoSolutionError as error:
            reason = error
    if not found:
        raise reason
    best = max(found, key=lambda each: each.best.log_posterior)
    return Identified.ranked([fit for each in found for fit in each.fits], best.lost)
