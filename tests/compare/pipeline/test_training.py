"""Solvers that train for long: what the main job tells them, keeps of them, and goes on from."""

from dataclasses import dataclass, field, replace
from typing import ClassVar

import pytest

from pinnray.solvers.fem.linear import FemSolver
from pinnray.solvers.problem import Material, Problem
from pinnray.solvers.solution import Solution
from pinnray.solvers.solver import Progress, TrainingContext, silent
from tests.compare.pipeline.runs import compare


@dataclass(frozen=True)
class Counting:
    """`fem`, after it has counted epochs in a file; it is interrupted after one of them as the test says."""

    diary: list[tuple[int, TrainingContext]]
    stop_after: int | None = None
    total: int = 4
    context: TrainingContext = field(default=TrainingContext())
    name: ClassVar[str] = "counting"
    laws: ClassVar[tuple[str, ...]] = ("linear",)
    loads: ClassVar[tuple[str, ...]] = ("mean", "point")

    def settings(self) -> dict[str, object]:
        return {"epochs": self.total}

    def in_context(self, context: TrainingContext) -> "Counting":
        return replace(self, context=context)

    def solve(self, problem: Problem, progress: Progress = silent) -> Solution:
        assert self.context.folder is not None
        self.context.folder.mkdir(parents=True, exist_ok=True)
        checkpoint = self.context.folder / "checkpoint"
        first = int(checkpoint.read_text()) if self.context.resume and checkpoint.exists() else 0
        for epoch in range(first + 1, self.total + 1):
            self.diary.append((epoch, self.context))
            checkpoint.write_text(str(epoch))
            if epoch == self.stop_after:
                raise KeyboardInterrupt
        return FemSolver(degree=1).solve(replace(problem, material=Material()), progress)

    @property
    def epochs(self) -> list[int]:
        return [epoch for epoch, _ in self.diary]


def test_an_interrupted_training_goes_on_and_its_files_end_in_the_output(job, tmp_path):
    first, second = Counting([], stop_after=3), Counting([])
    with pytest.raises(KeyboardInterrupt):
        compare(job(first))
    assert first.epochs == [1, 2, 3]
    assert (tmp_path / "out" / "run.partial" / "training" / "counting" / "checkpoint").read_text() == "3"
    compare(job(second, resume=True))
    assert second.epochs == [4]
    assert (tmp_path / "out" / "run" / "training" / "counting" / "checkpoint").read_text() == "4"
    assert "training/counting/checkpoint" in (tmp_path / "out" / "run" / "run.json").read_text()
    assert not (tmp_path / "out" / "run.partial").exists()


def test_a_solution_that_is_taken_over_brings_its_training_along(job, tmp_path):
    compare(job(Counting([])))
    again = Counting([])
    compare(job(again, FemSolver(), resume=True))
    assert again.epochs == []
    assert (tmp_path / "out" / "run" / "training" / "counting" / "checkpoint").read_text() == "4"


def test_a_finished_training_goes_on_where_more_is_asked_of_it(job, tmp_path):
    compare(job(Counting([])))
    longer = Counting([], total=6)
    compare(job(longer, resume=True))
    assert longer.epochs == [5, 6]
    assert (tmp_path / "out" / "run" / "training" / "counting" / "checkpoint").read_text() == "6"
