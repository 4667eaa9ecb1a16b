"""Training of the paper's networks: saved, resumed, interrupted, ended."""

import csv
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch

from pinnray.runtime.errors import UserError
from pinnray.solvers.pinn.paper.checkpoint import CheckpointStore
from pinnray.solvers.pinn.paper.solver import PaperPinnSolver
from pinnray.solvers.pinn.paper.training import UNREAD, Training
from pinnray.solvers.problem import Load, Problem
from pinnray.solvers.solution import Solution
from pinnray.solvers.solver import TrainingContext, TrainingDiverged
from tests.solvers.conftest import bar_mesh

SMALL = PaperPinnSolver(epochs=40, width=8, layers=2, base_points=20, checkpoint_every=7)


@pytest.fixture(scope="module")
def problem() -> Problem:
    return Problem(bar_mesh(24.0, 4.0, 12, 4, contact=(14.0, 18.0)))


@pytest.fixture(scope="module")
def straight(problem) -> Solution:
    """40 epochs without a pause."""
    return SMALL.solve(problem)


def assert_identical(first: Solution, second: Solution) -> None:
    assert torch.equal(first.field.parameters, second.field.parameters)  # type: ignore[attr-defined]
    for name, column in first.history.items():
        if name != "seconds":
            np.testing.assert_array_equal(column, second.history[name], err_msg=name)


def test_resumed_training_is_the_same_to_the_bit(problem, straight, tmp_path):
    """20 epochs and 20 more; the second run starts from the files alone."""
    context = TrainingContext(tmp_path, resume=True)
    half = replace(SMALL, epochs=20).in_context(context).solve(problem)
    assert half.stats["epochs"] == 20
    whole = SMALL.in_context(context).solve(problem)
    assert_identical(whole, straight)
    assert (np.diff(whole.history["seconds"]) > 0).all(), "the clock goes on"


def test_threads_do_not_change_a_bit(problem, straight):
    before = torch.get_num_threads()
    torch.set_num_threads(1 if before > 1 else 2)
    try:
        assert_identical(SMALL.solve(problem), straight)
    finally:
        torch.set_num_threads(before)


@pytest.mark.parametrize("epoch", [3, 13])  # before the first checkpoint; between two
def test_interrupted_training_goes_on(problem, straight, tmp_path, epoch):
    def interrupt(fraction: float, text: str) -> None:
        if text.startswith(f"epoch {epoch} of 40"):
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        SMALL.in_context(TrainingContext(tmp_path)).solve(problem, interrupt)
    assert len(rows(tmp_path)) == epoch
    again: list[str] = []
    resumed = SMALL.in_context(TrainingContext(tmp_path, resume=True))
    assert_identical(resumed.solve(problem, lambda _, text: again.append(text)), straight)
    assert len(again) == 40 - epoch


def test_an_interrupt_within_a_step_saves_the_epoch_before(problem, straight, tmp_path, monkeypatch):
    """The optimiser has changed the parameters, but not yet recorded the epoch."""
    step, calls = torch.optim.Adam.step, []

    def interrupted(self):
        step(self)
        calls.append(1)
        if len(calls) == 10:
            raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr(torch.optim.Adam, "step", interrupted)
        with pytest.raises(KeyboardInterrupt):
            SMALL.in_context(TrainingContext(tmp_path)).solve(problem)
    assert len(rows(tmp_path)) == 9
    assert_identical(SMALL.in_context(TrainingContext(tmp_path, resume=True)).solve(problem), straight)


def test_without_resume_a_checkpoint_is_ignored(problem, straight, tmp_path):
    context = TrainingContext(tmp_path)
    replace(SMALL, epochs=5).in_context(context).solve(problem)
    assert_identical(SMALL.in_context(context).solve(problem), straight)


def test_a_checkpoint_of_something_else_is_refused(problem, tmp_path):
    """Of another training, of other initial weights, and of another problem."""
    replace(SMALL, epochs=1).in_context(TrainingContext(tmp_path)).solve(problem)
    for settings, load in (({"learning_rate": 2e-3}, Load()), ({"seed": 1}, Load()), ({}, Load("point"))):
        other = replace(SMALL, **settings).in_context(TrainingContext(tmp_path, resume=True))
        with pytest.raises(UserError, match="belongs to another problem or other settings; remove it, or"):
            other.solve(replace(problem, load=load))


