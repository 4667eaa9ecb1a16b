"""Coverage-guided fuzzing of the readers of files that people give, by Atheris.

`python -m benchmarks.reliability.fuzzing SECONDS [READER ...]` (`pip install atheris`) fuzzes the readers in
turn and adds to the counts. It starts from the files in `seeds`, whose first gives the name of the file that
is read, in a process that is started anew where a C library ended it. Files that reached new branches or were
not handled are kept below `out`, and a later time goes on from them.
"""

import json
import logging
import multiprocessing
import os
import pydoc
import re
import resource
import shutil
import sys
import tempfile
import time
import traceback
import warnings
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from benchmarks.tables import keep_rows, kept_rows
from geometry.atomic import write_text
from geometry.errors import UserError

ROWS, SEEDS = Path(__file__).with_name("fuzzing.csv"), Path(__file__).with_name("seeds")
KEPT = Path("out/reliability/fuzzing")
LONGEST_S, GRACE_S = 10, 60.0
"""Times that one file may take, and a process to start and to end, s."""


class Row(NamedTuple):
    """Counts of a reader over all times, in seconds and bytes: files, and those that it took.

    Of the last time alone: places of exceptions that are no refusal, ends by a C library.
    """

    reader: str
    runs: int = 0
    read: int = 0
    slowest: float = 0.0
    peak: int = 0
    seconds: float = 0.0
    unhandled: int = 0
    ended: int = 0


class Reader(NamedTuple):
    """A function that reads a file, and the largest file that is tried, bytes."""

    function: str
    call: Callable[[Any, Path], object] = lambda read, path: read(path)
    longest: int = 4096


def _counted(read: Any, path: Path) -> int:
    return sum(1 for _ in read(path))


READERS = {
    "design": Reader("geometry.finger.presets.load_design"),
    "study": Reader("studies.sweep.study.load_study"),
    "options": Reader("pinnray.options.file.read_options_file"),
    "description": Reader("geometry.drawing.description.load_description"),
    "measurements": Reader(
        "vision.measurements.read_measurements", lambda read, path: read(path, marker_radius=0.8)
    ),
    "camera": Reader("vision.calibration.camera_file.load_camera"),
    "workspace": Reader("vision.tracking.workspace.load_workspace"),
    "svg": Reader("geometry.drawing.formats.svg.read_svg"),
    "dxf": Reader("geometry.drawing.formats.dxf.read_dxf", longest=32768),
    "msh": Reader("geometry.drawing.formats.msh.read_msh"),
    "picture": Reader("vision.frames.pictures.images_of_files", lambda read, path: list(read([path], 30.0))),
    "video": Reader("vision.frames.video.video_frames", _counted, longest=16384),
    "mesh archive": Reader("geometry.mesh.triangle_mesh.TriangleMesh.load"),
    "checkpoint": Reader(
        "solvers.pinn.paper.checkpoint.load_checkpoint", lambda read, path: read(path.parent, "digest")
    ),
}
"""By the names of their folders of seeds."""


def taken(reader: Reader, read: Any, path: Path) -> bool:
    """Whether a file can be read; a refusal in one line is right, other exceptions are faults."""
    try:
        reader.call(read, path)
    except UserError as error:
        if not str(error).strip() or "\n" in str(error):
            raise ValueError(f"no single line: {str(error)!r}") from error
        return False
    except Exception:
        if "TriangleMesh" in reader.function:  # its callers make a damaged file of the cache again
            return False
        raise
    return True


