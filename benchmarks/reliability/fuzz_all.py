"""Fuzzes every reader for a time, starting anew where a C library ended the process, and keeps the counts.

`python -m benchmarks.reliability.fuzz_all SECONDS [READER ...]`; needs Atheris (`pip install atheris`).
"""

import csv
import json
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
"""Folder of the inputs that were not handled."""


class Row(NamedTuple):
    """Counts of a reader, in seconds and bytes; `unhandled`: exceptions by place, `ended`: by a C library."""

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
        rows[name] = fuzzed(name, seconds)
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


def fuzzed(name: str, seconds: float) -> Row:
    """Fuzz one reader, in as many processes as it takes."""
    row = Row(name, 0, 0, 0.0, 0, 0.0, 0, 0)
    wrong: dict[str, str] = {}
    end = time.monotonic() + seconds
    while (left := end - time.monotonic()) > 1:
        with tempfile.TemporaryDirectory(dir="/dev/shm" if Path("/dev/shm").is_dir() else None) as place:
            folder = Path(place)
            command = [sys.executable, "-m", "benchmarks.reliability.fuzzing", name, str(left), place]
            with (folder / "log").open("wb") as log:
                code = _ended(command, log, left + GRACE_S)
            found = folder / "found.json"
            if found.exists():
                counts = json.loads(found.read_text())
                row = row._replace(
                    runs=row.runs + counts["runs"],
                    read=row.read + counts["read"],
                    slowest=max(row.slowest, counts["slowest"]),
                    peak=max(row.peak, counts["peak"]),
                    seconds=row.seconds + counts["seconds"],
                )
                wrong |= counts["wrong"]
            for path in [*folder.glob("wrong-*"), *folder.glob("crash-*")]:
                kept = KEPT / name / path.name
                kept.parent.mkdir(parents=True, exist_ok=True)
                kept.write_bytes(path.read_bytes())
            if code:
                row = row._replace(ended=row.ended + 1)
                print(name, code, *(folder / "log").read_text(errors="replace").splitlines()[-3:], flush=True)
            if code and not found.exists() and not list(folder.glob("crash-*")):
                break  # it does not even start
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
