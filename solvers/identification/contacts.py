"""The unknowns under each of several contacts, compared by the evidence of the fits."""

from collections.abc import Sequence
from typing import Protocol

from pinnray.geometry.observations import Observations
from pinnray.solvers.identification.result import Identified
from pinnray.solvers.solver import NoSolutionError, Progress, silent


class Search(Protocol):
    """Finds the unknowns for observations; see `Identifier` and `NestedSearch`."""

    def identify(self, observations: Observations, progress: Progress = silent) -> Identified:
        """The unknowns under every law."""
        ...


class Contacts:
    """Finds the unknowns under each contact that a load may make.

    Args:
        searches: One for each contact.
    """

    def __init__(self, searches: Sequence[Search]) -> None:
        self._searches = searches

    def identify(self, observations: Observations, progress: Progress = silent) -> Identified:
        """The unknowns under every contact and law.

        Evidence is of the same markers: a contact under which more of them contradict the others than under
        the best one is left out.

        Raises:
            UserError: If no contact has a solution.
        """
        found: list[Identified] = []
        for search in self._searches:
            try:
                found.append(search.identify(observations, progress))
            except NoSolutionError as error:
                reason = error
        if not found:
            raise reason
        best = min(found, key=lambda each: (len(each.doubtful), -each.best.log_posterior))
        same = [each for each in found if each.doubtful.keys() == best.doubtful.keys()]
        return Identified.ranked([fit for each in same for fit in each.fits], best.doubtful, best.lost)
