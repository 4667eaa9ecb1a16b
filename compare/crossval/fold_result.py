"""The errors of one solver in one fold."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from compare.crossval.folds import Fold
from geometry.arrays import FloatArray


@dataclass(frozen=True)
class FoldResult:
    """A solver in one fold for one seed.

    Attributes:
        fold: The held-out markers and the load.
        errors: Predicted minus observed displacement of every marker at the fold's load, shape (m, 2), mm.
        deviations: Standard deviations that the solver states for them, shape (m, 2), mm; None if none.
        fields: Relative L2 distances from the truth; empty without a truth.
        converged: Whether the solver converged, by its own criterion.
        given: Whether it was given any markers.
    """

    fold: Fold
    errors: Sequence[Sequence[float]]
    deviations: Sequence[Sequence[float]] | None = None
    fields: Mapping[str, float] = field(default_factory=dict)
    converged: bool = True
    given: bool = True

    @property
    def held(self) -> list[int]:
        """Numbers of the markers whose errors count as held out: all of them at another load."""
        return list(range(len(self.errors)) if self.fold.load_case else self.fold.held)

    @property
    def held_out(self) -> FloatArray:
        """Errors at markers that were not given at this load, shape (h, 2), mm."""
        return np.asarray(np.array(self.errors)[self.held])

    @property
    def in_sample(self) -> FloatArray:
        """Errors at markers that were given at this load, shape (g, 2), mm."""
        given = np.full(len(self.errors), self.given)
        given[self.held] = False
        return np.asarray(np.array(self.errors)[given])

    @property
    def ratios(self) -> FloatArray:
        """Errors of held-out markers over their stated standard deviations, shape (h, 2), or (0, 2)."""
        if self.deviations is None:
            return np.zeros((0, 2))
        return np.asarray(self.held_out / np.array(self.deviations)[self.held])


SeedResults = Sequence[Sequence[FoldResult]]
"""For each seed, the results of its folds."""
