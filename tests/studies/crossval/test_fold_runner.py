"""A solver in folds: it does not see what is held out."""

from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np
import pytest

from pinnray.geometry.finger.design import Design
from pinnray.geometry.mesh.point_location import LocatedPoints
from pinnray.geometry.mesh.quadrature import body_quadrature
from pinnray.geometry.picture_frame import Homography, Pictures
from pinnray.runtime.arrays import FloatArray
from pinnray.runtime.errors import UserError
from pinnray.solvers.assimilation.misfit import MarkerSettings
from pinnray.solvers.fem.linear import FemSolver
from pinnray.solvers.problem import Load, Material, Problem
from pinnray.solvers.registry import make_solver
from pinnray.solvers.solution import Estimated, IdentifiedForce, Solution, State, Uncertainty
from pinnray.solvers.solver import FieldSettings, Progress, silent
from pinnray.studies.crossval.fold_runner import SolverTask, run_folds
from pinnray.studies.crossval.folds import ALL, LOAD, ONE, RANDOM, Fold, LoadCase
from pinnray.studies.crossval.scores import FIELDS
from pinnray.studies.crossval.study import of_draw
from pinnray.studies.crossval.true_fields import FieldSampler, SampledField, TrueField
from pinnray.studies.sweep.measurement import Measurement
from tests.studies.crossval.conftest import NOISE

QUICK = {"degree": 1, "law": "given", "parameters": "normal_force,position"}
SETTINGS: dict[str, dict[str, object]] = {"gp": {}, "fem-id": QUICK}
"""Settings other than linear elements."""


@pytest.fixture
def task(coarse_mesh, truth, observations) -> SolverTask:
    """`gp` and one fold of each kind, at the full load and half of it."""
    sampled = FieldSampler.of(coarse_mesh, coarse_mesh.markers, 0.8).of_solution(truth, coarse_mesh)
    force = float(-truth.reaction[1])
    truths = [
        TrueField(SampledField(*(share * each for each in sampled)), share * force, 0.0, 35.0)
        for share in (1.0, 0.5)
    ]
    half = replace(observations, displacements=0.5 * observations.displacements)
    return SolverTask(
        name="gp, sliding, joints",
        problem=Problem(coarse_mesh, finger=Design()),
        solver=make_solver("gp"),
        load_cases=[
            LoadCase("full", Load(), 1.0, 35.0),
            LoadCase("half", Load(displacement=(0.0, -5.0)), 0.5, 35.0),
        ],
        truths=truths,
        observations=[[observations, half]],
        folds=folds(Fold(ALL, "all", ()), Fold(ONE, "marker 4", (3,)), Fold(LOAD, "half", (), 1)),
    )


def folds(*wanted: Fold) -> dict[int, dict[str, Fold]]:
    """Folds of one seed."""
    return {0: {fold.name: fold for fold in wanted}}


def judged(task: SolverTask) -> list[dict[str, Any]]:
    """The values of the samples in the order of the folds."""
    found: list[Measurement] = []
    assert run_folds(task, found.append) == []
    assert [each.number for each in found] == [name for each in task.folds.values() for name in each]
    return [each.values for each in found]


class Doubled(FemSolver):
    """Stands for a user's class with the name of another solver: `fem`, and all displacements twice."""

    factor: ClassVar = 2.0

    def solve(self, problem: Problem, progress: Progress = silent) -> Solution:
        found = super().solve(problem)
        return replace(found, field=replace(found.field, values=self.factor * found.field.values))  # type: ignore[attr-defined]


class Tripled(Doubled):
    """All displacements three times."""

    factor = 3.0


def test_a_solver_of_ones_own_is_judged_whatever_its_name(task, observations):
    task = replace(task, folds=folds(Fold(ONE, "marker 4", (3,))))
    given = observations.displacements
    plain, twice, thrice = (
        np.array(judged(replace(task, solver=kind(degree=1)))[0]["errors_mm"]) + given
        for kind in (FemSolver, Doubled, Tripled)  # in one folder: no fold of another class is taken over
    )
    np.testing.assert_allclose(twice, 2 * plain, rtol=1e-12)
    np.testing.assert_allclose(thrice, 3 * plain, rtol=1e-12)


class Drawing:
    """A class that is no dataclass, whose seed is a setting."""

    name, laws, loads = "drawing", ("linear",), ("mean",)

    def __init__(self, seed=3, size=1.0):
        self.given = seed, size

    def settings(self):
        return dict(zip(("seed", "size"), self.given, strict=True))


@dataclass(frozen=True)
class DrawingData(FieldSettings):
    """The same as a dataclass."""

    name, laws, loads = "drawing", ("linear",), ("mean",)
    seed: int = 3
    size: float = 1.0

    @property
    def given(self):
        return self.seed, self.size


