"""The grid search: what a run is worth, what is kept, what is refused, and the order of the result."""

import csv
import json
import shlex
from collections.abc import Callable, Generator, Mapping
from dataclasses import dataclass, replace
from io import StringIO
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rich.console import Console

from compare.runtime.exits import INTERRUPTED, NOT_CONVERGED
from compare.runtime.stages import Stages
from geometry.arrays import FloatArray
from geometry.cache import finger_mesh
from geometry.errors import UserError
from geometry.finger.design import Design
from geometry.mesh.point_location import LocatedPoints
from geometry.mesh.settings import MeshSettings
from geometry.processes import ProcessFailed
from pinnray.cli import main
from pinnray.commands.studies.gridsearch import read_settings
from pinnray.options.shared import SolverOptions
from solvers.fem.linear import FemSolver
from solvers.problem import Load, Material, Problem
from solvers.solution import DisplacementField, Solution
from solvers.solver import TrainingDiverged, silent
from studies.gridsearch.search import GridSearch, search_grid
from studies.gridsearch.tables import best_of
from studies.gridsearch.training_run import (
    DIVERGED,
    FAILED,
    TRAINED,
    GridPoint,
    ReferenceSolution,
    TrainingMetrics,
    TrainingRun,
    TrainingTask,
    measure,
    train,
)

COARSE = MeshSettings(size=1.0)
TINY = {"preset": "paper", "epochs": 2, "width": 4, "layers": 1, "base_points": 5}


@dataclass(frozen=True)
class Shifted:
    """A field, moved as a whole."""

    field: DisplacementField
    by: tuple[float, float]

    def displacement(self, location: LocatedPoints) -> FloatArray:
        return self.field.displacement(location) + self.by

    def gradient(self, location: LocatedPoints) -> FloatArray:
        return self.field.gradient(location)


@pytest.fixture(scope="module")
def fem() -> Solution:
    return FemSolver(degree=1).solve(Problem(finger_mesh(Design(), settings=COARSE)))


def trained(solution: Solution) -> Solution:
    """The solution with what a training says of itself."""
    history = {"total": np.array([9.0, 3.0])}
    return replace(solution, history=history, stats={"epochs": 2, "seconds": 1.5})


@pytest.fixture
def wanted(tmp_path: Path) -> GridSearch:
    return GridSearch(
        design=Design(),
        mesh=COARSE,
        material=Material(),
        load=Load(),
        learning_rates=(1e-3, 1e-2),
        bc_weights=(1.0, 10.0),
        settings=TINY,
        out=tmp_path / "search",
        processes=2,
    )


def measured(distance: float, loss: float = 1.0) -> TrainingMetrics:
    return TrainingMetrics(
        rel_l2_displacement=distance,
        rel_energy=0.5,
        boundary_violation=0.02,
        base_violation=0.1,
        load_violation=0.2,
        energy=1.5,
        loss=loss,
        epochs=2,
        seconds=0.25,
    )


@pytest.fixture
def scripted(monkeypatch: pytest.MonkeyPatch) -> Callable[..., list[GridPoint]]:
    """`scripted(end)`: runs end as the function of their point says, one after the other in this process.

    It returns the list of points that are trained.
    """

    def prepare(end: Callable[[GridPoint], Any]) -> list[GridPoint]:
        trained: list[GridPoint] = []

        def work(task: TrainingTask) -> TrainingRun | ProcessFailed:
            trained.append(task.point)
            answer = end(task.point)
            if isinstance(answer, float):
                return train_with(task, measured(answer, loss=1 / answer))
            return answer

        def inline(
            _: object, __: object, tasks: Mapping[str, TrainingTask], **___: object
        ) -> Generator[tuple[str, TrainingRun | ProcessFailed]]:
            for name, task in tasks.items():
                yield name, work(task)

        monkeypatch.setattr("geometry.processes.Pool.answers", inline)
        return trained

    def train_with(task: TrainingTask, worth: TrainingMetrics) -> TrainingRun:
        with monkeypatch.context() as patch:
            patch.setattr("studies.gridsearch.training_run.measure", lambda *_: worth)
            return train(task, silent)

    return prepare


def searched(wanted: GridSearch) -> list[TrainingRun]:
    with Stages(Console(file=StringIO()), quiet=True) as stages:
        return search_grid(wanted, stages)


def distance(point: GridPoint) -> float:
    return 0.1 * point.learning_rate * point.bc_weight


# What a run is worth


