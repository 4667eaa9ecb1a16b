"""Cross-validation: what is held out is not seen, scores are what they say, what is finished is kept."""

import csv
import json
import re
import shlex
from collections.abc import Generator, Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console
from scipy.stats import t

from compare.crossval.charts import draw_fields, draw_held_out, draw_weight_sweeps
from compare.crossval.cross_validation import cross_validate
from compare.crossval.folds import (
    ALL,
    DRAWS,
    LOAD,
    ONE,
    RANDOM,
    TIP,
    Fold,
    FoldResult,
    LoadCase,
    folds_of,
    hide_markers,
    load_cases_of,
)
from compare.crossval.result import Case, CaseResult, CrossvalResult
from compare.crossval.scores import Difference, Interval, difference, of_scheme, score
from compare.crossval.solver_folds import SolverTask, run_folds, sweep_weights
from compare.crossval.study import EVERY_TRUTH, CrossvalStudy, SolverVariant, solver_variants
from compare.crossval.tables import truth_tables
from compare.crossval.true_fields import FieldSampler, TrueContact, TrueField
from compare.crossval.verdicts import verdict_sentences
from compare.evaluation.truths import TRUTHS
from compare.runtime.tables import terminal_table
from geometry.arrays import FloatArray
from geometry.errors import UserError
from geometry.finger.design import Design
from geometry.mesh.point_location import LocatedPoints
from geometry.mesh.quadrature import body_quadrature
from geometry.mesh.settings import MeshSettings
from geometry.mesh.triangle_mesh import TriangleMesh
from geometry.observations import Observations
from pinnray.cli import main
from solvers.assimilation.misfit import misfit_of
from solvers.fem.linear import FemSolver
from solvers.problem import Load, Material, Problem
from solvers.registry import BUILT_IN, make_solver
from solvers.solution import Estimated, IdentifiedForce, Solution, State, Status, Uncertainty
from solvers.solver import Progress, silent
from tests.compare.figures.drawn_pages import page_of
from tests.solvers.conftest import observed_at

NOISE = 0.005
SETTINGS: dict[str, dict[str, object]] = {"gp": {}}
"""Settings other than linear elements."""


@pytest.fixture(scope="module")
def truth(coarse_mesh: TriangleMesh) -> Solution:
    """Stands for a richer model: the same finger, pressed by something that sticks."""
    return FemSolver(degree=1).solve(Problem(coarse_mesh, load=Load(kind="patch", displacement=(-1.0, -9.0))))


@pytest.fixture(scope="module")
def observations(coarse_mesh: TriangleMesh, truth: Solution) -> Observations:
    points = coarse_mesh.markers
    return Observations(
        points,
        truth.displacement(points),
        np.full_like(points, NOISE),
        np.ones(9, dtype=bool),
        "a test",
        True,
        0.8,
    )


@pytest.fixture
def task(
    tmp_path: Path, coarse_mesh: TriangleMesh, truth: Solution, observations: Observations
) -> SolverTask:
    """`gp` and one fold of each kind, at the full load and half of it."""
    coarse_mesh.save(tmp_path / "mesh.npz")
    sampled = FieldSampler.of(coarse_mesh, coarse_mesh.markers, 0.8).of_solution(truth, coarse_mesh)
    paths = [tmp_path / f"truth-{share}.npz" for share in (1.0, 0.5)]
    for path, share in zip(paths, (1.0, 0.5), strict=True):
        u, v = (share * truth.reaction).tolist()
        TrueField(sampled * share, TrueContact((u, v), 35.0, 34.0, 2.0)).save(path)
    half = replace(observations, displacements=0.5 * observations.displacements)
    return SolverTask(
        study=CrossvalStudy(design=Design(), variants=[], out=tmp_path),
        layout="joints",
        variant=variant("gp"),
        load_cases=[
            LoadCase("full", Load(), 1.0, 35.0),
            LoadCase("half", Load(displacement=(0.0, -5.0)), 0.5, 35.0),
        ],
        truths=paths,
        observations=[[observations, half]],
        folds=[Fold(ALL, "all", ()), Fold(ONE, "marker 4", (3,)), Fold(LOAD, "half", (), 1)],
    )


def variant(name: str, **settings: object) -> SolverVariant:
    return SolverVariant(name, name, make_solver(name, **settings).settings())


def judged(task: SolverTask) -> list[FoldResult]:
    (outcomes,) = run_folds(task)
    return outcomes


