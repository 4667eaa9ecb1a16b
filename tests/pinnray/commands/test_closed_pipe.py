"""Output that nobody reads any more, as of `compare | head -1`: no message, and the shell's exit code."""

import os
import subprocess
import sys

import pytest

from pinnray.runtime.processes.pool import child_environment
from tests.pinnray.commands.programs import COMMAND, WITHOUT_PICTURES

LONG = """
import sys
from pinnray.cli import main
import pinnray.commands.launch as launch
launch.guarded, guarded = lambda _: guarded(lambda: print("x" * 100_000)), launch.guarded
sys.exit(main([]))
"""
"""More than a buffer holds: the pipe's end is known before the program's."""


def environment() -> dict[str, str]:
    """With output in a buffer, as usual, so that some of it is written when the program ends."""
    return {name: text for name, text in child_environment(os.environ).items() if name != "PYTHONUNBUFFERED"}


def unread(code: str, words: str, *streams: str) -> subprocess.CompletedProcess[str]:
    """A finished program whose `streams` go into a pipe that is closed at its other end."""
    reading, writing = os.pipe()
    os.close(reading)
    try:
        return subprocess.run(
            [sys.executable, "-c", code, *words.split()],
            env=environment(),
            text=True,
            check=False,
            **{name: writing if name in streams else subprocess.PIPE for name in ("stdout", "stderr")},
        )
    finally:
        os.close(writing)


@pytest.mark.parametrize(
    ("code", "words"),
    [
        pytest.param(COMMAND, "--help", marks=pytest.mark.slow),  # by Rich
        (LONG, ""),
    ],
)
def test_a_closed_pipe_ends_a_command_quietly(code, words):
    done = unread(code, words, "stdout")
    assert (done.returncode, done.stderr) == (141, "")


@pytest.mark.slow
def test_so_does_a_closed_pipe_of_messages():
    assert unread(COMMAND, "mesh --set height=1", "stdout", "stderr").returncode == 141


@pytest.mark.slow
def test_the_results_are_kept(tmp_path):
    out, markers = tmp_path / "run", tmp_path / "markers.csv"
    markers.write_text("x_mm,y_mm,u_mm,v_mm\n20,-1,0,-5\n85,-1,-2,-0.5\n")
    words = f"compare --solvers fem --mesh-size 1 --measurements {markers} --json --out {out}"
    done = unread(WITHOUT_PICTURES, words, "stdout")
    assert (done.returncode, done.stderr) == (141, "")
    assert (out / "report.html").stat().st_size > 0


@pytest.mark.slow
def test_output_that_finds_no_room_is_an_error_in_one_line(tmp_path):
    with open("/dev/full", "w", encoding="utf-8") as full:
        done = subprocess.run(
            [sys.executable, "-c", COMMAND, "mesh", "--mesh-size", "3", "--out", str(tmp_path)],
            env=environment(),
            text=True,
            check=False,
            stdout=full,
            stderr=subprocess.PIPE,
        )
    assert done.returncode == 2
    assert [line.partition(":")[0] for line in done.stderr.splitlines()] in (["error"], ["mesh", "error"])
