"""Signals that end a command: one line, an exit code, and neither a process nor a file left behind."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from pinnray.runtime.exits import INTERRUPTED
from pinnray.runtime.processes.pool import child_environment

ENDING = [signal.SIGINT, signal.SIGTERM, signal.SIGHUP]

WHILE_IMPORTING = """
import os, signal, sys

class Interrupting:
    def find_spec(self, name, path=None, target=None):
        if name == "cyclopts":  # a part of the commands' imports
            os.kill(os.getpid(), int(sys.argv[1]))

sys.meta_path.insert(0, Interrupting())
from pinnray.cli import main
sys.exit(main(["--version"]))
"""

WHILE_MESHING = """
import sys
from pinnray.cli import main
from pinnray.geometry import Design, MeshSettings, finger_mesh

def command():
    finger_mesh(Design(), settings=MeshSettings(size=0.02))  # minutes

import pinnray.commands.launch as launch
launch.guarded, guarded = lambda _: guarded(command), launch.guarded
sys.exit(main([]))
"""


def started(
    code: str, *words: str, ignored: signal.Signals | None = None, **variables: str
) -> subprocess.Popen[str]:
    """A program that ignores one signal at most, even if these tests run under nohup."""

    def set_signals() -> None:
        for each in ENDING:
            usual = signal.default_int_handler if each == signal.SIGINT else signal.SIG_DFL
            signal.signal(each, signal.SIG_IGN if each == ignored else usual)

    return subprocess.Popen(
        [sys.executable, "-c", code, *words],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env=child_environment(os.environ) | variables,
        preexec_fn=set_signals,
    )


def workers(parent: int) -> list[int]:
    """The children that run the worker; libraries start others while they are imported."""
    found = Path(f"/proc/{parent}/task/{parent}/children").read_text().split()
    return [
        int(word)
        for word in found
        if "pinnray.runtime.processes" in Path(f"/proc/{word}/cmdline").read_text()
    ]


def runs(process: int) -> bool:
    """Whether a process exists and has not ended; nobody may have asked for its exit code yet."""
    try:
        return Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


def until(condition: Callable[[], object]) -> None:
    limit = time.monotonic() + 60
    while not condition() and time.monotonic() < limit:
        time.sleep(0.02)


@pytest.fixture
def meshing(
    tmp_path: Path, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[tuple[subprocess.Popen[str], int, Path]]:
    """A command whose worker is meshing, its worker's number, and the folder for temporary files."""
    command = started(
        WHILE_MESHING, PINNRAY_CACHE=str(tmp_path_factory.mktemp("cache")), TMPDIR=str(tmp_path)
    )
    until(lambda: workers(command.pid))
    (worker,) = workers(command.pid)
    until(lambda: "libgmsh" in Path(f"/proc/{worker}/maps").read_text())
    time.sleep(0.5)  # the worker has read its task and calls Gmsh
    assert list(tmp_path.iterdir()) != []
    yield command, worker, tmp_path
    for number in filter(runs, (command.pid, worker)):
        os.kill(number, signal.SIGKILL)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM], ids=lambda number: number.name)
def test_a_signal_while_the_program_is_imported_is_one_line(number):
    command = started(WHILE_IMPORTING, str(int(number)))
    assert command.communicate(timeout=60) == ("", "interrupted\n")
    assert command.returncode == INTERRUPTED


@pytest.mark.slow
def test_a_signal_that_nohup_has_ignored_stays_ignored():
    command = started(WHILE_IMPORTING, str(int(signal.SIGHUP)), ignored=signal.SIGHUP)
    _, errors = command.communicate(timeout=60)
    assert (command.returncode, errors) == (0, "")


@pytest.mark.slow
def test_a_signal_ends_the_worker_too(meshing):
    command, worker, folder = meshing
    command.send_signal(signal.SIGTERM)
    assert command.communicate(timeout=60)[1] == "interrupted\n"
    assert (command.returncode, runs(worker), list(folder.iterdir())) == (INTERRUPTED, False, [])


@pytest.mark.slow
def test_the_worker_of_a_killed_program_ends_and_leaves_no_file(meshing):
    command, worker, folder = meshing
    command.kill()
    until(lambda: not runs(worker))
    assert (runs(worker), list(folder.iterdir())) == (False, [])
