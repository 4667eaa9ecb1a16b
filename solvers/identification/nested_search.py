"""The unknowns sought by a coarse discretisation of the finger and carried to a fine one."""

from collections.abc import Callable

from pinnray.geometry.observations import Observations
from pinnray.solvers.identification.fit import Fit
from pinnray.solvers.identification.model import Response, ResponseModel
from pinnray.solvers.identification.result import Identified
from pinnray.solvers.identification.search import Identifier
from pinnray.solvers.solver import Progress, silent

IMPROBABLE = 8.0
"""Logarithm of the ratio of probabilities by a coarse discretisation from which on a law is not carried to a
fine one: the fine one changed it by up to 3.5, and a law of one in a hundred has no weight."""

ROUGHLY = 1e-2
"""Relative change of the cost below which a coarse search has converged: the steps of the fine one are as
large, and by a coarse one the force's place makes the cost rough."""


class NestedSearch:
    """Finds the unknowns by a coarse discretisation and carries them to a fine one; see `Identifier`.

    Args:
        coarse: Seeks by coarse finite elements.
        fine: Of the same laws, discretised finely.
        carried: The response of a coarse fit, with its derivatives, in the discretisation of a fine model.
    """

    def __init__(
        self, coarse: Identifier, fine: Identifier, carried: Callable[[Fit, ResponseModel], Response]
    ) -> None:
        self._coarse, self._fine, self._carried = coarse, fine, carried

    def identify(self, observations: Observations, progress: Progress = silent) -> Identified:
        """The unknowns under every law, and the laws' probabilities; see `Identifier`."""

        def polished(fit: Fit) -> Fit:
            progress(0.6, f"{fit.law}: finer")
            model = self._fine.model(fit.law)
            start = fit._replace(model=model, response=self._carried(fit, model))
            return self._fine.polished(start, observations)

        found = self._coarse.identify(observations, lambda share, text: progress(0.6 * share, text))
        fits = [polished(found.best)]
        least = min(found.best.log_posterior, fits[0].log_posterior) - IMPROBABLE
        fits += [polished(fit) if fit.log_posterior > least else fit for fit in found.fits[1:]]
        return Identified.ranked(fits, found.doubtful, found.lost)

    def updated(self, found: Identified, observations: Observations) -> Identified:
        """The unknowns for observations near those of fits, to first order; see `Identifier`."""
        return self._fine.updated(found, observations)
