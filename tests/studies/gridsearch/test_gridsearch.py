"""The grid search: what a run is worth, what is kept, what is refused, and the order of the result."""

import json
import shlex
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pinnray.cli import main
from pinnray.commands.studies.gridsearch import read_settings
from pinnray.geometry.finger.design import Design
from pinnray.geometry.mesh.settings import MeshSettings
from pinnray.options.shared import SolverOptions
from pinnray.runtime.errors import UserError
from pinnray.runtime.exits import NOT_CONVERGED
from pinnray.solvers.fem.linear import FemSolver
from pinnray.solvers.lagrange import LagrangeField
from pinnray.solvers.problem import Load, Problem
from pinnray.solvers.solution import Solution
from pinnray.solvers.solver import TrainingDiverged
from pinnray.studies.gridsearch.search import grid_study, search_grid
from pinnray.studies.gridsearch.training_run import DIVERGED, FAILED, TRAINED, GridPoint, TrainingRun, best_of
from pinnray.studies.sweep.job import StudyJob, Task
from pinnray.studies.sweep.measurement import Measurement, measured
from pinnray.studies.sweep.quantities import TRAINING, training
from pinnray.studies.sweep.study import Study
from pinnray.studies.sweep.workers import Workers
from tests.compare.tables import rows_of

TINY = {"preset": "paper", "epochs": 2, "width": 4, "layers": 1, "base_points": 5}
DIED = "its worker process died 8 times"


def study(settings: Mapping[str, Any] = TINY, **physics: Any) -> Study:
    return grid_study("default", settings, physics, (1e-3, 1e-2), (1.0, 10.0))


@pytest.fixture
def wanted(tmp_path: Path) -> StudyJob:
    mesh = MeshSettings(size=1.0)
    return StudyJob(study(), Path(), tmp_path / "search", 2, finger=Design(), mesh=mesh, kind="grid search")


def point_of(task: Task) -> GridPoint:
    return GridPoint(task.settings["learning_rate"], task.settings["bc_weight"])


@pytest.fixture
def scripted(monkeypatch: pytest.MonkeyPatch) -> Callable[..., list[GridPoint]]:
    """`scripted(end)`: runs end as the function of their point says, one after the other in this process.

    It returns the list of points that are trained.
    """

    def prepare(end: Callable[[GridPoint], Any]) -> list[GridPoint]:
        trained: list[GridPoint] = []

        def answers(_: Workers, tasks: Mapping[int, Task]) -> Iterator[Measurement]:
            for number, task in tasks.items():
                trained.append(point_of(task))
                ended = end(trained[-1])
                if isinstance(ended, float):
                    values = {**dict.fromkeys(TRAINING, 1.0), "rel_l2_displacement": ended, "loss": 1 / ended}
                    yield Measurement(number, "done", "", 0.1, values)
                else:
                    yield Measurement(number, *ended, 0.1)  # type: ignore[call-arg]

        monkeypatch.setattr(Workers, "answers", answers)
        return trained

    return prepare


def distance(point: GridPoint) -> float:
    return 0.1 * point.learning_rate * point.bc_weight


# What a run is worth


@pytest.fixture(scope="module")
def fem(coarse_mesh) -> Solution:
    """With what a training says of itself."""
    said = {"history": {"total": np.array([9.0, 3.0])}, "stats": {"epochs": 2, "seconds": 1.5}}
    return replace(FemSolver().solve(Problem(coarse_mesh)), **said)


def shifted(field: LagrangeField, by: tuple[float, float]) -> LagrangeField:
    """A field, moved as a whole."""
    return LagrangeField(field.space, field.values + by)


def test_the_reference_itself_is_at_no_distance(fem):
    worth = training(fem)
    assert worth["rel_l2_displacement"] == worth["rel_energy"] == 0
    assert max(worth["base_violation"], worth["load_violation"]) < 1e-9  # rounding of displacements of 10 mm
    assert (worth["loss"], worth["epochs"], worth["seconds"]) == (3.0, 2, 1.5)


def test_a_finger_that_moves_as_a_whole_violates_base_and_load_by_as_much(fem):
    """By (0.3, 0.4) mm, half a millimetre, of a stroke of 10 mm; the energy is that of the strain."""
    worth = training(replace(fem, field=shifted(fem.field, (0.3, 0.4))))
    assert (worth["base_violation"], worth["load_violation"]) == pytest.approx((0.5, 0.5))
    assert worth["boundary_violation"] == pytest.approx(0.05)
    assert worth["rel_energy"] == 0


def test_a_component_that_is_free_cannot_be_violated(fem):
    problem = replace(fem.problem, load=Load(displacement=(None, -10.0)))
    moved = replace(fem, problem=problem, field=shifted(fem.field, (7.0, 0.4)))
    assert training(moved)["load_violation"] == pytest.approx(0.4)


@pytest.mark.parametrize(
    ("error", "state"),
    [
        (TrainingDiverged("loss became nan in epoch 12"), "not converged"),  # a finding, which is kept
        (UserError("the checkpoint is of another run"), "failed"),  # to be tried again
    ],
)
def test_a_run_without_a_solution_says_why(wanted, monkeypatch, error, state):
    def refused(*_: object) -> Solution:
        raise error

    monkeypatch.setattr("pinnray.solvers.pinn.paper.solver.PaperPinnSolver.solve", refused)
    ended = measured(wanted.task(0, {"pinn-std.learning_rate": 1e-2, "pinn-std.bc_weight": 1.0}))
    assert (ended.state, ended.message, ended.values) == (state, str(error), {})