# What is held out


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


@pytest.mark.parametrize("name", ["gp", "fem-asm", "fem-id", "statfem"])
def test_predictions_do_not_depend_on_what_is_held_out(task, observations, name):
    """A marker that is held out is moved by 5 mm: so is its error, and no prediction changes."""
    fold = Fold(ONE, "marker 4", (3,))
    settings = SETTINGS.get(name, {"degree": 1})
    if name == "fem-asm":
        settings = {**settings, "weights": "precision", "choose": "left-out"}
    own = replace(task, variant=variant(name, **settings), folds=[fold])
    moved = observations.displacements.copy()
    moved[3] += [5.0, -5.0]
    other = replace(observations, displacements=moved)
    before = judged(own)[0]
    relabelled = replace(own.variant, label="moved")  # so that the kept folds are not taken
    after = judged(replace(own, variant=relabelled, observations=[[other, other]]))[0]
    change = np.zeros((9, 2))
    change[3] = [-5.0, 5.0]
    np.testing.assert_allclose(np.array(after.errors) - before.errors, change, atol=1e-12)
    assert after.fields == before.fields


# What a fold is worth


@pytest.mark.parametrize("name", ["gp", "fem-asm", "statfem"])
def test_a_fold_is_the_solver_s_own_solution_without_what_is_held_out(
    task, coarse_mesh, observations, truth, name
):
    """By `solve`, with what the command shares between folds left aside; errors and distances by hand."""
    held = (1, 3)
    settings = SETTINGS.get(name, {"degree": 1})
    folds = [Fold(ALL, "all", ()), Fold(RANDOM, "draw 1", held)]  # the second one finds shared work
    _, outcome = judged(replace(task, variant=variant(name, **settings), folds=folds))
    visible = ~np.isin(np.arange(9), held)
    problem = Problem(coarse_mesh, observations=replace(observations, visible=visible))
    solution = make_solver(name, **settings).solve(problem)
    disc = misfit_of(Problem(coarse_mesh, observations=observations))
    points, means = disc.sampling()
    np.testing.assert_allclose(
        outcome.errors, means @ solution.displacement(points) - observations.displacements, atol=1e-7
    )
    rule = body_quadrature(coarse_mesh)
    mine, true = (each.displacement(rule.location) for each in (solution, truth))
    squares = [(rule.weights[:, None] * values**2).sum() for values in (mine - true, true)]
    assert outcome.fields["displacement"] == pytest.approx(np.sqrt(squares[0] / squares[1]), rel=1e-6)
    finite = replace(truth.problem, material=Material(law="neo-hookean"))
    true = State.from_gradient(truth.field.gradient(rule.location), finite).von_mises
    mine = solution.state(rule.location).von_mises
    squares = [(rule.weights * values**2).sum() for values in (mine - true, true)]
    assert outcome.fields["von_mises"] == pytest.approx(np.sqrt(squares[0] / squares[1]), rel=1e-6)
    if name in ("gp", "statfem"):
        spread = solution.field.standard_deviation(coarse_mesh.locate(observations.points))
        np.testing.assert_allclose(outcome.deviations, np.hypot(spread, NOISE), rtol=1e-5)
    else:
        assert outcome.deviations is None


@pytest.mark.parametrize("name", ["gp", "fem-asm", "statfem"])
def test_what_was_learnt_is_carried_to_half_the_load(task, name):
    """All of it is linear, and so is this truth: half the load has half the errors."""
    settings = SETTINGS.get(name, {"degree": 1})
    outcomes = judged(replace(task, variant=variant(name, **settings)))
    np.testing.assert_allclose(outcomes[2].errors, 0.5 * np.array(outcomes[0].errors), atol=1e-6)
    assert outcomes[2].held == list(range(9))
    assert len(outcomes[2].in_sample) == 0
    assert outcomes[2].fields["displacement"] == pytest.approx(outcomes[0].fields["displacement"], rel=1e-5)


def test_an_identified_finger_is_carried_to_half_the_load(task, coarse_mesh, observations):
    """By the solver's own `transferred`."""
    solver = make_solver("fem-id", degree=1)
    own = replace(task, variant=variant("fem-id", degree=1), folds=[Fold(LOAD, "half", (), 1)])
    (outcome,) = judged(own)
    problem = Problem(coarse_mesh, Material(law="neo-hookean"), observations=observations)
    half = replace(problem, load=task.load_cases[1].load)
    carried = solver.transferred(solver.solve(problem), problem, half)
    points, means = misfit_of(problem).sampling()
    errors = means @ carried.displacement_in_space(points) - 0.5 * observations.displacements
    np.testing.assert_allclose(outcome.errors, errors, atol=1e-6)


