"""The paper's networks in the main job and the search: killed or interrupted, they go on to the same bits."""

import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from io import StringIO
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console

from compare.gridsearch.search import GridSearch, search_grid
from compare.pipeline import Job, run
from compare.runtime.exits import NOT_CONVERGED
from compare.runtime.stages import Stages
from geometry.errors import UserError
from geometry.finger.design import Design
from geometry.mesh.settings import MeshSettings
from solvers.problem import Load, Material
from solvers.registry import make_solver
from solvers.solver import Progress

ROOT = Path(__file__).parent.parent.parent
COARSE = MeshSettings(size=1.0)
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


def quiet() -> Stages:
    return Stages(Console(file=StringIO()), quiet=True)


@pytest.fixture
def job(tmp_path: Path, without_pictures: None) -> Job:
    measured = tmp_path / "measured.csv"
    measured.write_text("x_mm,y_mm,u_mm,v_mm\n20,-1,-0.5,-5\n")
    solvers = [make_solver("pinn-std", **TINY, epochs=13)]
    return Job(Design(), solvers, mesh=COARSE, measurements=measured, out=tmp_path / "run")


def bits(out: Path) -> dict[str, bytes]:
    """Every array of the solution but its times."""
    with np.load(out / "solutions" / "pinn-std.npz") as archive:
        kept = (name for name in archive.files if name not in ("header", "history_seconds"))
        return {name: archive[name].tobytes() for name in kept}


def record(folder: Path) -> list[str]:
    """The header and a line for every epoch, with its time: what was trained again has another one."""
    return (folder / "history.csv").read_text().splitlines()


def test_an_interrupted_run_ends_as_if_it_had_not_been(job, tmp_path):
    with quiet() as stages:
        run(replace(job, out=tmp_path / "whole"), stages)
    with Interrupting("pinn-std") as stages, pytest.raises(KeyboardInterrupt):
        run(job, stages)
    left = tmp_path / "run.partial" / "training" / "pinn-std"
    assert (left / "checkpoint.safetensors").is_file()
    before = record(left)
    assert 1 < len(before) < 13
    with quiet() as stages:
        run(replace(job, resume=True), stages)
    assert bits(job.out) == bits(tmp_path / "whole")
    assert record(job.out / "training" / "pinn-std")[: len(before)] == before
    assert sorted(path.name for path in (job.out / "training" / "pinn-std").iterdir()) == [
        "checkpoint.safetensors",
        "history.csv",
    ]


def test_a_checkpoint_of_another_job_is_refused_in_one_line(job):
    with Interrupting("pinn-std") as stages, pytest.raises(KeyboardInterrupt):
        run(job, stages)
    other = replace(job, load=Load(displacement=(0.0, -9.0)), resume=True)
    with quiet() as stages, pytest.raises(UserError) as refused:
        run(other, stages)
    assert re.fullmatch(r".*checkpoint\.safetensors belongs to another problem .*", str(refused.value))


WITHOUT_PICTURES = """
import sys
from compare import pipeline
from compare.cli import main

pipeline.draw_all = lambda *_, **__: []
sys.exit(main(sys.argv[1:]))
"""


@pytest.mark.slow
def test_a_killed_run_ends_as_if_it_had_not_been(job, tmp_path):
    """Killed without notice, it goes on from the last checkpoint that it wrote.

    All in processes of their own: the order in which a process loads torch and PETSc, each with its BLAS, was
    seen to change the last bits.
    """
    line = f"compare --solvers pinn-std --mesh-size 1.0 --quiet --measurements {job.measurements}"
    line += "".join(f" --solver-set pinn-std.{key}={value}" for key, value in {**TINY, "epochs": 300}.items())

    def started(*options: str) -> subprocess.Popen[bytes]:
        return subprocess.Popen(
            [sys.executable, "-c", WITHOUT_PICTURES, *line.split(), *options],
            env={**os.environ, "PYTHONPATH": str(ROOT)},
            stderr=subprocess.DEVNULL,
        )

    whole, killed = started("--out", str(tmp_path / "whole")), started("--out", str(job.out))
    left = tmp_path / "run.partial" / "training" / "pinn-std"
    limit = time.monotonic() + 60
    while not (left / "history.csv").exists() and time.monotonic() < limit:
        time.sleep(0.005)
    killed.kill()
    assert killed.wait() == -signal.SIGKILL
    assert not job.out.exists()
    before = record(left)
    resumed = started("--out", str(job.out), "--resume")
    assert resumed.wait() == whole.wait() == NOT_CONVERGED
    assert bits(job.out) == bits(tmp_path / "whole")
    assert record(job.out / "training" / "pinn-std")[: len(before)] == before


@pytest.mark.slow
def test_an_interrupted_search_ends_as_if_it_had_not_been(tmp_path):
    def wanted(name: str) -> GridSearch:
        return GridSearch(
            design=Design(),
            mesh=COARSE,
            material=Material(),
            load=Load(),
            learning_rates=(1e-3,),
            bc_weights=(10.0,),
            settings={**TINY, "epochs": 60},
            out=tmp_path / name,
            processes=1,
        )

    with quiet() as stages:
        (whole,) = search_grid(wanted("whole"), stages)
    run_name = wanted("run").points[0].name
    with Interrupting(run_name) as stages, pytest.raises(KeyboardInterrupt):
        search_grid(wanted("run"), stages)
    before = record(tmp_path / "run" / "runs" / run_name)
    with quiet() as stages:
        (resumed,) = search_grid(wanted("run"), stages)
    assert record(tmp_path / "run" / "runs" / run_name)[: len(before)] == before
    assert whole.measured is not None
    assert resumed.measured is not None
    for name in ("rel_l2_displacement", "energy", "loss", "epochs", "boundary_violation"):
        assert getattr(resumed.measured, name) == getattr(whole.measured, name)


@pytest.mark.slow
def test_a_run_of_the_search_that_diverges_is_recorded(tmp_path):
    wanted = GridSearch(
        design=Design(),
        mesh=COARSE,
        material=Material(),
        load=Load(),
        learning_rates=(1e30,),
        bc_weights=(10.0,),
        settings={**TINY, "epochs": 20},
        out=tmp_path / "search",
        processes=1,
    )
    with quiet() as stages:
        (diverged,) = search_grid(wanted, stages)
    assert diverged.status == "diverged"
    assert "learning_rate" in diverged.message
