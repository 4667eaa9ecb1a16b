"""The result of a cross-validation: its samples, and the scores as groups of them."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import pandas as pd

from pinnray.runtime.notebook import brief
from pinnray.studies.crossval.folds import ALL, SCHEMES
from pinnray.studies.crossval.scores import CASE, SCORED, score_table
from pinnray.studies.crossval.study import CrossvalStudy
from pinnray.studies.crossval.true_fields import TrueField


@dataclass(frozen=True, eq=False)
class CrossvalResult:
    """A finished cross-validation.

    Attributes:
        study: Its settings.
        samples: A row for each marker of each fold, seed, solver, layout and truth; see `left_out_table`.
        sources: By truth one sentence on the source of the markers' displacements.
        truths: The true field of each truth at the full load; none with measurements.
        failed: Error messages of the solvers without a score, by solver (and truth and layout, if several).
    """

    study: CrossvalStudy
    samples: pd.DataFrame
    sources: Mapping[str, str]
    truths: Mapping[str, TrueField]
    failed: Mapping[str, str]

    __repr__ = brief

    @cached_property
    def scores(self) -> pd.DataFrame:
        """Every score with its interval and its differences; see `score_table`."""
        return score_table(self.samples)

    def table(self) -> pd.DataFrame:
        """Every score by truth, layout, solver, scheme and score, with interval and differences."""
        return self.scores.copy()

    @property
    def schemes(self) -> list[str]:
        """The schemes of the folds, in the order of `SCHEMES`."""
        present = set(self.samples["scheme"])
        return [scheme for scheme in SCHEMES if scheme in present]

    @property
    def main_scheme(self) -> str:
        """The scheme whose held-out error stands for a solver: one marker at a time if it was asked for."""
        return next(scheme for scheme in self.schemes if scheme != ALL)

    def said(self, truth: str, layout: str) -> str:
        """The names in which truths and layouts differ, for messages; empty for a single case."""
        pairs = zip((truth, layout), CASE, strict=True)
        return ", ".join(name for name, column in pairs if self.samples[column].nunique() > 1)

    @property
    def remarks(self) -> list[str]:
        """Faults of results: solvers that did not converge, and impossible bodies."""
        folds = self.samples.drop_duplicates([*SCORED, "seed", "fold"])
        found = []
        for (truth, layout, solver), part in folds.groupby([*CASE, "solver"], sort=False):
            against = [message for message in part["message"] if message]
            if against:
                many = f"{len(against)} of {len(part)} folds and seeds, the first of them: {against[0]}"
                found.append(", ".join(filter(None, [self.said(truth, layout), solver, many])))
        return found