def test_a_solver_that_is_given_nothing_has_nothing_in_sample(task):
    outcomes = judged(replace(task, variant=variant("fem", degree=1, estimate=False)))
    assert [len(outcome.in_sample) for outcome in outcomes] == [0, 0, 0]
    assert [len(outcome.held_out) for outcome in outcomes] == [0, 1, 9]
    assert outcomes[0].errors == outcomes[1].errors


def deviation(location: LocatedPoints) -> FloatArray:
    """The von Mises stress is known exactly near the base, and not at all elsewhere."""
    return np.where(location.points[:, 0] < 30.0, 0.0, 1e9)


def test_force_place_and_stated_intervals_are_judged_by_the_truth(task, coarse_mesh, truth, monkeypatch):
    """The truth's own field with twice its force, a contact 1.5 mm off, and intervals by hand."""
    force = float(np.linalg.norm(truth.reaction))
    stating = replace(
        truth,
        reaction=2 * truth.reaction,
        identified=IdentifiedForce(Estimated(force, 0.9 * force, 1.1 * force), Estimated(36.5, 35.5, 37.5)),
        uncertainty=Uncertainty(lambda location: np.zeros_like(location.points), deviation),
    )
    monkeypatch.setattr("compare.crossval.solver_folds.refitter", lambda *_: lambda observations: stating)
    full, one, _ = judged(task)
    assert full.force == pytest.approx(1.0)
    assert full.position == pytest.approx(1.5)
    assert full.force_within is True
    assert full.position_within is False
    rule = body_quadrature(coarse_mesh)
    beyond = rule.location.points[:, 0] >= 30.0  # the linear stress is nowhere exactly the neo-Hookean one
    assert full.von_mises_coverage == pytest.approx(np.average(beyond, weights=rule.weights), abs=1e-12)
    assert (one.force, one.force_within, one.von_mises_coverage) == (None, None, None)
    found = score([[full]])
    assert found.force.mean == pytest.approx(1.0)
    assert (found.force_within, found.position_within) == (1.0, 0.0)


def test_a_force_that_is_too_small_is_as_wrong_as_one_that_is_too_large():
    """The nearer of two is better, whatever the sign."""
    low, high = (
        [[outcome_of(ALL, (), [[0.0, 0.0]], force=force)] for _ in range(2)] for force in (-0.5, 0.1)
    )
    assert difference(low, high, "force").mean == pytest.approx(0.4)
    assert difference(low, high, "force").verdict == "worse"


def test_the_stress_is_that_of_the_material_that_a_solver_has_found(task, truth, monkeypatch):
    softer = replace(truth.problem, material=Material(young=5.7))
    monkeypatch.setattr(
        "compare.crossval.solver_folds.refitter", lambda *_: lambda _: replace(truth, problem=softer)
    )
    halved = judged(task)[0].fields
    monkeypatch.setattr("compare.crossval.solver_folds.refitter", lambda *_: lambda _: truth)
    own = judged(replace(task, variant=replace(task.variant, label="own")))[0].fields
    assert halved["displacement"] == own["displacement"]
    assert halved["von_mises"] > own["von_mises"] + 0.1  # 0.69 and 0.48


def test_finished_folds_are_kept_and_those_of_other_settings_are_not(task, monkeypatch):
    first = judged(task)

    def again(*_: object) -> None:
        raise RuntimeError("solved again")

    monkeypatch.setattr("compare.crossval.solver_folds.refitter", again)
    assert [outcome.errors for outcome in judged(task)] == [outcome.errors for outcome in first]
    with pytest.raises(RuntimeError, match="solved again"):
        judged(replace(task, variant=variant("gp", clamp=True)))


def test_the_curve_of_weights_is_what_solving_again_with_them_gives(task, coarse_mesh, observations):
    own = replace(task, variant=variant("fem-asm", degree=1))
    curve = sweep_weights(own)
    number = 24
    assert curve["factor"][number] == pytest.approx(1e-3)
    (outcome,) = judged(
        replace(own, variant=variant("fem-asm", degree=1, asm_weight=1.0), folds=[Fold(ALL, "all", ())])
    )
    missed = np.sqrt((np.array(outcome.errors) ** 2).mean())
    assert curve["in_sample_mm"][number] == pytest.approx(missed, rel=1e-6)
    assert {name: curve[name][number] for name in outcome.fields} == pytest.approx(
        outcome.fields, nan_ok=True
    )


