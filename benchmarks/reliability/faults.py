"""A fault at every change of a file of commands: what they leave, and whether the same command goes on.

Each command runs in a forked process whose changes of files are counted. Then it runs again for each,
with a fault there: killed before it, a disk that is full from there on, one failed call. After each, no
process is left and no file is in part under its final name; an output folder that is replaced as a whole is
the last result or the new one; an error is told in one line; and the same command gives the numbers of an
undisturbed run to the bit. x86-64 Linux only. `--rows rig` tries the jobs with this word in their names; all
take some five hours of one core. Broken promises are printed as they are found.
"""

import os
import re
import shutil
import sys
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from itertools import groupby
from pathlib import Path
from unittest.mock import patch

os.environ.setdefault("OMP_NUM_THREADS", "1")  # one thread: numbers are to agree to the bit

from rich.table import Table

from benchmarks.reliability.folders import CUT, numbers
from benchmarks.reliability.supervision import GROWING, KINDS, Ending, Fault, Point, supervised
from pinnray.runtime.exits import BAD_INPUT, NOT_CONVERGED
from pinnray.runtime.tables import terminal_table

CACHE, OUT, TEMPORARY = "cache", "out", "tmp"
WATCHED = (OUT, f".{OUT}", CACHE)
"""Folders whose changes count."""

FEM = "compare --design default --mesh-size 4 --solvers fem"
RIG = "rig --mesh-size 4 --size 320x240 --rest 4 --moving 2 --held 4 --codec png"
TRACK = "track FOLDER/film/frames --camera FOLDER/film/camera.json"
JOBS = {
    "compare": (FEM,),
    "compare over an older result": (FEM, FEM),
    "sweep": ("sweep FOLDER/study.toml --processes 1",),
    "rig": (RIG,),
    "track": (f"{RIG} --out FOLDER/film", TRACK),
    "crossval": ("crossval --solvers fem --schemes one-out --seeds 1 --mesh-size 4 --processes 1",),
}
"""Commands by name, the last of which meets the faults; `FOLDER` stands for the folder that it runs in."""
REPLACING = ("compare", "rig", "track")
"""Commands that replace their output folder as a whole."""
STUDY = "mesh_size = 4.0\nsamples = 3\n[varied]\nrib_angle = {from = -10, to = 20}\n"


def main(rows: str = "") -> Table:
    """Try the jobs with one of the words in their names, and return a row for each."""
    lines = []
    with tempfile.TemporaryDirectory(prefix="reliability-") as folder, filled(Path(folder)) as cache:
        for name, commands in JOBS.items():
            if any(word in name for word in rows.split(",")):
                tried = trials(commands, Path(folder) / "job", cache)
                promised = sum(not wrong for wrong in tried.values())
                lines.append([name, *map(str, (len({fault.at for fault in tried}), len(tried), promised))])
    return terminal_table("faults", ("job", "points", "faults", "as promised"), lines, left=["job"])


def trials(commands: Sequence[str], place: Path, cache: Path, every: int = 1) -> dict[Fault, list[str]]:
    """The promises that a command breaks after each fault, or every so manieth of them."""
    before, run = place / "before", place / "trial"  # always the same: files name the folder they come from
    before.mkdir(parents=True)
    shutil.copytree(cache, before / CACHE)
    (before / "study.toml").write_text(STUDY, encoding="utf-8")
    for earlier in commands[:-1]:
        ended_well(started(earlier, before))
    shutil.copytree(before, run)
    points = ended_well(started(commands[-1], run)).points
    expected = numbers(run / OUT)
    tried = {}
    for fault in faults(points)[::every]:
        shutil.rmtree(run)
        shutil.copytree(before, run)
        tried[fault] = trial(commands[-1], expected, fault, run)
        if tried[fault]:
            print(commands[-1], *fault, *points[fault.at], *tried[fault], file=sys.stderr, flush=True)
    shutil.rmtree(place)
    return tried


