"""The unknowns under each of several contacts, compared by the evidence of the fits."""

from collections.abc import Sequence

import numpy as np

from pinnray.geometry.observations import Observations
from pinnray.solvers.identification.nested_search import NestedSearch
from pinnray.solvers.identification.result import Identified
from pinnray.solvers.solver import NoSolutionError, Progress, silent


class Contacts:
    """Finds the unknowns under each contact that a load may make.

    Args:
        searches: One for each contact.
    """

    def __init__(self, searches: Sequence[NestedSearch]) -> None:
        self._searches = searches

    def identify(self, observations: Observations, progress: Progress = silent) -> Identified:
        """The unknowns under every contact and law.

        Raises:
            UserError: If no contact has a solution.
        """
        found: list[Identified] = []
        for search in self._searches:
            try:
                least = max((each.best.log_posterior for each in found), default=-np.inf)
                found.append(search.identify(observations, progress, least))
            except NoSolutionError as error:
                reason = error
        if not found:
            raise reason
        best = max(found, key=lambda each: each.best.log_posterior)
        return Identified.ranked([fit for each in found for fit in each.fits], best.lost)
