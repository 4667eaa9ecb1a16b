"""The paper's networks in the main job and the search: killed or interrupted, they go on to the same bits."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from io import StringIO
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console

from pinnray.comparison.pipeline.job import Job
from pinnray.comparison.pipeline.pipeline import run
from pinnray.runtime.errors import UserError
from pinnray.runtime.stages import Stages
from pinnray.solvers.problem import Load
from pinnray.solvers.registry import make_solver
from pinnray.solvers.solver import Progress
from tests.compare.pipeline.runs import compare

pytestmark = pytest.mark.usefixtures("few_elements")

ROOT = Path(__file__).parents[3]
TINY = {"preset": "paper", "width": 4, "layers": 1, "base_points": 5, "checkpoint_every": 5, "threads": 1}


class Interrupting(Stages):
    """Stages that are interrupted when one of them is halfway, as by Ctrl-C."""

    def __init__(self, name: str) -> None:
        super().__init__(Console(file=StringIO()), quiet=True)
        self._name = name

    @contextmanager
    def stage(self, name: str) -> Iterator[Progress]:
        with super().stage(name) as report:

            def interrupted(fraction: float, note: str) -> None:
                report(fraction, note)
                if name == self._name and 0.5 <= fraction < 1:
                    raise KeyboardInterrupt

            yield interrupted


@pytest.fixture
def paper_job(job: Callable[..., Job], tmp_path: Path) -> Job:
    return job(make_solver("pinn-std", **TINY, epochs=13), out=tmp_path / "run")


def bits(out: Path) -> dict[str, bytes]:
    """Every array of the solution but its times."""
    with np.load(out / "solutions" / "pinn-std.npz") as archive:
        kept = (name for name in archive.files if name not in ("header", "history_seconds"))
        return {name: archive[name].tobytes() for name in kept}


def record(folder: Path) -> list[str]:
    """The header and a line for every epoch, with its time: what was trained again has another one."""
    return (folder / "history.csv").read_text().splitlines()


def test_an_interrupted_run_ends_as_if_it_had_not_been(paper_job, tmp_path):
    compare(replace(paper_job, out=tmp_path / "whole"))
    with Interrupting("pinn-std") as stages, pytest.raises(KeyboardInterrupt):
        run(paper_job, stages)
    left = tmp_path / "run.partial" / "training" / "pinn-std"
    assert (left / "checkpoint.safetensors").is_file()
    before = record(left)
    assert 1 < len(before) < 13
    compare(replace(paper_job, resume=True))
    assert bits(paper_job.out) == bits(tmp_path / "whole")
    assert record(paper_job.out / "training" / "pinn-std")[: len(before)] == before
    assert sorted(path.name for path in (paper_job.out / "training" / "pinn-std").iterdir()) == [
        "checkpoint.safetensors",
        "history.csv",
    ]


def test_a_checkpoint_of_another_job_is_refused_in_one_line(paper_job):
    with Interrupting("pinn-std") as stages, pytest.raises(KeyboardInterrupt):
        run(paper_job, stages)
    other = replace(paper_job, load=Load(displacement=(0.0, -9.0)), resume=True)
    with pytest.raises(UserError, match=r"checkpoint\.safetensors belongs to another problem [^\n]*$"):
        compare(other)