def faults(points: Sequence[Point]) -> list[Fault]:
    """Every fault at every point that differs; a full disk stops what needs more of it.

    Of a series of equal calls on a file the first, the middle and the last differ.
    """
    chosen: list[int] = []
    for _, group in groupby(range(len(points)), key=lambda at: (points[at].call, plain(points[at].path))):
        series = list(group)
        chosen += sorted({series[0], series[len(series) // 2], series[-1]})
    return [
        Fault(kind, at) for kind in KINDS for at in chosen if kind != "ENOSPC" or points[at].call in GROWING
    ]


def plain(path: str) -> str:
    """A path without the number that makes a temporary file unique."""
    return re.sub(r"\.[0-9a-f]{8}\.partial", ".partial", path)


def started(line: str, folder: Path, fault: Fault | None = None) -> Ending:
    """Run a command in a forked process with output, cache and temporary files in a folder."""
    (folder / TEMPORARY).mkdir(exist_ok=True)
    words = [] if " --out " in line else ["--out", f"FOLDER/{OUT}"]
    words = [word.replace("FOLDER", str(folder)) for word in (*line.split(), *words, "--quiet")]

    def work() -> int:
        os.environ.update(PINNRAY_CACHE=str(folder / CACHE), TMPDIR=str(folder / TEMPORARY))
        tempfile.tempdir = None
        from pinnray.cli import main

        return main(words)

    log = folder.parent / f"{folder.name}.log"
    return supervised(work, [folder / each for each in WATCHED], log, fault=fault)


def ended_well(ending: Ending) -> Ending:
    """The end of a run without a fault; a `RuntimeError` if it is none."""
    if ending.code not in (0, NOT_CONVERGED) or "Traceback" in ending.text:
        raise RuntimeError(f"it ends with {ending.code}: {ending.text.strip()[-300:]}")
    return ending


def trial(line: str, expected: dict[str, str], fault: Fault, folder: Path) -> list[str]:
    """Try a fault in a folder that is as it was before the run, and return the promises broken."""
    out, before, command = folder / OUT, numbers(folder / OUT), line.split()[0]
    hit = started(line, folder, fault)
    wrong = {
        "the point was not reached": len(hit.points) <= fault.at,
        "processes were left over": hit.orphans,
        "the output folder holds neither the last result nor the new": command in REPLACING
        and numbers(out) not in (before, expected),
    }
    for place in (*folder.glob("*out*"), folder / CACHE):
        wrong |= {f"half written: {place.name}/{name}": each == CUT for name, each in numbers(place).items()}
    if fault.kind in ("ENOSPC", "EIO"):
        told = sum(each.startswith("error:") for each in hit.text.splitlines())
        wrong[f"it ended with {hit.code}: {hit.text.strip()[-300:]}"] = (
            hit.code not in (0, BAD_INPUT, NOT_CONVERGED)
            or "Traceback" in hit.text
            or (hit.code == BAD_INPUT and told != 1)
            or (hit.code == 0 and numbers(out) != expected)
        )
    try:
        ended_well(started(f"{line} --resume" if command == "compare" else line, folder))
        wrong["the next run has other numbers"] = numbers(out) != expected
    except RuntimeError as error:
        wrong[f"the next run: {error}"] = True
    return [said for said, broken in wrong.items() if broken]


@contextmanager
def filled(folder: Path) -> Iterator[Path]:
    """A filled cache in a folder; in the block this process has imported what its forks need."""
    ended_well(started(FEM, folder))
    from pinnray.cli import main
    from pinnray.comparison.figures import gallery
    from pinnray.runtime.figure import Figure

    blank = gallery.Illustration(Figure(1.0), "Blank", "Blank.")
    drawings = {name: (what, lambda *_: blank) for name, (what, _) in gallery.GALLERY.items()}
    # The same files with blank pictures, in a tenth of the time.
    with patch.object(gallery, "GALLERY", drawings), patch("pinnray.runtime.figure.DPI", 20):
        with patch.dict(os.environ, PINNRAY_CACHE=str(folder / CACHE)):
            main([*FEM.split(), "--out", f"{folder}/out", "--quiet"])
        shutil.rmtree(folder / "out")
        yield folder / CACHE
