"""The solvers of a comparison in two processes: the numbers of one, and the same ends."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from contextlib import nullcontext
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pinnray.comparison.evaluation.evaluation import Evaluation
from pinnray.comparison.pipeline import solving
from pinnray.comparison.pipeline.job import Job
from pinnray.comparison.pipeline.solving import Outcome, solve_all
from pinnray.runtime.errors import UserError
from pinnray.runtime.processes.pool import Pool
from pinnray.runtime.stages import Stages
from pinnray.solvers.fem.finite_strain.solver import FemNonlinearSolver
from pinnray.solvers.fem.linear import FemSolver
from pinnray.solvers.problem import Material
from pinnray.solvers.registry import make_solver
from pinnray.solvers.solver import Traits
from tests.compare.pipeline.endings import DESIGN, MARKERS, PROBLEM, Ending

ROOT = Path(__file__).parents[3]
PROGRAM = "from tests.compare.pipeline.endings import main; main()"


@pytest.fixture
def solve(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[..., tuple[Outcome, dict[str, float]]]:
    """`solve(processes, *solvers, **changes of the job)`: the outcome, and the seconds of the stages."""
    monkeypatch.setattr(solving, "LARGE", 0)

    def run(processes: int, *solvers: Any, **changes: Any) -> tuple[Outcome, dict[str, float]]:
        folder = tmp_path / str(processes)
        folder.mkdir(exist_ok=True)
        job = replace(Job(DESIGN, solvers, out=folder / "out"), **changes)
        stages = Stages(quiet=True)
        with nullcontext() if processes < 2 else solving.second_process() as pool:
            return solve_all(job, solvers, PROBLEM, MARKERS, folder, stages, pool), stages.seconds

    return run


@pytest.fixture
def in_one_process(monkeypatch: pytest.MonkeyPatch) -> None:
    """Both parts in this process: quicker, where no test looks at processes."""

    class Here(Pool):
        def answers(self, work, tasks, *, report):
            for name, task in tasks.items():
                yield name, work(task, partial(report, name))

    monkeypatch.setattr(solving, "Pool", Here)
    monkeypatch.setattr(solving, "end_with_parent", lambda: None)


def numbers(evaluation: Evaluation) -> dict[str, Any]:
    """All of an evaluation that is not a time."""
    kept = {key: value for key, value in evaluation.stats.items() if "seconds" not in key}
    parts = {name: vars(part) for name in ("figures", "certificate") if (part := getattr(evaluation, name))}
    return {**vars(evaluation), "stats": kept, **parts}


@pytest.mark.slow
def test_two_processes_give_the_numbers_of_one_and_a_second_run_takes_them_over(solve, tmp_path, monkeypatch):
    solvers = FemNonlinearSolver(), FemSolver()
    (one, _), (two, seconds) = solve(1, *solvers), solve(2, *solvers)
    assert list(one.evaluations) == list(two.evaluations) == ["fem-nonlinear", "fem"]  # as in the job
    assert set(seconds) == {"fem-nonlinear", "fem", "certificate"}
    for name, evaluation in one.evaluations.items():
        np.testing.assert_equal(numbers(two.evaluations[name]), numbers(evaluation))
    kept = {path.name for path in (tmp_path / "2" / "solutions").iterdir()}
    assert kept == {"fem.npz", "fem-nonlinear.npz"}
    for solver in (FemSolver, FemNonlinearSolver):
        monkeypatch.setattr(solver, "solve", lambda *_: pytest.fail("solved again"))
    monkeypatch.setattr(solving, "LARGE", 10**9)  # in this process
    again, _ = solve(3, *solvers, out=tmp_path / "2", resume=True)
    assert again.evaluations["fem"].stats == two.evaluations["fem"].stats  # its seconds, too


def test_two_processes_have_about_as_much_to_do_and_shared_work_stays_together():
    names = ["fem", "fem-nonlinear", "pinn-std", "pinn-asm", "fem-asm", "fem-id", "pinn-id", "gp"]
    solvers = [make_solver(name) for name in names]
    here, there = solving.shares(solvers, Material(), 18_000)
    assert {"fem", "fem-asm", "pinn-std", "pinn-asm"} <= {each.name for each in here}
    assert [each for each in solvers if each in here] == here
    assert [each for each in solvers if each in there] == there
    assert sorted(map(names.index, (each.name for each in [*here, *there]))) == list(range(8))
    few, many = sorted(sum(Traits.of(each).cost.seconds(18_000) for each in part) for part in (here, there))
    assert many < 1.1 * few
    of_finite_strain = [each for each in solvers if "neo-hookean" in each.laws]
    assert all(solving.shares(of_finite_strain, Material(law="neo-hookean"), 18_000))


@pytest.mark.usefixtures("in_one_process")
def test_the_fault_of_a_solver_in_the_second_process_is_kept_for_the_reader(solve, tmp_path):
    outcome, _ = solve(2, FemSolver(), Ending("faulty"), Ending("unsupporting"), spare=["unsupporting"])
    assert list(outcome.evaluations) == ["fem"]
    assert outcome.failed["faulty"].startswith("solver faulty raised ZeroDivisionError: by nothing (")
    assert outcome.unsupported == {"unsupporting": "unsupporting: no markers here"}
    assert "raise ZeroDivisionError" in (tmp_path / "2" / "errors" / "faulty.txt").read_text()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "changes", "message"),
    [
        ("refusing", {}, r"^refusing: the weight is negative$"),
        ("unsupporting", {}, r"^unsupporting: no markers here$"),
        ("faulty", {"reference": "faulty"}, r"^solver faulty raised ZeroDivisionError"),
    ],
)
@pytest.mark.usefixtures("in_one_process")
def test_a_refusal_in_the_second_process_is_one_line_of_the_first(solve, name, changes, message):
    with pytest.raises(UserError, match=message) as refused:
        solve(2, FemSolver(), Ending(name), **changes)
    assert type(refused.value) is UserError  # which another process can raise


def test_the_end_of_a_second_process_is_one_line_of_the_first(solve):
    with pytest.raises(UserError, match=r"^killed: its process ended with exit code -9; a resumed run"):
        solve(2, Ending("reporting", laws=("linear",)), Ending("killed"))


@pytest.mark.parametrize(
    ("name", "ending"),
    [("silent", signal.SIGKILL), pytest.param("reporting", signal.SIGTERM, marks=pytest.mark.slow)],
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
    children = [int(program.stdout.readline()) for _ in range(2)]
    program.send_signal(ending)
    program.communicate(timeout=60)
    limit = time.monotonic() + 2
    while any(map(alive, children)) and time.monotonic() < limit:
        time.sleep(0.02)
    assert not any(map(alive, children))


def alive(process: int) -> bool:
    try:
        os.kill(process, 0)
        return Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except (ProcessLookupError, FileNotFoundError):
        return False
