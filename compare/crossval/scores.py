"""Scores of a solver from its folds: means, confidence intervals and differences from a baseline."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from math import nan, sqrt
from typing import Self

import numpy as np
from scipy.special import ndtri, stdtrit

from pinnray.comparison.crossval.folds import FoldResult, SeedResults
from pinnray.runtime.arrays import FloatArray

LEVEL = 0.95
"""Confidence level of every interval; coverage is the share of errors inside the interval of this level."""

MARKERS = ("mae_u", "mae_v", "mae_sum", "mae_rss")
FIELDS = ("displacement", "strain", "von_mises", "von_mises_finite")
FIELD_NAMES = {"displacement": "displacement", "strain": "strain", "von_mises": "von Mises stress"}
COMPARED = ("mae_sum", *FIELD_NAMES, "force")
"""Scores of which differences from the baselines are computed."""
BASELINES = ("fem", "gp", "statfem", "fem-asm")
"""Solvers that the others are compared with."""


@dataclass(frozen=True)
class ScoreInterval:
    """A mean with a confidence interval, whose ends are NaN for one seed."""

    mean: float
    low: float
    high: float

    @classmethod
    def of(cls, values: Sequence[float]) -> Self:
        """Student's interval from a value for each seed."""
        mean = float(np.mean(values))
        if len(values) < 2:
            return cls(mean, nan, nan)
        half = stdtrit(len(values) - 1, (1 + LEVEL) / 2) * float(np.std(values, ddof=1)) / sqrt(len(values))
        return cls(mean, mean - float(half), mean + float(half))


@dataclass(frozen=True)
class Difference(ScoreInterval):
    """A solver's score minus a baseline's, in the same folds and seeds; negative if it is better."""

    @classmethod
    def bootstrap(cls, differences: FloatArray) -> Self:
        """Bootstrap interval from one difference for each seed and fold, shape (s, f).

        Seeds and folds are resampled with replacement, independently of each other, since a fold is equally
        hard for every seed.
        """
        seeds, folds = differences.shape
        draws = np.random.default_rng(0)
        rows = draws.integers(seeds, size=(2000, seeds, 1))
        columns = draws.integers(folds, size=(2000, 1, folds))
        means = differences[rows, columns].mean(axis=(1, 2))
        low, high = np.quantile(means, [(1 - LEVEL) / 2, (1 + LEVEL) / 2])
        return cls(float(differences.mean()), float(low), float(high))

    @property
    def verdict(self) -> str:
        """`better`, `worse` or `not told apart`."""
        if self.high < 0:
            return "better"
        return "worse" if self.low > 0 else "not told apart"


@dataclass(frozen=True)
class Score:
    """A solver in one scheme; its last five numbers are means over `FoldResult`, None if any of them is None.

    Attributes:
        in_sample: Errors at markers that it was given, mm, by the names of `MARKERS`; empty if none were.
        held_out: Errors at markers that it was not given, mm; empty if all were.
        fields: Relative L2 distances from the truth over the body, by `FIELDS`; empty without a truth.
        coverage: Share of held-out errors, of u and v, within the interval of `LEVEL` by the standard
            deviations that the solver states; None if it states none.
        per_marker: Mean of |du| + |dv| at each marker over the folds that hold it out, shape (m,), mm.
        converged: Share of folds and seeds in which the solver converged.
    """

    in_sample: Mapping[str, ScoreInterval]
    held_out: Mapping[str, ScoreInterval]
    fields: Mapping[str, ScoreInterval]
    coverage: float | None
    per_marker: Sequence[float]
    converged: float
    force: ScoreInterval | None = None
    position: ScoreInterval | None = None
    von_mises_coverage: float | None = None
    force_within: float | None = None
    position_within: float | None = None

    @property
    def stated(self) -> dict[str, float | None]:
        """Shares in which the truth lies in the stated intervals of stress, force and place, by column."""
        return {
            "von_mises_within_stated": self.von_mises_coverage,
            "force_within_stated": self.force_within,
            "position_within_stated": self.position_within,
        }