@pytest.mark.parametrize("kind", [Drawing, DrawingData])
def test_a_solver_of_a_draw_keeps_class_and_settings_and_changes_the_seed(kind):
    solver = kind(size=2.0)
    made = [of_draw(solver, seed) for seed in (0, 2)]
    assert [type(each) for each in made] == [kind, kind]
    assert [each.given for each in made] == [(3, 2.0), (5, 2.0)]  # type: ignore[attr-defined]
    assert solver.settings() == {"seed": 3, "size": 2.0}


def test_a_class_that_cannot_be_made_from_its_settings_is_refused_in_one_line():
    class Fixed(Drawing):
        def __init__(self):
            super().__init__()

    with pytest.raises(UserError, match=r"solver drawing cannot be made with seed 4: .*unexpected"):
        of_draw(Fixed(), 1)


@pytest.mark.parametrize("name", ["gp", "fem-asm", pytest.param("fem-id", marks=pytest.mark.slow)])
def test_predictions_do_not_depend_on_what_is_held_out(task, observations, name):
    """A marker that is held out is moved by 5 mm: so is its error, and no prediction changes."""
    fold = Fold(ONE, "marker 4", (3,))
    settings = SETTINGS.get(name, {"degree": 1})
    if name == "fem-asm":
        settings = {**settings, "weights": "precision", "choose": "left-out"}
    own = replace(task, solver=make_solver(name, **settings), folds=folds(fold))
    moved = observations.displacements.copy()
    moved[3] += [5.0, -5.0]
    other = replace(observations, displacements=moved)
    before = judged(own)[0]
    after = judged(replace(own, observations=[[other, other]]))[0]
    change = np.zeros((9, 2))
    change[3] = [-5.0, 5.0]
    np.testing.assert_allclose(np.array(after["errors_mm"]) - before["errors_mm"], change, atol=1e-12)
    assert all(after[name] == before[name] for name in FIELDS)


@pytest.mark.parametrize("name", ["gp", "fem-asm"])
def test_a_fold_is_the_solver_s_own_solution_without_what_is_held_out(
    task, coarse_mesh, observations, truth, name
):
    """By `solve`, with what the command shares between folds left aside; errors and distances by hand."""
    held = (1, 3)
    settings = SETTINGS.get(name, {"degree": 1})
    both = folds(Fold(ALL, "all", ()), Fold(RANDOM, "draw 1", held))  # the second one finds shared work
    _, outcome = judged(replace(task, solver=make_solver(name, **settings), folds=both))
    visible = ~np.isin(np.arange(9), held)
    problem = Problem(coarse_mesh, observations=replace(observations, visible=visible))
    solution = make_solver(name, **settings).solve(problem)
    disc = MarkerSettings().misfit(Problem(coarse_mesh, observations=observations))
    points, means = disc.sampling()
    np.testing.assert_allclose(
        outcome["errors_mm"], means @ solution.displacement(points) - observations.displacements, atol=1e-7
    )
    rule = body_quadrature(coarse_mesh)
    mine, true = (each.displacement(rule.location) for each in (solution, truth))
    squares = [(rule.weights[:, None] * values**2).sum() for values in (mine - true, true)]
    assert outcome["displacement"] == pytest.approx(np.sqrt(squares[0] / squares[1]), rel=1e-6)
    finite = replace(truth.problem, material=Material(law="neo-hookean"))
    true = State.from_gradient(truth.field.gradient(rule.location), finite).von_mises
    mine = solution.state(rule.location).von_mises
    squares = [(rule.weights * values**2).sum() for values in (mine - true, true)]
    assert outcome["von_mises"] == pytest.approx(np.sqrt(squares[0] / squares[1]), rel=1e-6)
    if name == "gp":
        spread = solution.field.standard_deviation(coarse_mesh.locate(observations.points))  # type: ignore[attr-defined]
        np.testing.assert_allclose(outcome["deviations_mm"], np.hypot(spread, NOISE), rtol=1e-5)
    else:
        assert outcome["deviations_mm"] is None


@pytest.mark.parametrize("name", ["gp", "fem-asm"])
def test_what_was_learnt_is_carried_to_half_the_load(task, name):
    """All of it is linear, and so is this truth: half the load has half the errors."""
    settings = SETTINGS.get(name, {"degree": 1})
    outcomes = judged(replace(task, solver=make_solver(name, **settings)))
    np.testing.assert_allclose(outcomes[2]["errors_mm"], 0.5 * np.array(outcomes[0]["errors_mm"]), atol=1e-6)
    assert outcomes[2]["displacement"] == pytest.approx(outcomes[0]["displacement"], rel=1e-5)


