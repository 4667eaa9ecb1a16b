"""What a cross-validation found."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any, Self

from compare.crossval.fold_result import FoldResult
from compare.crossval.folds import SCHEMES, Fold
from compare.crossval.scores import COMPARED, LEVEL, Difference, Score, difference, of_scheme, score
from compare.crossval.study import Study
from compare.crossval.true_fields import FINER
from geometry.observations import Observations
from solvers.assimilation.misfit import assimilates

BASELINES = ("fem", "gp")
"""Solvers from which differences are told."""


@dataclass(frozen=True, eq=False)
class CrossvalResult:
    """A finished study.

    Attributes:
        study: What was asked for.
        source: One sentence on where the markers' displacements come from.
        markers: How many there are.
        folds: What was held out.
        scores: By solver and scheme.
        differences: By solver, baseline, scheme and entry of `COMPARED`.
        failed: What solvers that have no score ended with.
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
        """Those that there are folds of, in the usual order."""
        present = {fold.scheme for fold in self.folds}
        return [scheme for scheme in SCHEMES if scheme in present]

    @classmethod
    def of(
        cls,
        study: Study,
        observations: Observations,
        folds: Sequence[Fold],
        outcomes: Mapping[str, list[list[FoldResult]]],
        failed: Mapping[str, str],
    ) -> Self:
        """Score what came of every fold."""
        schemes = list(dict.fromkeys(fold.scheme for fold in folds))
        by_scheme = {
            label: {scheme: of_scheme(each, scheme) for scheme in schemes} for label, each in outcomes.items()
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
                label: {scheme: score(entries) for scheme, entries in each.items()}
                for label, each in by_scheme.items()
            },
            differences=differences,
            failed=failed,
        )

    def content(self) -> dict[str, Any]:
        """What `crossval.json` says of it."""
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
                    "schemes": {
                        scheme: asdict(found) for scheme, found in self.scores[variant.label].items()
                    },
                    "against": {
                        baseline: {scheme: _verdicts(each) for scheme, each in by_scheme.items()}
                        for baseline, by_scheme in self.differences[variant.label].items()
                    },
                }
                for variant in self.study.variants
                if variant.label in self.scores
            },
            "failed": dict(self.failed),
        }


def _verdicts(differences: Mapping[str, Difference]) -> dict[str, dict[str, Any]]:
    return {what: {**asdict(one), "verdict": one.verdict} for what, one in differences.items()}