def test_a_broken_checkpoint_is_refused(problem, tmp_path):
    (tmp_path / "checkpoint.pt").write_bytes(b"half of it")
    with pytest.raises(UserError, match=r"checkpoint\.pt cannot be read .*; remove it, or"):
        SMALL.in_context(TrainingContext(tmp_path, resume=True)).solve(problem)


def test_a_full_disk_names_the_checkpoint(tmp_path, full_disk):
    with pytest.raises(OSError, match="File too large") as error:
        CheckpointStore(tmp_path, "digest", False).save({"weights": torch.zeros(9000)})
    assert error.value.filename == str(tmp_path / "checkpoint.pt")


def test_the_history_is_a_table_with_units(problem, straight, tmp_path):
    SMALL.in_context(TrainingContext(tmp_path)).solve(problem)
    table = rows(tmp_path)
    assert ",".join(table[0]) == "epoch,PDE [MPa],BC [mm2],total [MPa],energy [N mm/mm],seconds [s]"
    assert [int(row["epoch"]) for row in table] == list(range(1, 41))
    for name, title in (("BC", "BC [mm2]"), ("energy", "energy [N mm/mm]")):
        np.testing.assert_allclose([float(row[title]) for row in table], straight.history[name], rtol=1e-8)
    area = problem.mesh.areas.sum()
    np.testing.assert_allclose(straight.history["energy"], area * straight.history["PDE"])
    assert [path.name for path in tmp_path.iterdir() if "partial" in path.name] == []


def rows(folder: Path) -> list[dict[str, str]]:
    with (folder / "history.csv").open(encoding="utf-8") as file:
        return list(csv.DictReader(file))


def test_progress_is_told_after_every_epoch(problem):
    told: list[tuple[float, str]] = []
    SMALL.solve(problem, lambda *said: told.append(said))
    assert [fraction for fraction, _ in told] == pytest.approx([epoch / 40 for epoch in range(1, 41)])
    assert told[9][1].startswith("epoch 10 of 40: PDE ")


def test_losses_that_are_read_together_are_the_same_to_the_bit(problem, straight, monkeypatch):
    """As on a GPU, up to each checkpoint; the clock runs on between them."""
    begin, told = Training.__init__, []

    def together(self, *given):
        begin(self, *given)
        self._together = UNREAD

    monkeypatch.setattr(Training, "__init__", together)
    found = SMALL.solve(problem, lambda fraction, text: told.append(text.partition(":")[0]))
    assert_identical(found, straight)
    assert told == [f"epoch {epoch} of 40" for epoch in (7, 14, 21, 28, 35, 40)]
    assert (np.diff(found.history["seconds"]) > 0).all()


def test_a_loss_that_is_no_number_stops_the_training(problem, tmp_path):
    """The last checkpoint before it stays."""
    solver = replace(SMALL, learning_rate=1e300, precision="double", checkpoint_every=1)
    with pytest.raises(TrainingDiverged, match=r"the loss .* in epoch 2; take a learning_rate below 1e\+300"):
        solver.in_context(TrainingContext(tmp_path)).solve(problem)
    assert len(rows(tmp_path)) == 1


def test_a_loss_that_grows_beyond_bounds_stops_the_training(problem):
    with pytest.raises(TrainingDiverged, match=r"the loss grew to .* times its first value in epoch"):
        replace(SMALL, learning_rate=100.0).solve(problem)


@pytest.mark.gpu
@pytest.mark.skipif(not torch.cuda.is_available(), reason="needs a CUDA device")
def test_a_gpu_trains_as_the_processor_does(problem):
    settings = {"precision": "double", "epochs": 15}
    cpu, gpu = (replace(SMALL, device=device, **settings).solve(problem) for device in ("cpu", "cuda"))
    torch.testing.assert_close(gpu.field.parameters, cpu.field.parameters, rtol=1e-9, atol=1e-12)  # type: ignore[attr-defined]
    np.testing.assert_allclose(gpu.history["total"], cpu.history["total"], rtol=1e-9)


@pytest.mark.skipif(torch.cuda.is_available(), reason="a CUDA device is there")
def test_a_gpu_that_is_not_there_is_refused_with_advice():
    with pytest.raises(UserError, match="device cuda needs a GPU and torch's CUDA build; take device=cpu"):
        PaperPinnSolver(device="cuda")
