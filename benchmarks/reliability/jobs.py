"""The commands that are killed, and how each is asked to go on."""

import os
import shutil
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from benchmarks.reliability.supervision import Ending, Fault, supervised

CACHE, OUT, TEMPORARY = "cache", "out", "tmp"


@dataclass(frozen=True)
class Job:
    """A command with its inputs.

    Attributes:
        name: Of the row in the table.
        arguments: Of `pinnray`; `FOLDER` stands for the folder that it runs in.
        again: Further arguments of the run that goes on.
        earlier: Arguments of runs that are finished before.
        warm: Whether meshes and virtual experiments are in the cache before.
        whole: Whether the output folder is replaced as a whole.
        watched: Folders whose changes count.
        files: Texts of input files by name.
    """

    name: str
    arguments: tuple[str, ...]
    again: tuple[str, ...] = ()
    earlier: tuple[tuple[str, ...], ...] = ()
    warm: bool = True
    whole: bool = True
    watched: tuple[str, ...] = (OUT, f".{OUT}", CACHE)
    files: tuple[tuple[str, str], ...] = ()


def _comparison(solvers: str) -> tuple[str, ...]:
    return (
        *("compare", "--design", "default", "--solvers", solvers, "--mesh-size", "4"),
        *("--out", "FOLDER/out", "--quiet"),
    )


FEM = _comparison("fem")
RIG = (
    *("rig", "--mesh-size", "4", "--size", "320x240", "--rest", "4", "--moving", "2", "--held", "4"),
    *("--codec", "png", "--quiet"),
)
STUDY = """mesh_size = 4.0
samples = 3
[varied]
rib_angle = {from = -10, to = 20}
"""

JOBS = (
    Job("compare", FEM, again=("--resume",)),
    Job("compare over an older result", FEM, again=("--resume",), earlier=(FEM,)),
    Job("compare of three solvers", _comparison("fem,gp,statfem"), again=("--resume",)),
    Job("compare in two processes", _comparison("fem,fem-nonlinear"), again=("--resume",)),
    Job("cache", FEM, again=("--resume",), warm=False, watched=(CACHE, TEMPORARY)),
    Job(
        "sweep",
        ("sweep", "FOLDER/study.toml", "--processes", "1", "--out", "FOLDER/out", "--quiet"),
        whole=False,
        files=(("study.toml", STUDY),),
    ),
    Job("rig", (*RIG, "--out", "FOLDER/out")),
    Job(
        "track",
        (
            "track",
            "FOLDER/film/frames",
            "--camera",
            "FOLDER/film/camera.json",
            "--out",
            "FOLDER/out",
            "--quiet",
        ),
        earlier=((*RIG, "--out", "FOLDER/film"),),
    ),
    Job(
        "crossval",
        (
            *("crossval", "--solvers", "fem", "--schemes", "one-out", "--seeds", "1", "--mesh-size", "4"),
            *("--processes", "1", "--out", "FOLDER/out", "--quiet"),
        ),
        whole=False,
    ),
    Job(
        "gridsearch",
        (
            *(
                "gridsearch",
                "--mesh-size",
                "4",
                "--epochs",
                "4",
                "--learning-rates",
                "1e-3,1e-2",
                "--bc-weights",
            ),
            *("1", "--processes", "1", "--solver-set", "pinn-std.checkpoint_every=2"),
            *("--out", "FOLDER/out", "--quiet"),
        ),
        whole=False,
    ),
)


def started(
    arguments: Sequence[str], folder: Path, watched: Sequence[str] = (), fault: Fault | None = None
) -> Ending:
    """Run a command in a forked process with cache and temporary files in a folder."""
    given = [each.replace("FOLDER", str(folder)) for each in arguments]
    (folder / TEMPORARY).mkdir(exist_ok=True)
    return supervised(
        _work(given, folder),
        [folder / each for each in watched],
        folder.parent / f"{folder.name}.log",
        fault=fault,
    )


def prepared(job: Job, folder: Path, cache: Path) -> None:
    """Fill a new folder with what a job needs before it starts.

    Args:
        job: The job.
        folder: The folder.
        cache: A cache that was filled before.
    """
    folder.mkdir(parents=True)
    shutil.copytree(cache, folder / CACHE)
    for name, text in job.files:
        (folder / name).write_text(text, encoding="utf-8")
    for arguments in job.earlier:
        if (ending := started(arguments, folder)).code:
            raise RuntimeError(ending.text)
    if not job.warm:
        shutil.rmtree(folder / CACHE)


def _work(arguments: list[str], folder: Path) -> Callable[[], int]:
    def work() -> int:
        os.environ["PINNRAY_CACHE"] = str(folder / CACHE)
        os.environ["TMPDIR"] = str(folder / TEMPORARY)
        tempfile.tempdir = None
        from compare.cli import main

        return main(arguments)

    return work