@pytest.mark.slow
def test_an_identified_finger_is_carried_to_half_the_load(task, coarse_mesh, observations):
    """By the solver's own `transferred`."""
    solver = make_solver("fem-id", **SETTINGS["fem-id"])
    own = replace(task, solver=solver, folds=folds(Fold(LOAD, "half", (), 1)))
    (outcome,) = judged(own)
    problem = Problem(coarse_mesh, Material(law="neo-hookean"), observations=observations)
    half = replace(problem, load=task.load_cases[1].load)
    carried = solver.transferred(solver.refitter(problem)(observations), problem, half)  # type: ignore[attr-defined]
    points, means = MarkerSettings().misfit(problem).sampling()
    errors = means @ carried.displacement_in_space(points) - 0.5 * observations.displacements
    np.testing.assert_allclose(outcome["errors_mm"], errors, atol=1e-6)


def deviation(location: LocatedPoints) -> FloatArray:
    """The von Mises stress is known exactly near the base, and not at all elsewhere."""
    return np.where(location.points[:, 0] < 30.0, 0.0, 1e9)


def test_force_place_and_stated_intervals_are_judged_by_the_truth(task, coarse_mesh, truth, monkeypatch):
    """The truth's own field with twice its force, a contact 1.5 mm off, and intervals by hand."""
    force = float(-truth.reaction[1])
    found = Estimated(2 * force, 0.9 * force, 2.1 * force)
    stating = replace(
        truth,
        identified=IdentifiedForce(found, Estimated(9.0, 9.0, 9.0), Estimated(36.5, 35.5, 37.5)),
        uncertainty=Uncertainty(lambda location: np.zeros_like(location.points), deviation),
    )
    monkeypatch.setattr(
        "pinnray.studies.crossval.fold_runner.refitter", lambda *_: lambda observations: stating
    )
    full, one, _ = judged(task)
    assert full["force_error"] == pytest.approx(1.0)
    assert full["position_error_mm"] == pytest.approx(1.5)
    assert full["force_half_width"] == pytest.approx(0.6)
    assert full["force_within_stated"] is True
    assert full["tangential_within_stated"] is False
    assert full["position_within_stated"] is False
    rule = body_quadrature(coarse_mesh)
    beyond = rule.location.points[:, 0] >= 30.0  # the linear stress is nowhere exactly the neo-Hookean one
    assert full["von_mises_within_stated"] == pytest.approx(
        np.average(beyond, weights=rule.weights), abs=1e-12
    )
    assert not {"force_error", "force_within_stated", "von_mises_within_stated"} & one.keys()


def test_errors_are_those_in_the_picture_whose_frame_was_found(task, truth, observations, monkeypatch):
    """The picture at half the load is another one."""
    centre = observations.points.mean(axis=0)
    turned = Homography(centre, np.array([3.0, 0.3, -0.2, 0.01, 0.0, 0.0]))
    pictures = Pictures(turned, Homography(centre, np.zeros(6)))
    results = []
    for each in (truth, replace(truth, pictures=pictures)):
        monkeypatch.setattr(
            "pinnray.studies.crossval.fold_runner.refitter", lambda *_, each=each: lambda _: each
        )
        results.append(judged(task))
    for at_full_load, fixed, found in zip((True, True, False), *results, strict=True):
        moved = observations.displacements if at_full_load else 0.0
        field = np.array(fixed["errors_mm"]) + moved
        shown = pictures.shown(observations.points, field) if at_full_load else field
        np.testing.assert_allclose(found["errors_mm"], shown - moved, atol=1e-12)
        assert all(fixed[name] == found[name] for name in FIELDS)


def test_the_stress_is_that_of_the_material_that_a_solver_has_found(task, truth, monkeypatch):
    softer = replace(truth.problem, material=Material(young=5.7))
    monkeypatch.setattr(
        "pinnray.studies.crossval.fold_runner.refitter", lambda *_: lambda _: replace(truth, problem=softer)
    )
    halved = judged(task)[0]
    monkeypatch.setattr("pinnray.studies.crossval.fold_runner.refitter", lambda *_: lambda _: truth)
    own = judged(task)[0]
    assert halved["displacement"] == own["displacement"]
    assert halved["von_mises"] > own["von_mises"] + 0.1  # 0.69 and 0.48


def test_an_error_that_is_no_number_is_in_no_mean(task, monkeypatch):
    """A displacement that is not finite at the markers alone, where no mesh node is."""
    monkeypatch.setattr(
        "pinnray.studies.crossval.fold_runner.FieldSampler.of_solution",
        lambda *_: task.truths[0].sampled._replace(markers=np.full((9, 2), np.nan)),
    )
    (failed,) = run_folds(replace(task, solver=make_solver("fem")), lambda *_: None)
    said = "fem: its displacement is not finite at every marker"
    assert (failed.number, failed.state, failed.message) == (task.name, "failed", said)