# Scores


def outcome_of(scheme: str, held: tuple[int, ...], errors: object, **more: object) -> FoldResult:
    return FoldResult(Fold(scheme, str(held), held), np.array(errors, dtype=float).tolist(), **more)


def test_scores_by_hand():
    seeds = [
        [
            outcome_of(
                ONE,
                (0,),
                [[a, -2.0], [0.1, 0.3]],
                deviations=[[2.0, 0.5], [1.0, 1.0]],
                fields={"displacement": a / 10, "von_mises": 0.2},
            ),
            outcome_of(
                ONE,
                (1,),
                [[0.2, -0.1], [0.5, 4.0]],
                deviations=[[1.0, 1.0], [1.0, 1.0]],
                fields={"displacement": 0.3, "von_mises": 0.2},
            ),
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
    assert np.isnan(Interval.of([1.0]).low)


def test_a_difference_is_paired_by_fold():
    """Folds differ by more than solvers do, and yet the solvers are told apart."""
    hard = np.array([[1.0, 5.0, 9.0, 20.0]])
    better = Difference.bootstrap((hard - 0.1) - hard)
    assert (better.mean, better.verdict) == (pytest.approx(-0.1), "better")
    assert Difference.bootstrap(np.array([[0.1, 0.2], [0.3, 0.1]])).verdict == "worse"
    assert Difference.bootstrap(np.array([[1.0, -1.2, 0.9, -0.8]])).verdict == "not told apart"


def test_the_bootstrap_is_about_as_wide_as_the_mean_is_uncertain():
    """Against the normal theory of a mean of 40 independent values."""
    values = np.random.default_rng(3).normal(size=(1, 40))
    found = Difference.bootstrap(values)
    expected = 2 * 1.96 * values.std(ddof=1) / np.sqrt(40)
    assert found.high - found.low == pytest.approx(expected, rel=0.1)


def test_differences_are_of_the_same_folds():
    own = [[outcome_of(ONE, (0,), [[1.0, 0.0], [0.0, 0.0]])]]
    other = [[outcome_of(ONE, (0,), [[3.0, 1.0], [0.0, 0.0]])]]
    assert difference(own, other, "mae_sum").mean == -3.0
    assert difference(own, other, "von_mises") is None
    assert of_scheme(own, TIP) == [[]]


# The command


@pytest.fixture
def in_line(monkeypatch: pytest.MonkeyPatch) -> None:
    """Tasks one after the other in this process."""

    def inline(pool: object, work: object, tasks: Mapping[str, object], **_: object) -> Generator:
        for name, each in tasks.items():
            yield name, work(each, silent)

    monkeypatch.setattr("geometry.processes.Pool.answers", inline)


def run(line: str, out: Path) -> int:
    return main([*shlex.split(f"crossval {line} --mesh-size 1"), "--out", str(out)])


@pytest.mark.slow
def test_the_command_writes_what_the_guide_says_and_goes_on(tmp_path, capsys, in_line, monkeypatch):
    line = "--solvers fem,gp,fem-asm --schemes tip-out --solver-set fem-asm.choose=given"
    assert run(f"{line} --seeds 1 --pictures pdf", tmp_path / "out") == 0
    assert {path.name for path in (tmp_path / "out").glob("*.pdf")} == {"fields.pdf", "l_curve.pdf"}
    said = " ".join(capsys.readouterr().out.split())
    assert (
        "tip-out: the third of the markers nearest the tip held out together; simulated markers, mm" in said
    )
    content = json.loads((tmp_path / "out" / "crossval.json").read_text())
    joints = content["truths"]["sliding"]["layouts"]["joints"]
    assert list(joints["solvers"]) == ["fem", "gp", "fem-asm"]
    assert joints["solvers"]["fem"]["schemes"]["tip-out"]["held_out"]["mae_sum"]["low"] is None
    before = joints["solvers"]["gp"]["schemes"]["tip-out"]["held_out"]["mae_sum"]["mean"]
    assert "simulated by fem-nonlinear" in joints["measurements"]["description"]
    predictions, stresses = content["answers"].values()
    assert any(re.match("fem-asm against gp: .* in tip-out", sentence) for sentence in predictions)
    assert any("von Mises stress" in sentence for sentence in stresses)

    assert run(f"{line} --seeds 2", tmp_path / "out") == 0
    assert not [*(tmp_path / "out").glob("*.pdf")]  # of the earlier study
    content = json.loads((tmp_path / "out" / "crossval.json").read_text())
    solvers = content["truths"]["sliding"]["layouts"]["joints"]["solvers"]
    against = solvers["fem-asm"]["against"]["fem"]["tip-out"]
    assert against["mae_sum"]["verdict"] == "better"
    assert against["von_mises"]["verdict"] == "worse"
    predictions, _ = content["answers"].values()
    verdicts = {
        f"{label} against {baseline}": schemes["tip-out"]["mae_sum"]["verdict"]
        for label in ("gp", "fem-asm")
        for baseline, schemes in solvers[label]["against"].items()
    }
    assert predictions == [f"{pair}: {verdict} in tip-out." for pair, verdict in verdicts.items()]
    assert "better" in verdicts.values()
    with (tmp_path / "out" / "held_out.csv").open() as file:
        rows = {(row["solver"], row["scheme"]): row for row in csv.DictReader(file)}
    mean = solvers["gp"]["schemes"]["tip-out"]["held_out"]["mae_sum"]["mean"]
    assert float(rows["gp", "tip-out"]["held_out_mae_sum_mm"]) == mean
    assert mean != before
    assert rows["fem", "all"]["in_sample_mae_sum_mm"] == ""

    assert run(f"{line} --seeds 1 --noise 0.02", tmp_path / "out") == 2
    assert "holds a cross-validation with other settings (noise_mm)" in capsys.readouterr().err


def test_layouts_sample_one_truth_and_stay_apart(tmp_path, capsys, in_line):
    """`fem` has one field, so its distance from the truth is the same; its errors at markers are not."""
    line = "--solvers fem,gp --schemes one-out --seeds 1"
    assert run(f"{line} --layouts front,joints", tmp_path / "out") == 0
    said = capsys.readouterr().out
    assert "markers: front" in said
    assert "markers: joints" in said
    with (tmp_path / "out" / "held_out.csv").open() as file:
        rows = {
            tuple(row[key] for key in ("layout", "solver", "scheme")): row for row in csv.DictReader(file)
        }
    assert list(rows)[::4] == [("front", "fem", "all"), ("joints", "fem", "all")]
    layouts = json.loads((tmp_path / "out" / "crossval.json").read_text())["truths"]["sliding"]["layouts"]
    errors, fields = (
        [float(layouts[name]["solvers"]["fem"]["schemes"][ONE][kind][what]["mean"]) for name in layouts]
        for kind, what in (("held_out", "mae_v"), ("fields", "displacement"))
    )
    assert fields[0] == pytest.approx(fields[1], rel=1e-9)
    assert errors == pytest.approx(
        [0.43, 0.53], abs=0.02
    )  # where the front wall alone is seen, and all of it
    report = (tmp_path / "out" / "report.html").read_text()
    assert "Do these verdicts depend on the layout of the markers?" in report

    # One layout alone reuses its folds, and has what it had beside the other.
    runs = tmp_path / "out" / "runs" / "sliding"
    kept = (runs / "front" / "gp" / "seed-0.json").stat().st_mtime_ns
    assert run(f"{line} --layouts front", tmp_path / "out") == 0
    assert (runs / "front" / "gp" / "seed-0.json").stat().st_mtime_ns == kept
    alone = json.loads((tmp_path / "out" / "crossval.json").read_text())["truths"]["sliding"]["layouts"]
    assert alone == {"front": layouts["front"]}


def test_solvers_are_judged_by_several_truths(tmp_path, capsys, in_line):
    """`fem` has one field: the same error in all truths would mean that there is one."""
    line = "--truth cylinder,base --solvers fem,gp --schemes one-out --seeds 1"
    assert run(line, tmp_path / "out") == 0
    said = capsys.readouterr().out
    assert all(len(each) <= 80 for each in said.splitlines() if not each.startswith(str(tmp_path)))
    words = " ".join(said.split())
    assert "solver cylinder base" in words
    assert "fem against gp: worse with every truth in held-out error; better with every truth in" in words
    assert "base: other law, walls and load than every solver" in words
    with (tmp_path / "out" / "truths.csv").open() as file:
        rows = {(row["truth"], row["solver"]): row for row in csv.DictReader(file)}
    assert list(rows) == [(truth, name) for truth in ("cylinder", "base") for name in ("fem", "gp")]
    assert rows["cylinder", "fem"]["mae_sum_against_gp"] == "worse"
    content = json.loads((tmp_path / "out" / "crossval.json").read_text())
    assert content["schema"] == 3
    for truth, name in rows:
        each = content["truths"][truth]["layouts"]["joints"]
        contact = content["truths"][truth]["contact"]
        assert float(rows[truth, name]["true_force_N_mm"]) == contact["true_force_N_mm"]
        schemes = each["solvers"][name]["schemes"]
        mean = schemes[ONE]["held_out"]["mae_sum"]["mean"]
        assert float(rows[truth, name]["held_out_mae_sum_mm"]) == mean
        assert float(rows[truth, name]["force_error"]) == schemes[ALL]["force"]["mean"]
        assert ("cylinder" in each["measurements"]["description"]) == (truth == "cylinder")
    forces = [float(rows[truth, "fem"]["force_error"]) for truth in ("cylinder", "base")]
    assert abs(forces[0] - forces[1]) > 0.05
    pictures = sorted(path.name for path in (tmp_path / "out").glob("*.png"))
    assert pictures == [
        "fields-base.png",
        "fields-cylinder.png",
        "held_out-base.png",
        "held_out-cylinder.png",
    ]
    report = (tmp_path / "out" / "report.html").read_text()
    assert "Truth: cylinder" in report
    assert "With which truths is a solver better" in report

    assert run(line.replace("cylinder,base", "base"), tmp_path / "out") == 0
    alone = json.loads((tmp_path / "out" / "crossval.json").read_text())["truths"]
    assert alone == {"base": content["truths"]["base"]}
    assert sorted(path.name for path in (tmp_path / "out").glob("*.png")) == ["fields.png", "held_out.png"]


@pytest.mark.slow
def test_force_and_place_that_a_solver_identifies_are_near_those_of_the_truth(tmp_path, in_line):
    """At finite strain `fem-id` finds both from the markers, and says how well."""
    assert run("--truth cylinder --solvers fem-id --schemes tip-out --seeds 1", tmp_path / "out") == 0
    with (tmp_path / "out" / "truths.csv").open() as file:
        (row,) = csv.DictReader(file)
    assert abs(float(row["force_error"])) < 0.05
    assert abs(float(row["position_error_mm"])) < 0.5
    assert float(row["von_mises_within_stated"]) > 0.5  # on a mesh whose own error is 4 % of the stress
    assert {row["force_within_stated"], row["position_within_stated"]} <= {"0.0", "1.0"}


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
        variants=[variant("fem"), variant("fem-nonlinear")],
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


def test_measured_markers_have_no_truth(tmp_path, capsys, in_line, observations):
    from vision.measurements import write_measurements

    seen = np.arange(9) != 4
    measured = replace(observations, simulated=False, visible=seen)
    write_measurements(tmp_path / "markers.csv", measured)
    line = f"--measurements {tmp_path / 'markers.csv'} --solvers fem,gp --schemes one-out,load-out --seeds 1"
    assert run(line, tmp_path / "out") == 0
    printed = capsys.readouterr()
    assert "load-out needs a truth at other loads, and is skipped" in printed.err
    assert str(tmp_path / "out" / "held_out.csv") in printed.out
    assert "fields.csv" not in printed.out
    content = json.loads((tmp_path / "out" / "crossval.json").read_text())
    assert list(content["schemes"]) == ["all", "one-out"]
    (gp,) = (
        layout["solvers"]["gp"]["schemes"]["one-out"]
        for layout in content["truths"]["measured"]["layouts"].values()
    )
    assert len(gp["per_marker"]) == 8
    assert gp["fields"] == {}
    assert not (tmp_path / "out" / "fields.csv").exists()
    assert not (tmp_path / "out" / "fields.png").exists()


class Stopped(FemSolver):
    """`fem`, which says that it was not finished."""

    name = "stopped"

    def solve(self, problem: Problem, progress: Progress = silent) -> Solution:
        return replace(super().solve(problem), status=Status(False, "stopped early; take more epochs"))


def test_what_speaks_against_a_result_is_said_everywhere(tmp_path, capsys, monkeypatch, in_line, truth):
    """A body that goes through itself, a solver that did not converge, and a modulus in pascals."""
    from vision.measurements import write_measurements

    monkeypatch.setitem(BUILT_IN, "stopped", f"{__name__}:Stopped")
    points = truth.problem.mesh.markers
    measured = observed_at(points, 6 * truth.displacement(points), NOISE)
    write_measurements(tmp_path / "markers.csv", replace(measured, simulated=False))
    line = f"--measurements {tmp_path / 'markers.csv'} --solvers fem,stopped --schemes tip-out --seeds 1"
    assert run(f"{line} --stroke 60 --young 1e6", tmp_path / "out") == 3
    printed = " ".join(capsys.readouterr().err.split())
    assert "Young's modulus of 1e+06 MPa is no rubber's or plastic's; this looks like pascals" in printed
    page = (tmp_path / "out" / "report.html").read_text()
    through = "2 of 2 folds and seeds, the first of them: {}: THE BODY GOES THROUGH ITSELF; self-contact is"
    for said in (
        f"fem, {through.format('fem')}",
        f"stopped, {through.format('stopped')}",
        "did not converge: stopped early; take more epochs",
    ):
        assert said in printed
        assert said in page
    content = json.loads((tmp_path / "out" / "crossval.json").read_text())
    assert len(content["truths"]["measured"]["layouts"]["measured"]["remarks"]) == 2


def test_an_error_that_is_no_number_is_in_no_mean(task, monkeypatch):
    """A displacement that is not finite at the markers alone, where no mesh node is."""
    monkeypatch.setattr(
        "compare.crossval.solver_folds.FieldSampler.of_solution",
        lambda *_: replace(TrueField.load(task.truths[0]).sampled, markers=np.full((9, 2), np.nan)),
    )
    assert run_folds(replace(task, variant=variant("fem"))) == (
        "fem: its displacement is not finite at every marker"
    )


def test_simulated_markers_of_a_file_are_called_simulated_everywhere(
    tmp_path, capsys, monkeypatch, in_line, observations
):
    from vision.measurements import write_measurements

    headings = []
    monkeypatch.setattr("compare.crossval.charts.write_heading", lambda _, *texts: headings.extend(texts))
    write_measurements(tmp_path / "markers.csv", replace(observations, simulated=True, source="made up"))
    line = f"--measurements {tmp_path / 'markers.csv'} --solvers fem,gp --schemes one-out --seeds 1"
    assert run(line, tmp_path / "out") == 0
    printed = capsys.readouterr()
    assert "simulated markers, mm" in " ".join(printed.out.split())
    assert "against simulated displacements" in " ".join(headings)
    assert "displacements are simulated: made up." in (tmp_path / "out" / "report.html").read_text()
    written = [path for path in (tmp_path / "out").rglob("*") if path.suffix in (".json", ".csv", ".html")]
    assert len(written) > 5
    for path in written:
        assert "measured" not in str(path.relative_to(tmp_path)), path
        assert not re.search(r"\bmeasured\b", path.read_text()), path
    for name in ("held_out.csv", "folds.csv"):
        assert all(
            line.startswith("simulated,simulated,")
            for line in (tmp_path / "out" / name).read_text().splitlines()[1:]
        ), name
    assert "measured" not in printed.out + printed.err


@pytest.mark.filterwarnings("default:cannot write to the cache folder")
def test_a_cache_that_cannot_be_written_is_a_warning_and_the_study_keeps_its_truths(
    tmp_path, capsys, monkeypatch, in_line
):
    (tmp_path / "cache").touch()  # a file, not a folder
    monkeypatch.setenv("PINNRAY_CACHE", str(tmp_path / "cache"))
    line = "--solvers gp --schemes one-out --seeds 1"
    assert run(line, tmp_path / "out") == 0
    assert re.search(
        r"warning: cannot write to the cache folder .*cache \(File exists\), so that the virtual experiment",
        capsys.readouterr().err,
    )
    (kept,) = (tmp_path / "out" / "truths").iterdir()
    before = kept.stat().st_mtime_ns
    assert run(line, tmp_path / "out") == 0
    assert kept.stat().st_mtime_ns == before
    assert "virtual experiment" not in capsys.readouterr().err


def test_a_study_runs_from_python_and_prints_nothing(tmp_path, capsys, in_line, observations):
    study = CrossvalStudy(
        design=Design(),
        variants=solver_variants([make_solver("gp")], Material()),
        out=tmp_path / "out",
        mesh=MeshSettings(size=1.0),
        schemes=[ONE],
        seeds=1,
        measurements=replace(observations, simulated=False),
    )
    result = cross_validate(study)
    assert capsys.readouterr() == ("", "")
    row = result.table().loc["measured", "measured", "gp", ONE]
    assert (
        row["held_out_mae_sum_mm"]
        == result.cases["measured", "measured"].scores["gp"][ONE].held_out["mae_sum"].mean
    )
    assert np.isnan(row["from_fem_mean_mm"])  # fem is not in the study
    with pytest.raises(UserError, match="there is no scheme 'two-out'"):
        cross_validate(replace(study, schemes=["two-out"]))
    with pytest.raises(UserError, match="a truth is for a simulated experiment"):
        cross_validate(replace(study, truths=["stvk"]))
    pulled = replace(study, measurements=None, truths=["mixed"], load=Load(displacement=(1.0, 0.0)))
    with pytest.raises(UserError, match="truth mixed: a cylinder presses on the finger: prescribe a v"):
        cross_validate(pulled)


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("--seeds 0", "seeds 0: give a whole number from 1"),
        ("--noise -1", "noise -1: give a standard deviation of zero or more"),
        ("--schemes tip", "there is no scheme 'tip'; there are one-out, tip-out, random, load-out"),
        ("--load patch --solvers fem,gp", "load-out presses elsewhere on the same mesh"),
        ("--solvers fem,fem", "a solver is named twice: fem, fem"),
        ("--measurements nowhere.csv", "there is no file nowhere.csv"),
        ("--layouts front,back", "marker_layout = 'back': input should be 'front' or 'joints'"),
        ("--truth tip", "there is no truth 'tip'; there are all, sliding, stvk, gent, print, base, cylinder"),
        ("--truth base,base", "truth: name at least one of sliding, stvk, gent, print, base, cylinder"),
        ("--layouts front,front", "layouts: a layout is named twice: front, front"),
        ("--layouts joints --set rib_count=0 --set name=plain", "needs 3 markers, not the 1 of the layout"),
    ],
)
def test_bad_input_is_one_line(tmp_path, capsys, line, said):
    assert run(line, tmp_path / "out") == 2
    (error,) = [text for text in capsys.readouterr().err.splitlines() if text.startswith("error")]
    assert said in error
    assert not (tmp_path / "out").exists()