# The search


@pytest.mark.release
def test_a_whole_search(tmp_path, capsys, monkeypatch, request):
    """In its own process, then here: nothing is left to do again, and a wider grid trains what is new."""
    monkeypatch.chdir(tmp_path)
    tiny = " ".join(f"--solver-set pinn-std.{key}={value}" for key, value in TINY.items() if key != "epochs")
    line = f"gridsearch --learning-rates 1e-3,1e-2 --epochs 2 --mesh-size 1 --processes 1 {tiny}"
    assert main([*line.split(), "--bc-weights", "10"]) == 0
    output = capsys.readouterr()
    names = ["gridsearch.csv", "gridsearch.json", "gridsearch.png"]
    assert output.out.splitlines()[-3:] == [f"out/gridsearch-default/{name}" for name in names]
    out = tmp_path / "out" / "gridsearch-default"
    told = json.loads((out / "gridsearch.json").read_text())
    assert (told["solver"]["epochs"], told["learning_rates"], told["bc_weights"]) == (2, [1e-3, 1e-2], [10])
    assert told["best"] == told["runs"][0]
    for run in told["runs"]:
        assert run["status"] == TRAINED
        assert run["measured"]["rel_l2_displacement"] > 0.1  # after two epochs
    request.getfixturevalue("in_line")
    assert main([*line.split(), "--bc-weights", "10"]) == 0
    assert capsys.readouterr().out == output.out
    histories = {path: path.read_text() for path in out.rglob("history.csv")}
    assert main([*line.split(), "--bc-weights", "10,100"]) == 0
    assert {path: path.read_text() for path in histories} == histories  # nothing was trained again
    wider = {str(run["point"]): run for run in json.loads((out / "gridsearch.json").read_text())["runs"]}
    assert len(wider) == 4
    for run in told["runs"]:
        again = wider[str(run["point"])]
        assert {**again["measured"], "seconds": 0} == {**run["measured"], "seconds": 0}


def test_runs_are_ranked_by_their_distance_from_fem_and_not_by_their_loss(wanted, scripted):
    """The loss is here the reciprocal of the distance."""
    points = scripted(distance)
    runs = search_grid(wanted)
    assert [run.point for run in runs] == sorted(points, key=distance)
    assert best_of(runs) == runs[0]
    rows = rows_of(wanted.out / "gridsearch.csv")
    assert [row["rank"] for row in rows] == ["1", "2", "3", "4"]
    assert [float(row["rel_l2_displacement"]) for row in rows] == sorted(map(distance, points))
    assert rows[0]["loss_MPa"] == str(1 / distance(runs[0].point))


def test_a_run_that_diverges_is_recorded_and_one_that_fails_is_tried_again(wanted, scripted):
    bad, worse = GridPoint(1e-2, 10.0), GridPoint(1e-3, 1.0)
    ends = {bad: ("not converged", "loss became nan"), worse: ("failed", DIED)}
    scripted(lambda point: ends.get(point) or distance(point))
    runs = {run.point: run for run in search_grid(wanted)}
    assert runs[bad] == TrainingRun(bad, DIVERGED, "loss became nan")
    assert runs[worse] == TrainingRun(worse, FAILED, DIED)
    trained = scripted(distance)
    assert [run.status for run in search_grid(wanted)] == [TRAINED] * 3 + [DIVERGED]
    assert trained == [worse]


def test_an_interrupted_search_goes_on_where_it_was(wanted, scripted):
    third = GridPoint(1e-2, 1.0)

    def interrupted(point: GridPoint) -> float:
        if point == third:
            raise KeyboardInterrupt
        return distance(point)

    scripted(interrupted)
    with pytest.raises(KeyboardInterrupt):
        search_grid(wanted)
    trained = scripted(distance)
    assert len(search_grid(wanted)) == 4
    assert trained == [third, GridPoint(1e-2, 10.0)]


def test_another_search_in_the_same_folder_is_refused(wanted, scripted):
    scripted(distance)
    search_grid(wanted)
    before = (wanted.out / "gridsearch.json").read_text()
    with pytest.raises(UserError, match=r"holds a grid search with other settings \(mesh.size"):
        search_grid(replace(wanted, mesh=MeshSettings(size=1.5)))
    assert (wanted.out / "gridsearch.json").read_text() == before


def run_on_the_command_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> int:
    monkeypatch.chdir(tmp_path)
    return main(shlex.split("gridsearch --learning-rates 1e-3 --bc-weights 1,10 --mesh-size 1 --epochs 2"))


def test_a_run_that_failed_is_named(tmp_path, capsys, monkeypatch, scripted):
    scripted(lambda point: ("failed", DIED) if point.bc_weight == 1 else 0.1)
    assert run_on_the_command_line(tmp_path, monkeypatch) == NOT_CONVERGED
    last = capsys.readouterr().err.splitlines()[-1]
    assert all(word in last for word in ("rate 0.001", "weight 1 ", "tried again by the same command", DIED))


@pytest.mark.parametrize(
    ("options", "epochs", "expected"),
    [
        (SolverOptions(), None, 2_000),
        (SolverOptions(preset="paper"), None, 60_000),
        (SolverOptions(preset="paper"), 7, 7),
        (SolverOptions(solver_set=("pinn-std.epochs=8",)), None, 8),
    ],
)
def test_epochs_of_a_search(options, epochs, expected):
    settings = read_settings(options, epochs)
    assert (settings["preset"], settings["epochs"]) == ("paper", expected)
    assert not {"learning_rate", "bc_weight"} & set(settings)
