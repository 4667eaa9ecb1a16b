"""The scores of a finished cross-validation."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any, Self

from compare.crossval.fold_result import SeedResults
from compare.crossval.folds import SCHEMES, Fold
from compare.crossval.scores import COMPARED, LEVEL, Difference, Score, difference, of_scheme, score
from compare.crossval.study import Study
from compare.crossval.true_fields import FINER
from geometry.observations import Observations
from solvers.assimilation.misfit import assimilates

BASELINES = ("fem", "gp")
"""Solvers that the others are compared with."""


@dataclass(frozen=True, eq=False)
class CrossvalResult:
    """A finished study.

    Attributes:
        study: The study.
        source: One sentence on the source of the markers' displacements.
        markers: Number of markers.
        folds: The folds of every solver.
        scores: By solver and scheme.
        differences: By solver, baseline, scheme and entry of `COMPARED`.
        failed: Error messages of the solvers that have no score.
    """

    study: Study
    source: str
    markers: int
    folds: Sequence[Fold]
    scores: Mapping[str, Mapping[str, Score]]
    differences: Mapping[str, Mapping[str, Mapping[str, Mapping[str, Difference]]]]
    failed: Mapping[str, str]

    @property
    def schemes(self) -> list[str]:
        """The schemes of the folds, in the order of `SCHEMES`."""
        present = {fold.scheme for fold in self.folds}
        return [scheme for scheme in SCHEMES if scheme in present]

    @property
    def has_fields(self) -> bool:
        """Whether fields were compared with a truth."""
        return any(score.fields for each in self.scores.values() for score in each.values())

    def difference(self, label: str, baseline: str, scheme: str, what: str) -> Difference | None:
        """One of the `differences`; None if there is no such one."""
        return self.differences[label].get(baseline, {}).get(scheme, {}).get(what)

    @classmethod
    def of(
        cls,
        study: Study,
        observations: Observations,
        folds: Sequence[Fold],
        results: Mapping[str, SeedResults],
        failed: Mapping[str, str],
    ) -> Self:
        """Score the results of all folds of each solver."""
        schemes = list(dict.fromkeys(fold.scheme for fold in folds))
        by_scheme = {
            label: {scheme: of_scheme(each, scheme) for scheme in schemes} for label, each in results.items()
        }
        differences = {
            label: {
                baseline: {
                    scheme: {
                        what: found
                        for what in COMPARED
                        if (found := difference(each[scheme], by_scheme[baseline][scheme], what)) is not None
                    }
                    for scheme in schemes
                }
                for baseline in BASELINES
                if baseline in by_scheme and baseline != label
            }
            for label, each in by_scheme.items()
        }
        return cls(
            study=study,
            source=observations.source,
            markers=len(observations.points),
            folds=folds,
            scores={
                label: {scheme: score(found) for scheme, found in each.items()}
                for label, each in by_scheme.items()
            },
            differences=differences,
            failed=failed,
        )

    def content(self) -> dict[str, Any]:
        """The part of `crossval.json` that holds the result."""
        return {
            "measurements": {"description": self.source, "markers": self.markers},
            "seeds": self.study.seeds,
            "level": LEVEL,
            "truth": f"elements of {FINER:g} times the size" if self.study.measurements is None else None,
            "folds": [
                {"scheme": fold.scheme, "name": fold.name, "held": fold.held, "condition": fold.load_case}
                for fold in self.folds
            ],
            "schemes": {scheme: SCHEMES[scheme] for scheme in self.schemes},
            "solvers": {
                variant.label: {
                    "solver": variant.solver,
                    "settings": dict(variant.settings),
                    "assimilates": assimilates(variant.make(0)),
                    "schemes": {scheme: asdict(one) for scheme, one in self.scores[variant.label].items()},
                    "against": {
                        baseline: {scheme: _with_verdicts(each) for scheme, each in by_scheme.items()}
                        for baseline, by_scheme in self.differences[variant.label].items()
                    },
                }
                for variant in self.study.variants
                if variant.label in self.scores
            },
            "failed": dict(self.failed),
        }


def _with_verdicts(differences: Mapping[str, Difference]) -> dict[str, dict[str, Any]]:
    return {what: {**asdict(one), "verdict": one.verdict} for what, one in differences.items()}
