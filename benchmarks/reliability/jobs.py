"""The commands that are killed, and how each is asked to go on."""

import os
import shutil
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from benchmarks.reliability.supervision import Ending, Fault, supervised

CACHE, OUT, TEMPORARY = "cache", "out", "tmp"


class Job(NamedTuple):
    """A command with its inputs; `FOLDER` stands for the folder that it runs in."""

    name: str
    arguments: tuple[str, ...]
    again: tuple[str, ...] = ()  # further arguments of the run that goes on
    earlier: tuple[str, ...] = ()  # arguments of a run that is finished before, if any
    warm: bool = True  # whether meshes and virtual experiments are in the cache before
    whole: bool = True  # whether the output folder is replaced as a whole
    watched: tuple[str, ...] = (OUT, f".{OUT}", CACHE)  # folders whose changes count


def _words(line: str, out: str = "out") -> tuple[str, ...]:
    return tuple(f"{line} --out FOLDER/{out} --quiet".split())


FEM, THREE, TWO = (
    _words(f"compare --design default --mesh-size 4 --solvers {solvers}")
    for solvers in ("fem", "fem,gp,statfem", "fem,fem-nonlinear")
)
RIG = "rig --mesh-size 4 --frame 320x240 --rest 4 --moving 2 --held 4 --codec png"
TRACK = _words("track FOLDER/film/frames --camera FOLDER/film/camera.json")
CROSSVAL = _words("crossval --solvers fem --schemes one-out --seeds 1 --mesh-size 4 --processes 1")
GRIDSEARCH = _words(
    "gridsearch --mesh-size 4 --epochs 4 --learning-rates 1e-3,1e-2 --bc-weights 1 --processes 1 "
    "--solver-set pinn-std.checkpoint_every=2"
)
STUDY = "mesh_size = 4.0\nsamples = 3\n[varied]\nrib_angle = {from = -10, to = 20}\n"
JOBS = (
    Job("compare", FEM, again=("--resume",)),
    Job("compare over an older result", FEM, again=("--resume",), earlier=FEM),
    Job("compare of three solvers", THREE, again=("--resume",)),
    Job("compare in two processes", TWO, again=("--resume",)),
    Job("cache", FEM, again=("--resume",), warm=False, watched=(CACHE, TEMPORARY)),
    Job("sweep", _words("sweep FOLDER/study.toml --processes 1"), whole=False),
    Job("rig", _words(RIG)),
    Job("track", TRACK, earlier=_words(RIG, "film")),
    Job("crossval", CROSSVAL, whole=False),
    Job("gridsearch", GRIDSEARCH, whole=False),
)


def started(
    arguments: Sequence[str], folder: Path, watched: Sequence[str] = (), fault: Fault | None = None
) -> Ending:
    """Run a command in a forked process with cache and temporary files in a folder."""
    (folder / TEMPORARY).mkdir(exist_ok=True)

    def work() -> int:
        os.environ.update(PINNRAY_CACHE=str(folder / CACHE), TMPDIR=str(folder / TEMPORARY))
        tempfile.tempdir = None
        from pinnray.cli import main

        return main([each.replace("FOLDER", str(folder)) for each in arguments])

    log = folder.parent / f"{folder.name}.log"
    return supervised(work, [folder / each for each in watched], log, fault=fault)


def prepared(job: Job, folder: Path, cache: Path) -> None:
    """Fill a new folder with what a job needs before it starts; the cache was filled before."""
    folder.mkdir(parents=True)
    shutil.copytree(cache, folder / CACHE)
    (folder / "study.toml").write_text(STUDY, encoding="utf-8")
    if job.earlier and (ending := started(job.earlier, folder)).code:
        raise RuntimeError(ending.text)
    if not job.warm:
        shutil.rmtree(folder / CACHE)
