"""Bad input of the command line: one line that says what and how to mend it, and nothing is written."""

import os
from pathlib import Path

import pytest

from pinnray.cli import main
from pinnray.runtime.exits import BAD_INPUT
from tests.pinnray.commands.programs import run_python
from tests.refusals.shell import FILES

SMALL = ["compare", "--solvers", "fem", "--mesh-size", "1.0"]


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The current folder, empty."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write everywhere")
def test_a_read_only_folder_is_one_line(folder, capsys):
    (folder / "foreign").mkdir(mode=0o555)
    assert main([*SMALL, "--out", "foreign/run"]) == BAD_INPUT
    assert capsys.readouterr().err.endswith("run.partial: Permission denied\n")


def test_a_link_to_itself_is_no_output_folder(folder, capsys):
    Path("loop").symlink_to("loop")
    assert main([*SMALL, "--out", "loop"]) == BAD_INPUT
    assert capsys.readouterr().err == "error: loop is a link that leads nowhere; name an output folder\n"


def test_a_drawing_is_not_replaced_by_what_is_drawn_from_it(folder, capsys):
    Path("beam.svg").write_text(str(FILES["beam.svg"]))
    Path("section.dxf").symlink_to("beam.svg")
    assert main(["design", "--section", "beam.svg", "--formats", "dxf", "--out", "."]) == BAD_INPUT
    assert "this would overwrite beam.svg, which is read" in capsys.readouterr().err
    assert Path("beam.svg").read_text() == FILES["beam.svg"]


@pytest.mark.parametrize(
    ("command", "closed"),
    [
        pytest.param("--help", ">&-", marks=pytest.mark.slow),  # by Rich
        pytest.param("--version", "<&-", marks=pytest.mark.slow),
        ("--version", "2>&-"),
    ],
)
def test_a_closed_stream_is_no_fault(command, closed):
    done = run_python("-m", "pinnray.cli", command, after=closed)
    assert (done.returncode, done.stderr) == (0, "")
