"""Samples of a cross-validation as a table, and scores of its solvers as groups of it."""

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
import pandas as pd
from scipy.special import ndtri, stdtrit

from pinnray.runtime.arrays import FloatArray
from pinnray.studies.crossval.folds import Fold
from pinnray.studies.sweep.measurement import Measurement

LEVEL = 0.95
"""Confidence level of every interval; `within_stated` is the share of errors inside the stated interval."""

FIELDS = ("displacement", "strain", "von_mises", "von_mises_true_law")
STATED = (
    "von_mises_within_stated",
    "force_within_stated",
    "tangential_within_stated",
    "position_within_stated",
)
HELD_OUT = "held_out_mae_sum_mm"
COMPARED = (HELD_OUT, *FIELDS[:3], "force_error")
"""Scores of which differences from the baselines are computed."""
BASELINES = ("fem", "gp", "fem-asm")
"""Solvers that the others are compared with."""

CASE, SCORED = ["truth", "layout"], ["truth", "layout", "solver", "scheme"]
ERRORS = ["error_u_mm", "error_v_mm"]
ONCE = [*FIELDS, "force_error", "force_half_width", "position_error_mm", *STATED, "converged"]
"""Columns of which a fold has one number, equal in the rows of all its markers."""


class Sample(NamedTuple):
    """A solver in one fold for one seed, with a truth and a layout of its markers."""

    truth: str
    layout: str
    solver: str
    seed: int
    fold: Fold


def left_out_table(samples: Iterable[tuple[Sample, bool, Measurement]]) -> pd.DataFrame:
    """A row for each marker of each sample, of which the flag says whether its solver takes markers.

    Errors are predicted minus observed displacements; deviations those that the solver states for them.
    Relative L2 distances of fields from the truth, errors of force and place, and whether the truth is within
    stated intervals, are of the whole sample. NaN stands where there is no number.
    """
    rows = []
    for sample, assimilates, found in samples:
        fold = sample.fold
        columns = {**sample._asdict(), "scheme": fold.scheme, "fold": fold.name}
        own = {name: found.values.get(name, np.nan) for name in ONCE}
        own |= {"converged": found.state == "done", "message": found.message, "seconds": found.seconds}
        errors = found.values["errors_mm"]
        for marker, (u, v) in enumerate(errors):
            held = bool(fold.load_case) or marker in fold.held
            stated = (found.values["deviations_mm"] or [(np.nan, np.nan)] * len(errors))[marker]
            rows.append(
                {
                    **columns,
                    "marker": marker + 1,
                    "held_out": held,
                    "in_sample": assimilates and not held,
                    **dict(zip([*ERRORS, "deviation_u_mm", "deviation_v_mm"], [u, v, *stated], strict=True)),
                    **own,
                }
            )
    table = pd.DataFrame(rows)
    return table.astype(dict.fromkeys(ONCE, np.float64))


def mean_errors(errors: pd.DataFrame, by: list[str]) -> pd.DataFrame:
    """Mean absolute errors of the rows of each group, mm, by the paper's two definitions."""
    means = errors[ERRORS].abs().groupby([errors[name] for name in by], sort=False).mean()
    u, v = (means[name] for name in ERRORS)
    return pd.DataFrame(
        {"mae_u_mm": u, "mae_v_mm": v, "mae_sum_mm": u + v, "mae_rss_mm": np.hypot(u, v)}, index=means.index
    )


def fold_table(samples: pd.DataFrame) -> pd.DataFrame:
    """The numbers of each fold and seed that are of all its markers."""
    return samples.drop_duplicates([*SCORED, "seed", "fold"]).set_index([*SCORED, "seed", "fold"])[ONCE]


def score_table(samples: pd.DataFrame) -> pd.DataFrame:
    """Mean and Student's interval over seeds by truth, layout, solver, scheme and score.

    The ends are NaN for one seed. A score that some fold lacks is absent. Columns `from_fem` and so on are
    the differences from the `BASELINES`, negative where the solver is better, with intervals and verdicts.
    """
    by = [*SCORED, "seed"]
    ratios = samples[ERRORS].abs().to_numpy() / samples[["deviation_u_mm", "deviation_v_mm"]].to_numpy()
    within = samples[by].assign(within_stated=(ratios <= ndtri((1 + LEVEL) / 2)).mean(axis=1))
    stated = samples["held_out"] & np.isfinite(ratios).all(axis=1)
    grouped = fold_table(samples).groupby(by, sort=False)
    numbers = grouped.mean().where(grouped.count().eq(grouped.size(), axis=0))
    seeds = numbers.join(
        [mean_errors(samples[samples[kind]], by).add_prefix(f"{kind}_") for kind in ("held_out", "in_sample")]
        + [within[stated].groupby(by, sort=False).mean()]
    )
    every = (
        seeds.rename_axis(columns="score").stack(future_stack=True).groupby([*SCORED, "score"], sort=False)
    )
    table = every.agg(["mean", "std", "count"])[every.count() == every.size()]
    half = stdtrit(table["count"] - 1, (1 + LEVEL) / 2) * table["std"] / np.sqrt(table["count"])
    table = pd.DataFrame({"mean": table["mean"], "low": table["mean"] - half, "high": table["mean"] + half})
    return table.join(difference_table(samples))


def bootstrap(differences: FloatArray) -> tuple[float, float, float, str]:
    """Mean, both ends of the interval and verdict of a solver's scores minus a baseline's.

    Seeds and folds are resampled with replacement, independently of each other, since a fold is equally hard
    for every seed.

    Args:
        differences: One for each seed and fold, shape (s, f).

    Returns:
        The verdict is `better`, `worse` or `not told apart`.
    """
    seeds, folds = differences.shape
    draws = np.random.default_rng(0)
    rows = draws.integers(seeds, size=(2000, seeds, 1))
    columns = draws.integers(folds, size=(2000, 1, folds))
    means = differences[rows, columns].mean(axis=(1, 2))
    low, high = map(float, np.quantile(means, [(1 - LEVEL) / 2, (1 + LEVEL) / 2]))
    verdict = "better" if high < 0 else "worse" if low > 0 else "not told apart"
    return float(differences.mean()), low, high, verdict


def difference_table(samples: pd.DataFrame) -> pd.DataFrame:
    """Differences of the scores of `COMPARED` from the baselines', by the index of `score_table`."""
    held = mean_errors(samples[samples["held_out"]], [*SCORED, "seed", "fold"]).add_prefix("held_out_")
    values = fold_table(samples).join(held)[list(COMPARED)]
    values["force_error"] = values["force_error"].abs()
    rows: dict[tuple[str, ...], dict[str, object]] = {}
    for (truth, layout, scheme), part in values.groupby([*CASE, "scheme"], sort=False):
        for score in COMPARED:
            grids = {
                solver: each.to_numpy().reshape(each.index.unique("seed").size, -1)
                for solver, each in part[score].groupby("solver", sort=False)
            }
            grids = {solver: grid for solver, grid in grids.items() if np.isfinite(grid).all()}
            for solver, grid in grids.items():
                row = rows.setdefault((truth, layout, solver, scheme, score), {})
                for baseline in (name for name in BASELINES if name in grids and name != solver):
                    columns = [f"from_{baseline}{part}" for part in ("", "_low", "_high")]
                    found = bootstrap(grid - grids[baseline])
                    row |= zip([*columns, f"against_{baseline}"], found, strict=True)
    index = pd.MultiIndex.from_tuples(list(rows), names=[*SCORED, "score"])
    return pd.DataFrame(list(rows.values()), index=index)
