"""Files in the working folder that a library or Python itself would take for settings or code of the user."""

import os
from collections.abc import Callable
from contextlib import closing
from pathlib import Path

import pytest

from compare.runtime.processes import in_processes
from compare.sweep.workers import Workers
from geometry.worker import Worker


def sum_of(number: int, progress: Callable[..., None]) -> int:
    return number + 1


@pytest.fixture
def hostile_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The working folder, with modules that end every Python program which imports them from there."""
    for name in ("selectors", "random", "signal", "tempfile"):
        (tmp_path / f"{name}.py").write_text(f"open({str(tmp_path / 'ran')!r}, 'a').write('{name} ')\n")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_the_worker_runs_no_module_of_the_working_folder(hostile_folder: Path) -> None:
    worker = Worker()
    task = {"kind": "cad", "what": "this", "formats": ["svg"], "finger": {}, "timeout_s": 60}
    said = worker.answer({**task, "output": str(worker.folder / "made")}, timeout_s=60)
    worker.stop()
    assert (said, (hostile_folder / "ran").exists()) == ("", False)


def test_processes_run_no_module_of_the_working_folder(hostile_folder: Path) -> None:
    with closing(in_processes(sum_of, {"a": 1}, processes=1, report=lambda *_: None)) as answers:
        assert list(answers) == [("a", 2)]
    assert not (hostile_folder / "ran").exists()


def test_workers_of_a_sweep_run_no_module_of_the_working_folder(hostile_folder: Path) -> None:
    pytest.importorskip("distributed")
    with Workers(1) as workers:
        assert workers._connected().submit(os.getcwd).result() == str(hostile_folder)
    assert not (hostile_folder / "ran").exists()
