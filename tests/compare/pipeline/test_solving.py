"""The solvers of a comparison in two processes: the numbers of one, and the same ends."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import pytest

from compare.evaluation.evaluation import Evaluation
from compare.pipeline import solving
from compare.pipeline.job import Job
from compare.pipeline.solving import Outcome, solve_all
from compare.runtime.stages import Stages
from geometry.cache import finger_mesh
from geometry.errors import UserError
from geometry.finger.design import Design
from geometry.mesh.settings import MeshSettings
from geometry.observations import Observations
from solvers.fem.finite_strain.solver import FemNonlinearSolver
from solvers.fem.linear import FemSolver
from solvers.problem import Problem
from solvers.solution import Solution
from solvers.solver import Progress, UnsupportedProblemError, silent

ROOT = Path(__file__).parents[3]
DESIGN = Design()
MESH = finger_mesh(DESIGN, settings=MeshSettings(size=1.5))
PROBLEM = Problem(MESH, finger=DESIGN)
STILL = np.zeros_like(MESH.markers)
MARKERS = Observations(MESH.markers, STILL, STILL, np.full(len(STILL), True), "no test looks", True, 1.0)


@dataclass(frozen=True)
class Ending:
    """A solver of finite strain that ends in the way of its name."""

    name: str
    laws: ClassVar[tuple[str, ...]] = ("neo-hookean",)
    loads: ClassVar[tuple[str, ...]] = ("mean", "point")

    def settings(self) -> dict[str, object]:
        return {}

    def solve(self, problem: Problem, progress: Progress = silent) -> Solution:
        if self.name == "killed":
            os.kill(os.getpid(), signal.SIGKILL)
        if self.name == "faulty":
            raise ZeroDivisionError("by nothing")
        if self.name == "unsupporting":
            raise UnsupportedProblemError("unsupporting: no markers here")
        if self.name == "refusing":
            raise UserError("refusing: the weight is negative")
        progress(0.5, str(os.getpid()))
        while True:
            time.sleep(0.02)
            if self.name == "reporting":
                progress(0.5, "")


@pytest.fixture
def solve(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[..., tuple[Outcome, dict[str, float]]]:
    """`solve(processes, *solvers, **changes of the job)`: the outcome, and the seconds of the stages."""
    monkeypatch.setattr(solving, "LARGE", 0)

    def run(processes: int, *solvers: Any, **changes: Any) -> tuple[Outcome, dict[str, float]]:
        folder = tmp_path / str(processes)
        folder.mkdir(exist_ok=True)
        job = replace(Job(DESIGN, solvers, out=folder / "out", processes=processes), **changes)
        stages = Stages(quiet=True)
        return solve_all(job, solvers, PROBLEM, MARKERS, folder, stages), stages.seconds

    return run


def numbers(evaluation: Evaluation) -> dict[str, Any]:
    """All of an evaluation that is not a time."""
    kept = {key: value for key, value in evaluation.stats.items() if "seconds" not in key}
    return {**vars(evaluation), "stats": kept}


def test_two_processes_give_the_numbers_of_one_in_the_order_of_the_job(solve, tmp_path):
    solvers = FemNonlinearSolver(), FemSolver()
    (one, _), (two, seconds) = solve(1, *solvers), solve(2, *solvers)
    assert list(one.evaluations) == list(two.evaluations) == ["fem-nonlinear", "fem"]
    assert set(seconds) == {"fem-nonlinear", "fem"}
    for name, evaluation in one.evaluations.items():
        np.testing.assert_equal(numbers(two.evaluations[name]), numbers(evaluation))
    assert {path.name for path in (tmp_path / "2" / "solutions").iterdir()} == {
        "fem.npz",
        "fem-nonlinear.npz",
    }


def test_a_second_run_takes_over_what_both_processes_finished(solve, monkeypatch):
    solvers = FemNonlinearSolver(), FemSolver()
    first, _ = solve(2, *solvers)
    monkeypatch.setattr(FemSolver, "solve", None)
    second, _ = solve(2, *solvers, resume=True)
    assert second.evaluations["fem"].stats == first.evaluations["fem"].stats  # its seconds, too


def test_the_fault_of_a_solver_in_the_second_process_is_kept_for_the_reader(solve, tmp_path):
    outcome, _ = solve(2, FemSolver(), Ending("faulty"), Ending("unsupporting"), spare=["unsupporting"])
    assert list(outcome.evaluations) == ["fem"]
    assert outcome.failed["faulty"].startswith("solver faulty raised ZeroDivisionError: by nothing (")
    assert outcome.unsupported == {"unsupporting": "unsupporting: no markers here"}
    assert "raise ZeroDivisionError" in (tmp_path / "2" / "errors" / "faulty.txt").read_text()


@pytest.mark.parametrize(
    ("name", "changes", "message"),
    [
        ("refusing", {}, r"^refusing: the weight is negative$"),
        ("unsupporting", {}, r"^unsupporting: no markers here$"),
        ("faulty", {"reference": "faulty"}, r"^solver faulty raised ZeroDivisionError"),
        (
            "killed",
            {},
            r"^solvers of finite strain: its process ended with exit code -9; a resumed run goes on",
        ),
    ],
)
def test_a_refusal_in_the_second_process_is_one_line_of_the_first(solve, name, changes, message):
    with pytest.raises(UserError, match=message):
        solve(2, FemSolver(), Ending(name), **changes)


PROGRAM = """
import sys
from pathlib import Path
from compare.pipeline import solving
from compare.pipeline.job import Job
from compare.runtime.interruption import interruptible
from solvers.fem.linear import FemSolver
from tests.compare.pipeline.test_solving import DESIGN, MARKERS, PROBLEM, Ending

class Said:
    def stage(self, name):
        return self
    def __enter__(self):
        return lambda fraction, note: print(note, flush=True) if note.isdigit() else None
    def __exit__(self, *_):
        pass

if __name__ == "__main__":
    solving.LARGE = 0
    job = Job(DESIGN, (FemSolver(), Ending(sys.argv[2])), processes=2)
    with interruptible():
        solving.solve_all(job, job.solvers, PROBLEM, MARKERS, Path(sys.argv[1]), Said())
"""


@pytest.mark.parametrize(
    ("name", "ending"),
    [("silent", signal.SIGKILL), ("silent", signal.SIGTERM), ("reporting", signal.SIGTERM)],
)
def test_no_process_outlives_the_run(tmp_path, name, ending):
    program = subprocess.Popen(
        [sys.executable, "-c", PROGRAM, str(tmp_path), name],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        cwd=ROOT,
    )
    assert program.stdout is not None
    child = int(program.stdout.readline())
    program.send_signal(ending)
    program.communicate(timeout=60)
    assert not alive(child, within=2.0)


def alive(process: int, *, within: float) -> bool:
    """Whether a process still runs after some seconds; it may end before."""
    limit = time.monotonic() + within
    while time.monotonic() < limit:
        try:
            os.kill(process, 0)
            state = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[0]
        except (ProcessLookupError, FileNotFoundError):
            return False
        if state == "Z":
            return False
        time.sleep(0.02)
    return True
