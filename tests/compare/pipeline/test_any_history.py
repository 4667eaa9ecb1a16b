"""Runs on one folder in any order: finished, interrupted, killed, refused, resumed, with damaged files.

A machine draws the history and knows which solutions each folder holds. Whatever came before, a run that
ends gives the numbers of the same run in a fresh folder, a run that does not leaves the last result as it
was, and a resumed run solves only what is not there.
"""

import hashlib
import json
import shutil
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

import pytest
from hypothesis import HealthCheck, Phase, settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, rule, run_state_machine_as_test

from pinnray.comparison.pipeline.job import Job
from pinnray.geometry.mesh.settings import MeshSettings
from pinnray.runtime.errors import UserError
from pinnray.solvers.fem.linear import FemSolver
from pinnray.solvers.problem import Problem
from pinnray.solvers.solution import Solution
from pinnray.solvers.solver import Progress, silent
from tests.compare.pipeline.runs import compare as run_quietly
from tests.solvers.conftest import SHORT

pytestmark = pytest.mark.slow

NAMES = ("first", "second", "third")
ENDINGS: dict[str, Callable[[], BaseException]] = {
    "interrupted": KeyboardInterrupt,
    "killed": KeyboardInterrupt,
    "refused": lambda: UserError("no"),
    "disk full": lambda: OSError(28, "No space left on device"),
}


@dataclass
class Watched:
    """`fem` under another name, which notes that it is called, and may not come to its end."""

    name: str
    degree: int
    called: Callable[[str], None]
    laws: ClassVar[tuple[str, ...]] = ("linear",)
    loads: ClassVar[tuple[str, ...]] = ("mean", "point")

    def settings(self) -> dict[str, object]:
        return {"degree": self.degree}

    def solve(self, problem: Problem, progress: Progress = silent) -> Solution:
        self.called(self.name)
        return FemSolver(degree=self.degree).solve(problem, progress)


class Histories(RuleBasedStateMachine):
    """Runs on one folder.

    Attributes:
        known: For `out` and `out.partial` the degrees of the solutions that are whole, by solver.
    """

    fresh: ClassVar[dict[tuple[object, ...], Any]] = {}
    """What jobs give in a fresh folder."""

    @initialize()
    def start(self) -> None:
        self.home = Path(tempfile.mkdtemp(prefix="history-"))
        self.known: dict[str, dict[str, int]] = {"out": {}, "out.partial": {}}

    def teardown(self) -> None:
        shutil.rmtree(self.home, ignore_errors=True)

    @rule(
        names=st.permutations(NAMES).flatmap(lambda all_: st.integers(1, 3).map(lambda n: tuple(all_[:n]))),
        degree=st.sampled_from([1, 2]),
        resume=st.booleans(),
        ending=st.none() | st.tuples(st.sampled_from(NAMES), st.sampled_from(sorted(ENDINGS))),
    )
    def compare(
        self, names: tuple[str, ...], degree: int, resume: bool, ending: tuple[str, str] | None
    ) -> None:
        before = contents(self.home / "out")
        expected, left = self.expected(names, degree, resume, ending)
        calls: list[str] = []
        snapshot = self.home.with_name(f"{self.home.name}-killed")

        def called(name: str) -> None:
            calls.append(name)
            if ending and name == ending[0]:
                if ending[1] == "killed":
                    shutil.copytree(self.home, snapshot)
                raise ENDINGS[ending[1]]()

        ends = bool(ending and ending[0] in expected)
        try:
            made = finish(self.home / "out", names, degree, resume, called)
        except (KeyboardInterrupt, UserError, OSError):
            assert ends
            if snapshot.exists():
                shutil.rmtree(self.home)
                snapshot.replace(self.home)
            assert contents(self.home / "out") == before
            self.known["out.partial"] = left
        else:
            assert not ends
            assert made == self.alone(names, degree)
            assert [path.name for path in self.home.iterdir()] == ["out"]
            check_digests(self.home / "out")
            self.known = {"out": left, "out.partial": {}}
        assert calls == expected

    @rule(
        where=st.sampled_from(["out", "out.partial"]), name=st.sampled_from(NAMES), share=st.floats(0, 0.99)
    )
    def damage(self, where: str, name: str, share: float) -> None:
        path = self.home / where / "solutions" / f"{name}.npz"
        if path.exists():
            path.write_bytes(path.read_bytes()[: int(share * path.stat().st_size)])
            self.known[where].pop(name, None)

    @rule(where=st.sampled_from(["out", "out.partial"]))
    def remove(self, where: str) -> None:
        shutil.rmtree(self.home / where, ignore_errors=True)
        self.known[where] = {}

    def expected(
        self, names: Sequence[str], degree: int, resume: bool, ending: tuple[str, str] | None
    ) -> tuple[list[str], dict[str, int]]:
        """The solvers that must be called, and the solutions that the run then has."""
        partial, out = self.known["out.partial"], self.known["out"]
        left = {name: partial[name] for name in names if name in partial} if resume else {}
        calls = []
        for name in names:
            if not (resume and degree in (left.get(name), out.get(name))):
                calls.append(name)
                if ending and ending[0] == name:
                    break
            left[name] = degree
        return calls, left

    def alone(self, names: tuple[str, ...], degree: int) -> Any:
        """The numbers of a job in a fresh folder."""
        if (names, degree) not in self.fresh:
            with tempfile.TemporaryDirectory() as folder:
                self.fresh[names, degree] = finish(Path(folder) / "out", names, degree, False, lambda _: None)
        return self.fresh[names, degree]


def finish(out: Path, names: Sequence[str], degree: int, resume: bool, called: Callable[[str], None]) -> Any:
    """Run a job and give its numbers, without times."""
    solvers = [Watched(name, degree, called) for name in names]
    job = Job(SHORT, solvers, mesh=MeshSettings(size=2.0), measurements=MEASURED, out=out, resume=resume)
    run_quietly(job)
    numbers = json.loads((out / "metrics.json").read_text(encoding="utf-8"))
    for solver in numbers["solvers"].values():
        del solver["seconds"], solver["stats"]
    return numbers


def contents(folder: Path) -> dict[str, str]:
    """Digests of the files of a folder."""
    return {
        path.relative_to(folder).as_posix(): hashlib.sha256(path.read_bytes()).hexdigest()
        for path in folder.rglob("*")
        if path.is_file()
    }


def check_digests(folder: Path) -> None:
    """Every file that `run.json` lists is there, whole, and no other."""
    listed = json.loads((folder / "run.json").read_text(encoding="utf-8"))["files_sha256"]
    found = contents(folder)
    del found["run.json"]
    assert found == listed


MEASURED = Path()
"""Table of the measured markers; set by the test."""


@pytest.mark.filterwarnings("ignore:.* is damaged .* and is made again")
def test_any_history_ends_with_the_numbers_of_a_fresh_folder(
    without_pictures, few_elements, monkeypatch, tmp_path
):
    measured = tmp_path / "measured.csv"
    measured.write_text("x_mm,y_mm,u_mm,v_mm\n12,-1,-0.5,-5\n40,-1,-2,-0.5\n", encoding="utf-8")
    monkeypatch.setitem(globals(), "MEASURED", measured)
    run_state_machine_as_test(
        Histories,
        settings=settings(
            max_examples=3,
            stateful_step_count=9,
            deadline=None,
            derandomize=True,
            database=None,
            phases=[Phase.generate],  # a shorter history of a failure takes minutes to find
            suppress_health_check=list(HealthCheck),
        ),
    )
