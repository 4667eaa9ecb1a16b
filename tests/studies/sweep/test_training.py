"""A sweep over settings of a network's training: what a training is worth, and what is kept."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pinnray.cli import main
from pinnray.runtime.errors import UserError
from pinnray.solvers.fem.linear import FemSolver
from pinnray.solvers.lagrange import LagrangeField
from pinnray.solvers.problem import Load, Problem
from pinnray.solvers.solution import Solution
from pinnray.solvers.solver import TrainingDiverged
from pinnray.studies.sweep.job import StudyJob
from pinnray.studies.sweep.measurement import measured
from pinnray.studies.sweep.quantities import boundary_violations, training
from pinnray.studies.sweep.study import Study
from pinnray.studies.sweep.sweep import load_sweep

STUDY = """
solver = "pinn-std"
settings = { preset = "paper", epochs = 2, width = 4, layers = 1, base_points = 5 }
mesh_size = 2.0
sampling = "grid"
[varied]
"pinn-std.learning_rate" = { values = [1e-3, 1e-2] }
"pinn-std.bc_weight" = { values = [WEIGHTS] }
"""


def study_file(folder: Path, weights: str) -> Path:
    path = folder / "search.toml"
    path.write_text(STUDY.replace("WEIGHTS", weights), encoding="utf-8")
    return path


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
    assert max(boundary_violations(fem)) < 1e-9  # rounding of displacements of 10 mm
    assert worth["loss"] == 3.0


def test_a_finger_that_moves_as_a_whole_violates_base_and_load_by_as_much(fem):
    """By (0.3, 0.4) mm, half a millimetre, of a stroke of 10 mm; the energy is that of the strain."""
    moved = replace(fem, field=shifted(fem.field, (0.3, 0.4)))
    worth = training(moved)
    assert boundary_violations(moved) == pytest.approx((0.5, 0.5))
    assert worth["boundary_violation"] == pytest.approx(0.05)
    assert worth["rel_energy"] == 0


def test_a_component_that_is_free_cannot_be_violated(fem):
    problem = replace(fem.problem, load=Load(displacement=(None, -10.0)))
    moved = replace(fem, problem=problem, field=shifted(fem.field, (7.0, 0.4)))
    assert boundary_violations(moved)[1] == pytest.approx(0.4)


@pytest.mark.parametrize(
    ("error", "state"),
    [
        (TrainingDiverged("loss became nan in epoch 12"), "not converged"),  # a finding, which is kept
        (UserError("the checkpoint is of another run"), "failed"),  # to be tried again
    ],
)
def test_a_run_without_a_solution_says_why(tmp_path, monkeypatch, error, state):
    def refused(*_: object) -> Solution:
        raise error

    monkeypatch.setattr("pinnray.solvers.pinn.paper.solver.PaperPinnSolver.solve", refused)
    job = StudyJob(Study.load(study_file(tmp_path, "1.0")), tmp_path, tmp_path / "out")
    ended = measured(job.task(0, {"pinn-std.learning_rate": 1e-2, "pinn-std.bc_weight": 1.0}))
    assert (ended.state, ended.message, ended.values) == (state, str(error), {})


@pytest.mark.slow
def test_a_wider_grid_trains_what_is_new_alone(tmp_path, in_line, capsys):
    out = tmp_path / "out"
    study = study_file(tmp_path, "10.0")
    assert main(["sweep", str(study), "--out", str(out)]) == 3  # two epochs are no training
    before = load_sweep(out)
    histories = {path: path.read_text() for path in out.rglob("history.csv")}
    assert len(histories) == 2
    assert str(out / "map.png") in capsys.readouterr().out
    assert main(["sweep", str(study_file(tmp_path, "10.0, 100.0")), "--out", str(out)]) == 3
    assert {path: path.read_text() for path in histories} == histories  # nothing was trained again
    wider = load_sweep(out)
    assert len(wider.measurements) == 4
    for each in before.measurements:
        place = wider.samples.index(before.samples[each.number])
        again = wider.measurements[place].values
        assert again["rel_l2_displacement"] == each.values["rel_l2_displacement"] > 0.1
