"""Progress on a terminal and in a log."""

import re
from io import StringIO

import pytest
from rich.console import Console

from pinnray.runtime.stages import Stages


def console(*, terminal: bool) -> Console:
    return Console(file=StringIO(), force_terminal=terminal, width=100, color_system=None)


def shown(where: Console) -> str:
    assert isinstance(where.file, StringIO)
    return where.file.getvalue()


def two_stages(stages: Stages) -> None:
    with stages:
        with stages.stage("mesh"):
            pass
        with stages.stage("fem") as progress:
            progress(0.5, "half [of] the load")
            progress(1.0, "all [of] the load")


def test_a_log_has_a_line_a_stage_with_its_last_note():
    log = console(terminal=False)
    two_stages(Stages(log))
    assert shown(log) == "mesh: 0.0 s\nfem: 0.0 s, all [of] the load\n"


def test_stages_of_other_processes_overlap_and_end_when_they_say_so():
    log = console(terminal=False)
    with Stages(log) as stages, stages.stage("fem"):
        stages.told("gp", 0.0, "")
        stages.told("gp", 0.5, "half")
        stages.told("gp", 0.9, "nearly")
        stages.told("gp")
    assert shown(log) == "gp: 0.0 s, nearly\nfem: 0.0 s\n"
    assert set(stages.seconds) == {"gp", "fem"}


def test_a_terminal_has_a_bar_a_stage():
    terminal = console(terminal=True)
    two_stages(Stages(terminal))
    mesh, fem = shown(terminal).splitlines()[-3:-1]
    assert re.search(r"mesh\b.*100%", mesh)
    assert re.search(r"fem\b.*100%.*all \[of\] the load", fem)


@pytest.mark.parametrize("terminal", [True, False])
def test_quiet_shows_nothing(terminal):
    quiet = console(terminal=terminal)
    two_stages(Stages(quiet, quiet=True))
    assert shown(quiet) == ""
