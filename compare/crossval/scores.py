"""What the outcomes of a cross-validation say: means, intervals, differences, and words for them."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from math import nan, sqrt

import numpy as np
from scipy.stats import norm, t

from compare.crossval.fold_result import FoldResult
from geometry.arrays import FloatArray

LEVEL = 0.95
"""Of every interval, and of the intervals of which coverage is the share that holds."""

RESAMPLES = 2000
"""Of the bootstrap."""

MARKERS = ("mae_u", "mae_v", "mae_sum", "mae_rss")
FIELDS = ("displacement", "strain", "von_mises", "von_mises_finite")
COMPARED = ("mae_sum", "displacement", "strain", "von_mises")
"""What a difference is told of."""


@dataclass(frozen=True)
class Interval:
    """A mean over seeds with Student's interval; its ends are NaN for one seed.

    Attributes:
        mean: Over the seeds.
        low: Lower end.
        high: Upper end.
    """

    mean: float
    low: float
    high: float

    @classmethod
    def of(cls, values: Sequence[float]) -> "Interval":
        """From a value for each seed."""
        mean = float(np.mean(values))
        if len(values) < 2:
            return cls(mean, nan, nan)
        half = t.ppf((1 + LEVEL) / 2, len(values) - 1) * float(np.std(values, ddof=1)) / sqrt(len(values))
        return cls(mean, mean - float(half), mean + float(half))


@dataclass(frozen=True)
class Difference:
    """A solver's score minus a baseline's, in the same folds and seeds.

    Attributes:
        mean: Negative where the solver is better.
        low: Lower end of the interval by bootstrap over folds and seeds.
        high: Upper end.
    """

    mean: float
    low: float
    high: float

    @classmethod
    def of(cls, differences: FloatArray) -> "Difference":
        """From one difference for each seed and fold, shape (s, f).

        Seeds and folds are drawn anew with replacement, each by itself, since a fold is as hard for every
        seed.
        """
        seeds, folds = differences.shape
        draws = np.random.default_rng(0)
        rows = draws.integers(seeds, size=(RESAMPLES, seeds, 1))
        columns = draws.integers(folds, size=(RESAMPLES, 1, folds))
        means = differences[rows, columns].mean(axis=(1, 2))
        low, high = np.quantile(means, [(1 - LEVEL) / 2, (1 + LEVEL) / 2])
        return cls(float(differences.mean()), float(low), float(high))

    @property
    def verdict(self) -> str:
        """In words."""
        if self.high < 0:
            return "better"
        return "worse" if self.low > 0 else "not told apart"


@dataclass(frozen=True)
class Score:
    """A solver in one scheme.

    Attributes:
        in_sample: Errors at markers that it was given, mm, by the names of `MARKERS`; empty if none were.
        held_out: Errors at markers that it was not given, mm; empty if all were.
        fields: Relative L2 distances from the truth over the body, by `FIELDS`; empty without a truth.
        coverage: Share of held-out errors, of u and v, within the interval of `LEVEL` by the standard
            deviations that the solver states; None if it states none.
        per_marker: Mean of |du| + |dv| at each marker over the folds that hold it out, shape (m,), mm.
        converged: Share of folds and seeds in which the solver converged.
    """

    in_sample: Mapping[str, Interval]
    held_out: Mapping[str, Interval]
    fields: Mapping[str, Interval]
    coverage: float | None
    per_marker: Sequence[float]
    converged: float


FoldResults = Sequence[Sequence[FoldResult]]
"""Of one solver in one scheme: for each seed its folds."""


def of_scheme(outcomes: FoldResults, scheme: str) -> list[list[FoldResult]]:
    """Those of a scheme."""
    return [[outcome for outcome in seed if outcome.fold.scheme == scheme] for seed in outcomes]


def score(outcomes: FoldResults) -> Score:
    """The score of a solver in a scheme."""
    ratios = np.concatenate([outcome.ratios for seed in outcomes for outcome in seed])
    inside = np.abs(ratios) <= norm.ppf((1 + LEVEL) / 2)
    fields = [name for name in FIELDS if name in outcomes[0][0].fields]
    return Score(
        in_sample=_errors(outcomes, lambda outcome: outcome.in_sample),
        held_out=_errors(outcomes, lambda outcome: outcome.held_out),
        fields={
            name: Interval.of(
                [float(np.mean([outcome.fields[name] for outcome in seed])) for seed in outcomes]
            )
            for name in fields
        },
        coverage=float(inside.mean()) if inside.size else None,
        per_marker=_per_marker(outcomes),
        converged=float(np.mean([outcome.converged for seed in outcomes for outcome in seed])),
    )


def marker_errors(errors: FloatArray) -> dict[str, float]:
    """Mean absolute errors of errors of shape (n, 2), mm, as the paper's two definitions have them."""
    u, v = (float(value) for value in np.abs(errors).mean(axis=0))
    return {"mae_u": u, "mae_v": v, "mae_sum": u + v, "mae_rss": float(np.hypot(u, v))}


def difference(outcomes: FoldResults, baseline: FoldResults, what: str) -> Difference | None:
    """How a solver's score differs from a baseline's; None where there is no such score.

    Args:
        outcomes: Of the solver in a scheme.
        baseline: Of the other one in the same.
        what: One of `COMPARED`.
    """
    pair = [_values(each, what) for each in (outcomes, baseline)]
    if pair[0] is None or pair[1] is None:
        return None
    return Difference.of(pair[0] - pair[1])


def _values(outcomes: FoldResults, what: str) -> FloatArray | None:
    """A score for each seed and fold, shape (s, f)."""
    if what in FIELDS:
        found = [[outcome.fields.get(what, nan) for outcome in seed] for seed in outcomes]
    else:
        found = [
            [marker_errors(outcome.held_out)[what] if len(outcome.held_out) else nan for outcome in seed]
            for seed in outcomes
        ]
    values = np.array(found)
    return values if np.isfinite(values).all() else None


def _mean_fields(outcomes: FoldResults, name: str) -> list[float]:
    """Mean distance over the folds of each seed."""
    return [float(np.mean([outcome.fields[name] for outcome in seed])) for seed in outcomes]


def _errors(outcomes: FoldResults, chosen: Callable[[FoldResult], FloatArray]) -> dict[str, Interval]:
    """Intervals of the mean absolute errors over all folds of a seed."""
    by_seed = [np.concatenate([chosen(outcome) for outcome in seed]) for seed in outcomes]
    if not all(map(len, by_seed)):
        return {}
    errors = [marker_errors(values) for values in by_seed]
    return {name: Interval.of([entry[name] for entry in errors]) for name in MARKERS}


def _per_marker(outcomes: FoldResults) -> list[float]:
    count = len(outcomes[0][0].errors)
    sums, times = np.zeros((2, count))
    for seed in outcomes:
        for outcome in seed:
            held = outcome.held
            sums[held] += np.abs(outcome.held_out).sum(axis=1)
            times[held] += 1
    return [float(total / number) if number else nan for total, number in zip(sums, times, strict=True)]
