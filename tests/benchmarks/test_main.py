"""`python -m benchmarks`: its names."""

import importlib
import sys

import pytest

from benchmarks.__main__ import BENCHMARKS, SETTLED, main


@pytest.mark.parametrize("name", BENCHMARKS)
def test_every_name_is_a_function(name: str) -> None:
    module, _, function = BENCHMARKS[name].partition(":")
    assert callable(getattr(importlib.import_module(f"benchmarks.{module}"), function))


@pytest.mark.parametrize(("name", "said"), [(next(iter(SETTLED)), "tried.md"), ("fme", "'fme'; there are")])
def test_settled_and_unknown_names_are_refused_in_one_line(name, said, monkeypatch, capsys) -> None:
    monkeypatch.setattr(sys, "argv", ["benchmarks", name])
    with pytest.raises(SystemExit, match="2"):
        main()
    assert said in capsys.readouterr().err.splitlines()[-1]