def fuzz(name: str, seconds: float, folder: Path) -> None:
    """Fuzz a reader in this process until the time is over; writes counts and files into a folder."""
    import atheris

    reader, seeds = READERS[name], sorted((SEEDS / name).iterdir())
    guides = [reader.function.rsplit(".", 2)[0], "geometry.drawing", "geometry.text_files", "numpy.lib"]
    with atheris.instrument_imports(include=guides, enable_loader_override=False):
        read = pydoc.locate(reader.function)
    if name == "design":  # a refusal tries a thousand others to propose ranges
        from geometry.finger import validation

        validation._ranges = lambda *_: []
    warnings.simplefilter("ignore")
    logging.disable(logging.CRITICAL)
    place, corpus, words = folder / seeds[0].name, folder / "corpus", folder / "words"
    corpus.mkdir(exist_ok=True)
    for seed in seeds:
        shutil.copy(seed, corpus)
    texts = [seed.read_bytes().decode("ascii", errors="ignore") for seed in seeds]
    known = {word for text in texts if "\0" not in text for word in re.findall(r"[\w-]{1,29}", text)}
    known |= {"nan", "inf", "1e999", "-1", "0", "[[", "{}"}
    words.write_text("".join(f'"{word}"\n' for word in sorted(known)))
    started, row, wrong = time.monotonic(), Row(name), dict[str, str]()

    def keep() -> None:
        peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024
        counts = row._replace(seconds=time.monotonic() - started, peak=peak)
        write_text(folder / "found.json", json.dumps({"row": counts, "wrong": wrong}))

    def one(data: bytes) -> None:
        nonlocal row
        begun, good = time.monotonic(), False
        if len(data) <= reader.longest:
            place.write_bytes(data)
            try:
                good = taken(reader, read, place)
            except Exception as error:
                frames = traceback.extract_tb(error.__traceback__)
                own = [frame for frame in frames if "site-packages" not in frame.filename][-1]
                key = f"{type(error).__name__} at {Path(own.filename).name}:{own.name}"
                if key not in wrong:
                    wrong[key] = f"{type(error).__name__}: {str(error)[:200]}"
                    (folder / f"wrong-{len(wrong)}{place.suffix}").write_bytes(data)
        slowest = max(row.slowest, time.monotonic() - begun)
        row = row._replace(runs=row.runs + 1, read=row.read + good, slowest=slowest)
        over = time.monotonic() - started > seconds
        if over or row.runs % 200 == 0:
            keep()
        if over:
            os._exit(0)

    options = f"-dict={words} -artifact_prefix={folder}/crash- -max_len={reader.longest} -verbosity=0"
    options += f" -timeout={2 * LONGEST_S} -rss_limit_mb=4096"
    atheris.Setup([sys.argv[0], str(corpus), *options.split()], one)
    atheris.Fuzz()


def fuzzed(row: Row, seconds: float) -> Row:
    """Fuzz the reader of a row, in as many processes as it takes, and add to its counts."""
    kept, wrong, row = KEPT / row.reader, dict[str, str](), row._replace(ended=0)
    end = time.monotonic() + seconds
    while (left := end - time.monotonic()) > 1:
        with tempfile.TemporaryDirectory() as place:
            folder = Path(place)
            if (kept / "corpus").is_dir():
                shutil.copytree(kept / "corpus", folder / "corpus")
            spawn = multiprocessing.get_context("spawn")
            process = spawn.Process(target=fuzz, args=(row.reader, left, folder))
            process.start()
            process.join(left + GRACE_S)
            process.kill()  # one that hangs where no alarm reaches it
            process.join()
            shutil.copytree(folder / "corpus", kept / "corpus", dirs_exist_ok=True)
            for path in [*folder.glob("wrong-*"), *folder.glob("crash-*")]:
                shutil.copy(path, kept)
            found = json.loads((folder / "found.json").read_text())
        counts, wrong = Row(*found["row"]), wrong | found["wrong"]
        row = Row(
            *(row.reader, row.runs + counts.runs, row.read + counts.read),
            *(max(row.slowest, counts.slowest), max(row.peak, counts.peak), row.seconds + counts.seconds),
            *(len(wrong), row.ended + bool(process.exitcode)),
        )
    print(*wrong.items(), sep="\n", flush=True)
    return row


def main(seconds: float, names: Sequence[str]) -> None:
    """Fuzz readers one after another."""
    rows = {row.reader: row for row in kept_rows(ROWS, Row)}
    for name in names or READERS:
        rows[name] = fuzzed(rows.get(name, Row(name)), seconds)
        print(*rows[name], flush=True)
        keep_rows(ROWS, Row, [rows[name] for name in READERS if name in rows])


if __name__ == "__main__":
    main(float(sys.argv[1]), sys.argv[2:])
