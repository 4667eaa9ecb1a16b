"""Held-out markers and loads, and scores and verdicts by hand."""

from pathlib import Path

import numpy as np
import pytest
from rich.console import Console
from scipy.stats import t

from pinnray.comparison.crossval.folds import (
    ALL,
    DRAWS,
    LOAD,
    ONE,
    RANDOM,
    TIP,
    Fold,
    FoldResult,
    folds_of,
    hide_markers,
    load_cases_of,
)
from pinnray.comparison.crossval.output_files import draw_fields, draw_held_out, draw_weight_sweeps
from pinnray.comparison.crossval.result import Case, CaseResult, CrossvalResult
from pinnray.comparison.crossval.scores import Difference, ScoreInterval, differences, of_scheme, score
from pinnray.comparison.crossval.study import CrossvalStudy, solver_variants
from pinnray.comparison.crossval.tables import truth_tables, verdict_sentences
from pinnray.comparison.evaluation.truths import EVERY_TRUTH, TRUTHS
from pinnray.geometry.finger.design import Design
from pinnray.runtime.tables import terminal_table
from pinnray.solvers.problem import Material, Problem
from pinnray.solvers.registry import make_solver
from tests.compare.figures.drawn_pages import page_of


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


def outcome_of(scheme: str, held: tuple[int, ...], errors: object, **more: object) -> FoldResult:
    return FoldResult(Fold(scheme, str(held), held), np.array(errors, dtype=float).tolist(), **more)


def test_scores_by_hand():
    seeds = [
        [
            outcome_of(ONE, (marker,), errors, deviations=spread, fields=off | {"von_mises": 0.2})
            for marker, errors, spread, off in (
                (0, [[a, -2.0], [0.1, 0.3]], [[2.0, 0.5], [1.0, 1.0]], {"displacement": a / 10}),
                (1, [[0.2, -0.1], [0.5, 4.0]], [[1.0, 1.0], [1.0, 1.0]], {"displacement": 0.3}),
            )
        ]
        for a in (1.0, 2.0)
    ]
    found = score(seeds)
    # Held out: u of 1 or 2 and 0.5, v of 2 and 4.
    low, high = 0.75 + 3.0, 1.25 + 3.0
    mean = (low + high) / 2
    half = t.ppf(0.975, 1) * np.std([low, high], ddof=1) / np.sqrt(2)
    interval = found.held_out["mae_sum"]
    assert (interval.mean, interval.low, interval.high) == pytest.approx((mean, mean - half, mean + half))
    assert found.held_out["mae_rss"].mean == pytest.approx((np.hypot(0.75, 3) + np.hypot(1.25, 3)) / 2)
    assert found.in_sample["mae_u"].mean == pytest.approx(0.15)
    assert found.in_sample["mae_v"].mean == pytest.approx(0.2)
    assert found.fields["displacement"].mean == pytest.approx((0.2 + 0.25) / 2)
    assert found.coverage == 0.5  # 1 / 2 and 2 / 2 and both 0.5 / 1 are within 1.96, 2 / 0.5 and 4 / 1 not
    assert found.per_marker == pytest.approx([3.5, 4.5])
    assert np.isnan(ScoreInterval.of([1.0]).low)


def test_a_difference_is_paired_by_fold():
    """Folds differ by more than solvers do, and yet the solvers are told apart."""
    hard = np.array([[1.0, 5.0, 9.0, 20.0]])
    better = Difference.bootstrap((hard - 0.1) - hard)
    assert (better.mean, better.verdict) == (pytest.approx(-0.1), "better")
    assert Difference.bootstrap(np.array([[0.1, 0.2], [0.3, 0.1]])).verdict == "worse"
    assert Difference.bootstrap(np.array([[1.0, -1.2, 0.9, -0.8]])).verdict == "not told apart"


def test_differences_are_of_the_same_folds():
    own = [[outcome_of(ONE, (0,), [[1.0, 0.0], [0.0, 0.0]])]]
    other = [[outcome_of(ONE, (0,), [[3.0, 1.0], [0.0, 0.0]])]]
    assert differences(own, other)["mae_sum"].mean == -3.0
    assert list(differences(own, other)) == ["mae_sum"]
    assert of_scheme(own, TIP) == [[]]


