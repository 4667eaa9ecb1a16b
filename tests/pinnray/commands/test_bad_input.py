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
    Path("section.svg").write_text(str(FILES["beam.svg"]))
    assert main(["design", "--section", "section.svg", "--formats", "svg", "--out", "."]) == BAD_INPUT
    assert "this would overwrite section.svg, which is read" in capsys.readouterr().err
    assert Path("section.svg").read_text() == FILES["beam.svg"]


@pytest.mark.parametrize(
    ("command", "closed"),
    [
        pytest.param("solvers", ">&-", marks=pytest.mark.slow),  # a table by Rich
        pytest.param("--version", "<&-", marks=pytest.mark.slow),
        ("--version", "2>&-"),
    ],
)
def test_a_closed_stream_is_no_fault(command, closed):
    done = run_python("-m", "pinnray.cli", command, after=closed)
    assert (done.returncode, done.stderr) == (0, "")


@pytest.mark.parametrize(
    ("before", "argument", "said"),
    [
        ("ulimit -n 16;", "out", "the limit of open files is 16; allow 128 (ulimit -n 128)"),
        ("ulimit -f 8;", "out", "files may not become longer than 8192 bytes; allow 16777216 (ulimit"),
        ("", "a\udcff", r"the argument 'a\udcff' is not UTF-8; take another name"),
    ],
)
def test_what_the_libraries_cannot_start_with_is_one_line(folder, before, argument, said):
    """MPI aborts with forty lines, or is killed by SIGXFSZ, and DOLFINx ends in a traceback."""
    line = ["-m", "pinnray.cli", "compare", "--solvers", "fem", "--out", argument]
    done = run_python(*line, before=before)
    assert (done.returncode, done.stderr.count("\n")) == (BAD_INPUT, 1)
    assert done.stderr.startswith(f"error: {said}")
