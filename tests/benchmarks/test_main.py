"""`python -m benchmarks`: its names and its tables in a narrow terminal."""

import importlib
import sys
from io import StringIO

import pytest
from rich.console import Console
from rich.table import Table

from benchmarks.__main__ import BENCHMARKS, SETTLED, main, show


def test_headings_are_whole_in_a_terminal_of_80_columns() -> None:
    headings = [f"displacement {number}, relative" for number in range(6)]
    table = Table(*headings)
    table.add_row(*["0.123"] * 6)
    console = Console(file=StringIO(), width=80)
    show(table, console)
    assert all(heading in console.file.getvalue() for heading in headings)  # type: ignore[attr-defined]


@pytest.mark.parametrize("name", BENCHMARKS)
def test_every_name_is_a_function(name: str) -> None:
    module, _, function = BENCHMARKS[name].partition(":")
    assert callable(getattr(importlib.import_module(f"benchmarks.{module}"), function))


@pytest.mark.parametrize(("name", "said"), [(next(iter(SETTLED)), "settled.md"), ("fme", "'fme'; there are")])
def test_settled_and_unknown_names_are_refused_in_one_line(name, said, monkeypatch, capsys) -> None:
    monkeypatch.setattr(sys, "argv", ["benchmarks", name])
    with pytest.raises(SystemExit, match="2"):
        main()
    assert said in capsys.readouterr().err.splitlines()[-1]