def test_a_force_that_is_too_small_is_as_wrong_as_one_that_is_too_large():
    """The nearer of two is better, whatever the sign."""
    low, high = (
        [[outcome_of(ALL, (), [[0.0, 0.0]], force=force)] for _ in range(2)] for force in (-0.5, 0.1)
    )
    assert differences(low, high)["force"].mean == pytest.approx(0.4)
    assert differences(low, high)["force"].verdict == "worse"


def test_verdicts_are_said_once_for_all_truths_that_share_them():
    def result(stress: float, force: float | None) -> CaseResult:
        found = {
            "von_mises": Difference(stress, stress - 0.1, stress + 0.1),
            **({} if force is None else {"force": Difference(force, force - 0.1, force + 0.1)}),
        }
        own = {"fem": {"gp": {ALL: found}}}
        return CaseResult("a test", 9, [], {"fem": {}, "gp": {}}, own, {})

    by_truth = {"stvk": result(-1, -1), "print": result(-1, 0), "base": result(-1, -1)}
    assert verdict_sentences(by_truth, ONE) == [
        "fem against gp: better with every truth in von Mises stress; not told apart with print, better with "
        "the others in force."
    ]
    by_truth["base"] = result(-1, None)
    assert verdict_sentences(by_truth, ONE)[0].endswith(
        "better with stvk, not told apart with print in force."
    )


def test_tables_of_many_truths_fit_a_terminal():
    full = score([[outcome_of(ALL, (), [[1.0, 1.0]], fields={"von_mises": 9.99}, force=-0.123)]])
    one = score([[outcome_of(ONE, (0,), [[0.1, 0.1]])]])
    study = CrossvalStudy(
        design=Design(),
        variants=solver_variants([make_solver("fem"), make_solver("fem-nonlinear")], Material()),
        out=Path(),
        truths=[EVERY_TRUTH],
    )
    cases = {
        Case(truth, layout): CaseResult(
            "a test",
            1,
            [Fold(ALL, "all", ()), Fold(ONE, "marker 1", (0,))],
            {label: {ALL: full, ONE: one} for label in ("fem", "fem-nonlinear evidence")},
            {"fem": {}, "fem-nonlinear evidence": {}},
            {},
        )
        for truth in TRUTHS
        for layout in ("front", "joints")
    }
    grids = list(truth_tables(CrossvalResult(study, cases)))
    assert [name for grid in grids for name in grid.headings[1:]] == [*TRUTHS, *TRUTHS]
    assert grids[0].rows[0][1] == "0.2 / 999 / −12"
    for grid in grids:
        table = terminal_table(grid.title, grid.headings, grid.rows, narrow=True)
        assert Console(width=200).measure(table).maximum <= 80
    assert "sliding: same law as fem-nonlinear, walls as drawn;" in grids[-1].caption
    assert "mixed: other law, walls and load than every solver" in grids[-1].caption


def test_pictures_show_every_solver():
    values = {f"solver {number}": [0.1 * number + 0.01, 1.0, 2.0] for number in range(9)}
    fields = {"displacement": 0.2, "strain": 0.3, "von_mises": 2.0}
    one = score([[outcome_of(ONE, (0,), [[1.0, 1.0]], fields=fields)]])
    scores = {label: {ALL: one, ONE: one} for label in values}
    columns = ("factor", "in_sample_mm", "left_out_mm", *fields)
    sweep = {name: [1e-6, 1e-3, 1.0] for name in columns}
    layouts = ["front", "joints"]
    page = page_of(draw_weight_sweeps(sweeps=dict.fromkeys(layouts, sweep)))
    assert (page.cut_off(), page.overlaps()) == ([], [])
    held_out = draw_held_out(errors=dict.fromkeys(layouts, values), label="simulated")
    for drawn in (held_out, draw_fields(scores=dict.fromkeys(layouts, scores), schemes=[ALL, ONE])):
        page = page_of(drawn)
        assert page.cut_off() == []
        assert all(label in page.text for label in values)
