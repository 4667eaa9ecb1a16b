"""Two runs at the same time, on one output folder or on one empty cache: nothing is mixed."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from tests.pinnray.commands.programs import WITHOUT_PICTURES

pytestmark = pytest.mark.slow


def start(cache: Path, out: Path) -> subprocess.Popen[str]:
    options = ["compare", "--mesh-size", "2", "--solvers", "fem,fem-nonlinear", "--quiet", "--out", str(out)]
    return subprocess.Popen(
        [sys.executable, "-c", WITHOUT_PICTURES, *options],
        env=os.environ | {"PINNRAY_CACHE": str(cache)},
        stderr=subprocess.PIPE,
        text=True,
    )


def numbers(out: Path) -> dict[str, object]:
    found = json.loads((out / "metrics.json").read_text(encoding="utf-8"))
    for solver in found["solvers"].values():
        del solver["seconds"], solver["stats"]["seconds"], solver["stats"]["estimate_seconds"]
    return found


def test_of_two_runs_on_one_folder_one_is_refused_and_the_other_is_whole(tmp_path):
    first = start(tmp_path / "cache", tmp_path / "out")
    while not (tmp_path / "out.partial").exists():
        assert first.poll() is None
        time.sleep(0.02)
    first.send_signal(signal.SIGSTOP)  # it holds the folder, however slow the machine is
    second = start(tmp_path / "cache", tmp_path / "out")
    refusal = second.communicate(timeout=200)[1]
    first.send_signal(signal.SIGCONT)
    assert (second.returncode, first.communicate(timeout=200)[1], first.returncode) == (2, "", 0)
    assert refusal.startswith(f"error: another run is writing to {tmp_path / 'out.partial'}; wait for it, or")
    assert refusal.count("\n") == 1
    assert [path.name for path in sorted(tmp_path.iterdir())] == ["cache", "out"]
    assert start(tmp_path / "cache", tmp_path / "alone").wait(timeout=200) == 0
    assert numbers(tmp_path / "out") == numbers(tmp_path / "alone")


def test_two_runs_that_fill_one_cache_give_the_same_and_leave_it_whole(tmp_path):
    runs = [start(tmp_path / "cache", tmp_path / name) for name in ("one", "other")]
    assert [run.communicate(timeout=200)[1] for run in runs] == ["", ""]
    assert [run.returncode for run in runs] == [0, 0]
    assert numbers(tmp_path / "one") == numbers(tmp_path / "other")
    kept = sorted(path.relative_to(tmp_path) for path in (tmp_path / "cache").rglob("*") if path.is_file())
    assert start(tmp_path / "cache", tmp_path / "third").wait(timeout=200) == 0
    assert numbers(tmp_path / "third") == numbers(tmp_path / "one")
    assert kept == sorted(
        path.relative_to(tmp_path) for path in (tmp_path / "cache").rglob("*") if path.is_file()
    )