def test_the_reference_itself_is_at_no_distance(fem):
    worth = measure(
        replace(fem, history={"total": np.ones(1)}, stats={"epochs": 1, "seconds": 1.0}),
        ReferenceSolution.of(fem),
    )
    assert worth.rel_l2_displacement == worth.rel_energy == 0
    assert max(worth.base_violation, worth.load_violation) < 1e-9  # rounding of displacements of 10 mm


def test_a_finger_that_moves_as_a_whole_violates_base_and_load_by_as_much(fem):
    """By (0.3, 0.4) mm, half a millimetre, of a stroke of 10 mm; the energy is that of the strain."""
    worth = measure(trained(replace(fem, field=Shifted(fem.field, (0.3, 0.4)))), ReferenceSolution.of(fem))
    assert (worth.base_violation, worth.load_violation) == pytest.approx((0.5, 0.5))
    assert worth.boundary_violation == pytest.approx(0.05)
    assert worth.rel_energy == 0
    assert (worth.loss, worth.epochs, worth.seconds) == (3.0, 2, 1.5)


def test_a_component_that_is_free_cannot_be_violated(fem):
    problem = replace(fem.problem, load=Load(displacement=(None, -10.0)))
    moved = trained(replace(fem, problem=problem, field=Shifted(fem.field, (7.0, 0.4))))
    assert measure(moved, ReferenceSolution.of(fem)).load_violation == pytest.approx(0.4)


@pytest.mark.parametrize(
    ("error", "status", "kept"),
    [
        (TrainingDiverged("loss became nan in epoch 12"), DIVERGED, True),  # a finding
        (UserError("the checkpoint is of another run"), FAILED, False),  # to be tried again
    ],
)
def test_a_run_without_a_solution_says_why(fem, tmp_path, monkeypatch, error, status, kept):
    def refused(*_: object) -> Solution:
        raise error

    monkeypatch.setattr("solvers.pinn.paper.solver.PaperPinnSolver.solve", refused)
    fem.problem.mesh.save(tmp_path / "mesh.npz")
    point = GridPoint(1e-2, 1.0)
    task = TrainingTask(
        point,
        TINY,
        tmp_path / "mesh.npz",
        Material(),
        Load(),
        ReferenceSolution.of(fem),
        tmp_path / "run",
        threads=1,
    )
    assert train(task, silent) == TrainingRun(point, status, str(error))
    assert (tmp_path / "run" / "result.json").exists() == kept


# The search


@pytest.mark.slow
def test_a_whole_search(tmp_path, capsys, monkeypatch):
    """In processes of its own; again, nothing is left to do."""
    monkeypatch.chdir(tmp_path)
    tiny = " ".join(f"--solver-set pinn-std.{key}={value}" for key, value in TINY.items() if key != "epochs")
    line = (
        f"gridsearch --learning-rates 1e-3,1e-2 --bc-weights 10 --epochs 2 --mesh-size 1 --processes 2 {tiny}"
    )
    assert main(line.split()) == 0
    output = capsys.readouterr()
    names = ["gridsearch.csv", "gridsearch.json", "gridsearch.png"]
    assert output.out.splitlines()[-3:] == [f"out/gridsearch-default/{name}" for name in names]
    assert "2 of 2 runs" in output.err
    out = tmp_path / "out" / "gridsearch-default"
    told = json.loads((out / "gridsearch.json").read_text())
    assert (told["solver"]["epochs"], told["learning_rates"], told["bc_weights"]) == (2, [1e-3, 1e-2], [10])
    assert told["best"] == told["runs"][0]
    for run in told["runs"]:
        assert run["status"] == TRAINED
        assert run["measured"]["rel_l2_displacement"] > 0.1  # after two epochs
    assert main(line.split()) == 0
    again = capsys.readouterr()
    assert again.out == output.out
    assert [line.split(":")[0] for line in again.err.splitlines()] == ["mesh", "picture"]


