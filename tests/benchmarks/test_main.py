"""`python -m benchmarks`: its names."""

import importlib
import sys

import pytest

from benchmarks.__main__ import BENCHMARKS, main


@pytest.mark.parametrize("name", BENCHMARKS)
def test_every_name_is_a_function(name: str) -> None:
    module, _, function = BENCHMARKS[name].partition(":")
    assert callable(getattr(importlib.import_module(f"benchmarks.{module}"), function))


def test_an_unknown_name_is_refused_in_one_line(monkeypatch, capsys) -> None:
    monkeypatch.setattr(sys, "argv", ["benchmarks", "recipes"])
    with pytest.raises(SystemExit, match="2"):
        main()
    said = capsys.readouterr().err.splitlines()[-1]
    assert "'recipes'; there are" in said
    assert "docs/evidence/tried.md" in said