def test_a_solver_that_chooses_its_weights_is_there_in_three_ways():
    from pinnray.commands.comparison.crossval import read_variants
    from pinnray.options.shared import SolverOptions

    variants = read_variants(SolverOptions(), "fem,fem-asm", Material())
    assert [variant.label for variant in variants] == [
        "fem",
        "fem-asm",
        "fem-asm left-out",
        "fem-asm evidence",
    ]
    assert [variant.settings.get("choose") for variant in variants] == [None, "given", "left-out", "evidence"]
    fixed = SolverOptions(solver_set=("fem-asm.choose=left-out",))
    assert [variant.label for variant in read_variants(fixed, "fem-asm", Material())] == ["fem-asm"]
    stiff = Material(law="neo-hookean")  # for which there is nothing to choose
    assert [variant.label for variant in read_variants(SolverOptions(), "fem-asm", stiff)] == ["fem-asm"]


def test_pictures_show_every_solver():
    values = {f"solver {number}": [0.1 * number + 0.01, 1.0, 2.0] for number in range(9)}
    fields = {"displacement": 0.2, "strain": 0.3, "von_mises": 2.0}
    one = score([[outcome_of(ONE, (0,), [[1.0, 1.0]], fields=fields)]])
    scores = {label: {ALL: one, ONE: one} for label in values}
    columns = ("factor", "in_sample_mm", "left_out_mm", *fields)
    sweep = {name: [1e-6, 1e-3, 1.0] for name in columns}
    for layouts in (["joints"], ["front", "joints"]):
        held_out = draw_held_out(errors=dict.fromkeys(layouts, values), label="simulated")
        distances = draw_fields(scores=dict.fromkeys(layouts, scores), schemes=[ALL, ONE])
        page = page_of(draw_weight_sweeps(sweeps=dict.fromkeys(layouts, sweep)))
        assert (page.cut_off(), page.overlaps()) == ([], [])
        for drawn in (held_out, distances):
            page = page_of(drawn)
            assert page.cut_off() == []
            assert all(label in page.text for label in values)
