"""Held-out markers and loads, and scores, verdicts and tables by hand."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console
from scipy.stats import t

from pinnray.geometry.finger.design import Design
from pinnray.runtime.tables import terminal_table
from pinnray.solvers.problem import Problem
from pinnray.studies.crossval.folds import (
    ALL,
    DRAWS,
    LOAD,
    ONE,
    RANDOM,
    TIP,
    Fold,
    folds_of,
    hide_markers,
    load_cases_of,
)
from pinnray.studies.crossval.result import CrossvalResult
from pinnray.studies.crossval.scores import Sample, bootstrap, difference_table, left_out_table, score_table
from pinnray.studies.crossval.study import CrossvalStudy
from pinnray.studies.crossval.tables import all_tables, truth_tables
from pinnray.studies.crossval.true_fields import SampledField, TrueField
from pinnray.studies.sweep.measurement import Measurement


def test_folds_hold_out_what_they_say(coarse_mesh):
    load_cases = load_cases_of(Problem(coarse_mesh), others=True)
    folds = folds_of([ONE, TIP, RANDOM, LOAD], 9, load_cases)
    held = {scheme: [fold.held for fold in folds if fold.scheme == scheme] for scheme in (ONE, TIP, RANDOM)}
    assert held[ONE] == [(marker,) for marker in range(9)]
    assert held[TIP] == [(6, 7, 8)]
    assert len(held[RANDOM]) == DRAWS
    assert {len(set(draw)) for draw in held[RANDOM]} == {3}
    assert len(set(held[RANDOM])) > 5
    assert [(c.load.displacement, c.load.position) for c in load_cases] == [
        ((0.0, -10.0), None),
        ((0.0, -5.0), None),
        ((0.0, -7.5), None),
        ((0.0, -10.0), 30.0),
        ((0.0, -10.0), 40.0),
    ]
    assert [fold.load_case for fold in folds if fold.scheme == LOAD] == [1, 2, 3, 4]


def test_nothing_is_left_of_what_is_held_out(observations):
    given = hide_markers(observations, (2, 5))
    assert np.flatnonzero(~given.visible).tolist() == [2, 5]
    for values in (given.displacements, given.standard_deviations):
        assert not values[[2, 5]].any()
        assert values[[0, 1, 3, 4, 6, 7, 8]].all()


def sample(
    solver: str,
    scheme: str,
    held: tuple[int, ...],
    errors: object,
    *,
    seed: int = 0,
    case: tuple[str, str] = ("sliding", "joints"),
    load_case: int = 0,
    takes: bool = True,
    **values: object,
) -> tuple[Sample, bool, Measurement]:
    own = {"errors_mm": np.array(errors, dtype=float).tolist(), "deviations_mm": None, **values}
    fold = Fold(scheme, str(held), held, load_case)
    return Sample(*case, solver, seed, fold), takes, Measurement("", "done", "", 0.0, own)


def test_scores_by_hand():
    samples = [
        sample("gp", ONE, (marker,), errors, seed=seed, deviations_mm=spread, displacement=off, von_mises=0.2)
        for seed, a in enumerate((1.0, 2.0))
        for marker, errors, spread, off in (
            (0, [[a, -2.0], [0.1, 0.3]], [[2.0, 0.5], [1.0, 1.0]], a / 10),
            (1, [[0.2, -0.1], [0.5, 4.0]], [[1.0, 1.0], [1.0, 1.0]], 0.3),
        )
    ]
    found = score_table(left_out_table(samples)).loc["sliding", "joints", "gp", ONE]
    # Held out: u of 1 or 2 and 0.5, v of 2 and 4.
    low, high = 0.75 + 3.0, 1.25 + 3.0
    mean = (low + high) / 2
    half = t.ppf(0.975, 1) * np.std([low, high], ddof=1) / np.sqrt(2)
    interval = found.loc["held_out_mae_sum_mm", ["mean", "low", "high"]].to_list()
    assert interval == pytest.approx([mean, mean - half, mean + half])
    means = found["mean"]
    assert means["held_out_mae_rss_mm"] == pytest.approx((np.hypot(0.75, 3) + np.hypot(1.25, 3)) / 2)
    assert means["in_sample_mae_u_mm"] == pytest.approx(0.15)
    assert means["in_sample_mae_v_mm"] == pytest.approx(0.2)
    assert means["displacement"] == pytest.approx((0.2 + 0.25) / 2)
    # 1 / 2 and 2 / 2 and both 0.5 / 1 are within 1.96, 2 / 0.5 and 4 / 1 not.
    assert means["within_stated"] == 0.5
    assert "strain" not in means.index
    one = score_table(left_out_table(samples[:2])).loc["sliding", "joints", "gp", ONE]
    assert one["low"].isna().all()


def test_markers_are_given_held_out_or_neither():
    """All are predicted at another load, and a solver that takes none has none in sample."""
    errors = np.ones((3, 2))
    for takes, load_case, held, given in ((True, 0, 1, 2), (True, 1, 3, 0), (False, 0, 1, 0)):
        table = left_out_table([sample("a", LOAD, (1,), errors, takes=takes, load_case=load_case)])
        assert (table["held_out"].sum(), table["in_sample"].sum()) == (held, given)


def test_a_number_that_one_fold_lacks_is_no_score():
    both = [sample("a", ONE, (0,), [[1.0, 1.0]], strain=0.1), sample("a", ONE, (1,), [[1.0, 1.0]] * 2)]
    assert ("sliding", "joints", "a", ONE, "strain") in score_table(left_out_table(both[:1])).index
    assert ("sliding", "joints", "a", ONE, "strain") not in score_table(left_out_table(both)).index


def test_a_difference_is_paired_by_fold():
    """Folds differ by more than solvers do, and yet the solvers are told apart."""
    hard = np.array([[1.0, 5.0, 9.0, 20.0]])
    mean, _, high, verdict = bootstrap((hard - 0.1) - hard)
    assert (mean, high < 0, verdict) == (pytest.approx(-0.1), True, "better")
    assert bootstrap(np.array([[0.1, 0.2], [0.3, 0.1]]))[3] == "worse"
    assert bootstrap(np.array([[1.0, -1.2, 0.9, -0.8]]))[3] == "not told apart"


def test_differences_are_of_the_same_folds():
    own = sample("own", ONE, (0,), [[1.0, 0.0], [0.0, 0.0]])
    other = sample("fem", ONE, (0,), [[3.0, 1.0], [0.0, 0.0]])
    found = difference_table(left_out_table([own, other])).xs("own", level="solver")
    assert found["from_fem"].to_list() == [-3.0]
    assert found.index.get_level_values("score").to_list() == ["held_out_mae_sum_mm"]


def test_a_force_that_is_too_small_is_as_wrong_as_one_that_is_too_large():
    """The nearer of two is better, whatever the sign."""
    samples = [
        sample(solver, ALL, (), [[0.0, 0.0]], seed=seed, force_error=force)
        for solver, force in (("low", -0.5), ("fem", 0.1))
        for seed in (0, 1)
    ]
    samples += [sample(solver, ONE, (0,), [[1.0, 1.0]]) for solver in ("low", "fem")]
    row = difference_table(left_out_table(samples)).loc["sliding", "joints", "low", ALL, "force_error"]
    assert (row["from_fem"], row["against_fem"]) == (pytest.approx(0.4), "worse")


FIELDS = {"displacement": 0.2, "strain": 0.3, "von_mises": 9.99, "von_mises_true_law": 2.0}


def result(
    solvers: list[str], cases: list[tuple[str, str]], first: dict[tuple[str, str], float] | None = None
) -> CrossvalResult:
    """The n-th solver is off by n tenths of a millimetre at two markers, but for the first in some cases."""
    times = first or {}
    samples = [
        sample(
            solver,
            scheme,
            held,
            [[0.1 * (times.get(case, 1.0) if number == 1 else number), 0.0]] * 2,
            case=case,
            force_error=force,
            **FIELDS,
        )
        for case in cases
        for number, solver in enumerate(solvers, start=1)
        for scheme, held, force in ((ALL, (), -0.123), (ONE, (0,), np.nan), (ONE, (1,), np.nan))
    ]
    study = CrossvalStudy(design=Design(), solvers=[], out=Path(), truths=[case[0] for case in cases])
    none = np.zeros((0, 2))
    true = TrueField(SampledField(none, none, np.zeros((0, 2, 2))), 1.0, 0.0, 35.0)
    truths = {truth: true for truth, _ in cases}
    return CrossvalResult(study, left_out_table(samples), dict.fromkeys(truths, "a test"), truths, {})


def test_tables_fit_a_terminal():
    many = result(["fem", "fem-nonlinear evidence"], [("sliding", "front"), ("print", "joints")])
    tables = all_tables(many)
    assert [table.headings[0] for table in tables] == ["solver"] * 3
    assert tables[0].rows[0][0] == "sliding, front"
    assert truth_tables(many)[-1].rows[1] == ["fem", "0.1", "999", "−12"]
    for table in tables:
        shown = terminal_table("", table.headings, table.rows, narrow=True)
        assert Console(width=200).measure(shown).maximum <= 80
    assert truth_tables(replace(many, truths={})) == []
