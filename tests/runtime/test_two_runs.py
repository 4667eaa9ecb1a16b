"""Two runs at the same time, on one output folder or on one empty cache: nothing is mixed."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from pinnray.cli import main
from pinnray.runtime.content_hash import file_digest
from tests.pinnray.commands.programs import FEW_ELEMENTS, WITHOUT_PICTURES

pytestmark = [pytest.mark.slow, pytest.mark.usefixtures("few_elements")]

OPTIONS = ["compare", "--mesh-size", "2", "--solvers", "fem", "--quiet"]


def start(cache: Path, out: Path, *options: str) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [sys.executable, "-c", FEW_ELEMENTS + WITHOUT_PICTURES, *OPTIONS, *options, "--out", str(out)],
        env=os.environ | {"PINNRAY_CACHE": str(cache)},
        stderr=subprocess.PIPE,
        text=True,
    )


def files(folder: Path) -> list[str]:
    return sorted(path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file())


def test_of_two_runs_on_one_folder_one_is_refused_and_the_other_is_whole(tmp_path, capfd):
    measured = tmp_path / "measured.csv"
    measured.write_text("x_mm,y_mm,u_mm,v_mm\n20,-1,-0.5,-5\n85,-1,-2,-0.5\n")
    given = "--measurements", str(measured)
    first = start(tmp_path / "cache", tmp_path / "out", *given)
    while not (tmp_path / "out.partial").exists():
        assert first.poll() is None
        time.sleep(0.02)
    first.send_signal(signal.SIGSTOP)  # it holds the folder, however slow the machine is
    second = main([*OPTIONS, *given, "--out", str(tmp_path / "out")])
    refusal = capfd.readouterr().err
    first.send_signal(signal.SIGCONT)
    assert (second, first.communicate(timeout=200)[1], first.returncode) == (2, "", 0)
    assert refusal.startswith(f"error: another run is writing to {tmp_path / 'out.partial'}; wait for it, or")
    assert refusal.count("\n") == 1
    assert not (tmp_path / "out.partial").exists()
    listed = json.loads((tmp_path / "out" / "run.json").read_text(encoding="utf-8"))["files_sha256"]
    assert files(tmp_path / "out") == sorted([*listed, "run.json"])
    assert {name: file_digest(tmp_path / "out" / name) for name in listed} == listed