def test_runs_are_ranked_by_their_distance_from_fem_and_not_by_their_loss(wanted, scripted):
    """The loss is here the reciprocal of the distance."""
    scripted(distance)
    runs = searched(wanted)
    assert [run.point for run in runs] == sorted(wanted.points, key=distance)
    assert best_of(runs) == runs[0]
    with (wanted.out / "gridsearch.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [row["rank"] for row in rows] == ["1", "2", "3", "4"]
    assert [float(row["rel_l2_displacement"]) for row in rows] == sorted(map(distance, wanted.points))
    assert rows[0]["loss_MPa"] == str(1 / distance(runs[0].point))


def test_a_run_that_diverges_is_recorded_and_the_rest_goes_on(wanted, scripted):
    bad = GridPoint(1e-2, 10.0)
    diverged = TrainingRun(bad, DIVERGED, "loss became nan in epoch 12; take a smaller learning_rate")
    scripted(lambda point: diverged if point == bad else distance(point))
    runs = searched(wanted)
    assert runs[-1] == diverged
    assert [run.status for run in runs[:-1]] == [TRAINED] * 3
    told = json.loads((wanted.out / "gridsearch.json").read_text())["runs"][-1]
    assert (told["status"], told["measured"]) == (DIVERGED, None)


def test_a_process_that_fails_is_tried_again_by_the_next_search(wanted, scripted):
    bad = GridPoint(1e-2, 10.0)
    scripted(lambda point: ProcessFailed(-9) if point == bad else distance(point))
    assert searched(wanted)[-1] == TrainingRun(bad, FAILED, "its process ended with exit code -9")
    trained = scripted(distance)
    assert [run.status for run in searched(wanted)] == [TRAINED] * 4
    assert trained == [bad]


def test_an_interrupted_search_goes_on_where_it_was(wanted, scripted):
    def interrupted(point: GridPoint) -> float:
        if point == wanted.points[2]:
            raise KeyboardInterrupt
        return distance(point)

    scripted(interrupted)
    with pytest.raises(KeyboardInterrupt):
        searched(wanted)
    trained = scripted(distance)
    runs = searched(wanted)
    assert trained == wanted.points[2:]
    assert [run.point for run in runs] == sorted(wanted.points, key=distance)


def test_a_wider_search_takes_over_what_is_there(wanted, scripted):
    scripted(distance)
    searched(wanted)
    trained = scripted(distance)
    runs = searched(replace(wanted, bc_weights=(*wanted.bc_weights, 100.0)))
    assert trained == [GridPoint(1e-3, 100.0), GridPoint(1e-2, 100.0)]
    assert len(runs) == 6


@pytest.mark.parametrize(
    ("changes", "names"),
    [
        ({"settings": {**TINY, "epochs": 3}}, "solver.epochs"),
        ({"load": Load(kind="point")}, "load.kind"),
        ({"mesh": MeshSettings(size=1.5), "material": Material(young=5.0)}, "mesh.size, material.young"),
    ],
)
def test_another_search_in_the_same_folder_is_refused(wanted, scripted, changes, names):
    scripted(distance)
    searched(wanted)
    before = (wanted.out / "gridsearch.json").read_text()
    with pytest.raises(
        UserError, match=rf"holds a grid search with other settings \({names}\); name another"
    ):
        searched(replace(wanted, **changes))
    assert (wanted.out / "gridsearch.json").read_text() == before


def test_results_of_another_program_are_refused(wanted, scripted, monkeypatch):
    scripted(distance)
    searched(wanted)
    monkeypatch.setattr("compare.runtime.resumable_folder.sources_digest", lambda *_: "another")
    with pytest.raises(UserError, match=r"other settings \(program_sha256\)"):
        searched(wanted)


# On the command line


def run_on_the_command_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> int:
    monkeypatch.chdir(tmp_path)
    line = "gridsearch --learning-rates 1e-3 --bc-weights 1,10 --mesh-size 1 --epochs 2"
    return main(shlex.split(line))


def test_an_interrupted_search_says_how_to_go_on(tmp_path, capsys, monkeypatch, scripted):
    def interrupted(point: GridPoint) -> float:
        raise KeyboardInterrupt

    scripted(interrupted)
    assert run_on_the_command_line(tmp_path, monkeypatch) == INTERRUPTED
    said = "interrupted; the same command goes on from what out/gridsearch-default keeps"
    assert capsys.readouterr().err.splitlines()[-1] == said


def test_a_search_whose_runs_all_diverged_says_so_by_its_exit_code(tmp_path, capsys, monkeypatch, scripted):
    scripted(lambda point: TrainingRun(point, DIVERGED, "loss became nan"))
    assert run_on_the_command_line(tmp_path, monkeypatch) == NOT_CONVERGED
    assert capsys.readouterr().out.count("diverged") == 2


def test_a_run_that_failed_is_named(tmp_path, capsys, monkeypatch, scripted):
    scripted(
        lambda point: (
            ProcessFailed(-9) if point.bc_weight == 1 else TrainingRun(point, TRAINED, "", measured(0.1))
        )
    )
    assert run_on_the_command_line(tmp_path, monkeypatch) == NOT_CONVERGED
    last = capsys.readouterr().err.splitlines()[-1]
    assert last == (
        "error: lr-0.001_bc-1.0 failed, and is tried again by the same command: "
        "its process ended with exit code -9"
    )


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