def of_scheme(results: SeedResults, scheme: str) -> list[list[FoldResult]]:
    """The results of a scheme's folds."""
    return [[found for found in seed if found.fold.scheme == scheme] for seed in results]


def score(results: SeedResults) -> Score:
    """The score of a solver from its results in one scheme."""
    ratios = np.concatenate([found.ratios for seed in results for found in seed])
    inside = np.abs(ratios) <= ndtri((1 + LEVEL) / 2)
    return Score(
        in_sample=_errors(results, lambda found: found.in_sample),
        held_out=_errors(results, lambda found: found.held_out),
        fields={
            name: ScoreInterval.of(
                [float(np.mean([found.fields[name] for found in seed])) for seed in results]
            )
            for name in FIELDS
            if name in results[0][0].fields
        },
        coverage=float(inside.mean()) if inside.size else None,
        per_marker=_per_marker(results),
        converged=float(np.mean([found.converged for seed in results for found in seed])),
        force=_interval(results, "force"),
        position=_interval(results, "position"),
        von_mises_coverage=_share(results, "von_mises_coverage"),
        force_within=_share(results, "force_within"),
        position_within=_share(results, "position_within"),
    )


def mean_errors(errors: FloatArray) -> dict[str, float]:
    """Mean absolute errors of errors of shape (n, 2), mm, by the paper's two definitions."""
    u, v = (float(value) for value in np.abs(errors).mean(axis=0))
    return {"mae_u": u, "mae_v": v, "mae_sum": u + v, "mae_rss": float(np.hypot(u, v))}


def differences(results: SeedResults, baseline: SeedResults) -> dict[str, Difference]:
    """Differences of a solver's scores in a scheme from a baseline's, by entry of `COMPARED`."""
    pairs = {what: (_values(results, what), _values(baseline, what)) for what in COMPARED}
    return {
        what: Difference.bootstrap(own - other)
        for what, (own, other) in pairs.items()
        if own is not None and other is not None
    }


def _values(results: SeedResults, what: str) -> FloatArray | None:
    """A score for each seed and fold, shape (s, f); None if some fold has none."""

    def value(found: FoldResult) -> float:
        if what == "force":
            return nan if found.force is None else abs(found.force)
        if what in FIELDS:
            return found.fields.get(what, nan)
        return mean_errors(found.held_out)[what] if len(found.held_out) else nan

    values = np.array([[value(found) for found in seed] for seed in results])
    return values if np.isfinite(values).all() else None


def _interval(results: SeedResults, name: str) -> ScoreInterval | None:
    """Interval over seeds of a number of the folds; None if some fold has none."""
    values = [[getattr(found, name) for found in seed] for seed in results]
    if any(value is None for seed in values for value in seed):
        return None
    return ScoreInterval.of([float(np.mean(seed)) for seed in values])


def _share(results: SeedResults, name: str) -> float | None:
    found = _interval(results, name)
    return None if found is None else found.mean


def _errors(results: SeedResults, chosen: Callable[[FoldResult], FloatArray]) -> dict[str, ScoreInterval]:
    """Intervals of the mean absolute errors over all folds of a seed."""
    by_seed = [np.concatenate([chosen(found) for found in seed]) for seed in results]
    if not all(map(len, by_seed)):
        return {}
    errors = [mean_errors(values) for values in by_seed]
    return {name: ScoreInterval.of([entry[name] for entry in errors]) for name in MARKERS}


def _per_marker(results: SeedResults) -> list[float]:
    sums, times = np.zeros((2, len(results[0][0].errors)))
    for found in (found for seed in results for found in seed):
        sums[found.held] += np.abs(found.held_out).sum(axis=1)
        times[found.held] += 1
    return [float(total / number) if number else nan for total, number in zip(sums, times, strict=True)]
