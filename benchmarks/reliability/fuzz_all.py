"""Fuzzes every reader for a time, starting anew where a C library ended the process, and adds to the counts.

`python -m benchmarks.reliability.fuzz_all SECONDS [READER ...]`; needs Atheris (`pip install atheris`). The
files that reached new branches are kept below `out`, and a later time goes on from them.
"""

import csv
import json
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path
from typing import BinaryIO, NamedTuple

from geometry.atomic import write_text

ROWS = Path(__file__).with_name("fuzzing.csv")
GRACE_S = 60.0
"""Time that a process may take to start and to end."""

KEPT = Path("out/reliability/fuzzing")
"""Folder of the inputs that were not handled, and of those that reached new branches."""
CORPUS = "corpus"


class Row(NamedTuple):
    """Counts of a reader over all times, in seconds and bytes.

    Attributes:
        reader: Name.
        runs: Files that it was given.
        read: Those that it took.
        slowest: Time of the slowest.
        peak: Memory of the largest process.
        seconds: Time in all.
        unhandled: Places of exceptions that are no refusal, of the last time alone.
        ended: How often a C library ended the process that read, of the last time alone.
    """

    reader: str
    runs: int
    read: int
    slowest: float
    peak: int
    seconds: float
    unhandled: int
    ended: int


def main(seconds: float, names: Sequence[str]) -> None:
    """Fuzz readers one after another."""
    from benchmarks.reliability.readers import READERS

    rows = {row.reader: row for row in kept_rows()}
    for name in names or READERS:
        before = rows.get(name, Row(name, 0, 0, 0.0, 0, 0.0, 0, 0))
        rows[name] = fuzzed(before, seconds)
        print(*rows[name], flush=True)
        lines = [Row._fields, *(rows[name] for name in READERS if name in rows)]
        write_text(ROWS, "".join(",".join(map(str, line)) + "\n" for line in lines))


def kept_rows() -> list[Row]:
    """The counts as they were kept."""
    if not ROWS.exists():
        return []
    with ROWS.open(encoding="utf-8", newline="") as file:
        return [
            Row(
                name,
                int(runs),
                int(read),
                float(slowest),
                int(peak),
                float(seconds),
                int(unhandled),
                int(ended),
            )
            for name, runs, read, slowest, peak, seconds, unhandled, ended in list(csv.reader(file))[1:]
        ]


def fuzzed(row: Row, seconds: float) -> Row:
    """Fuzz the reader of a row, in as many processes as it takes, and add to its counts."""
    name, wrong = row.reader, dict[str, str]()
    known, row = KEPT / name / CORPUS, row._replace(ended=0)
    end = time.monotonic() + seconds
    while (left := end - time.monotonic()) > 1:
        with tempfile.TemporaryDirectory(dir="/dev/shm" if Path("/dev/shm").is_dir() else None) as place:
            folder = Path(place)
            if known.is_dir():
                shutil.copytree(known, folder / CORPUS)
            command = [sys.executable, "-m", "benchmarks.reliability.fuzzing", name, str(left), place]
            with (folder / "log").open("wb") as log:
                code = _ended(command, log, left + GRACE_S)
            if (folder / CORPUS).is_dir():
                shutil.copytree(folder / CORPUS, known, dirs_exist_ok=True)
            found = folder / "found.json"
            if found.exists():
                counts = json.loads(found.read_text())
                row = row._replace(
                    runs=row.runs + counts["runs"],
                    read=row.read + counts["read"],
                    slowest=max(row.slowest, counts["slowest"]),
                    peak=max(row.peak, counts["peak"]),
                    seconds=row.seconds + counts["seconds"],
                    ended=row.ended + counts["ended"],
                )
                wrong |= counts["wrong"]
            for path in [*folder.glob("wrong-*"), *folder.glob("crash-*")]:
                kept = KEPT / name / path.name
                kept.parent.mkdir(parents=True, exist_ok=True)
                kept.write_bytes(path.read_bytes())
            if code and not found.exists() and not list(folder.glob("crash-*")):
                raise SystemExit((folder / "log").read_text(errors="replace"))  # it does not even start
            if code:
                row = row._replace(ended=row.ended + 1)
                print(name, code, *(folder / "log").read_text(errors="replace").splitlines()[-3:], flush=True)
    for key, text in wrong.items():
        print(name, key, text, flush=True)
    return row._replace(unhandled=len(wrong))


def _ended(command: Sequence[str], log: BinaryIO, limit_s: float) -> int:
    """The exit code of a command; that of SIGKILL if it hangs where no alarm reaches it."""
    try:
        return subprocess.run(command, stdout=log, stderr=log, timeout=limit_s).returncode
    except subprocess.TimeoutExpired:
        return -signal.SIGKILL


if __name__ == "__main__":
    main(float(sys.argv[1]), sys.argv[2:])
