import json
from dataclasses import dataclass
from typing import ClassVar

import pytest

from pinnray.cli import main
from pinnray.comparison.evaluation.comparison import supported_solvers, unsupported_remarks
from pinnray.solvers.problem import Load, Material, Problem
from pinnray.solvers.solution import Solution
from pinnray.solvers.solver import Progress, UnsupportedProblemError, silent


@dataclass
class Takes:
    """A solver that is never asked to solve."""

    name: str
    loads: tuple[str, ...] = ("mean",)
    laws: ClassVar[tuple[str, ...]] = ("linear",)

    def settings(self) -> dict[str, object]:
        return {}

    def solve(self, problem: Problem, progress: Progress = silent) -> Solution:
        raise NotImplementedError


SOLVERS = [Takes("a"), Takes("b", ("mean", "patch")), Takes("c")]
PATCH = Load(kind="patch")


def test_every_solver_that_can_stays_in_its_place():
    assert supported_solvers(SOLVERS, (), Material(), Load()) == (SOLVERS, {})


def test_a_spare_solver_that_cannot_is_left_out():
    chosen, unsupported = supported_solvers(SOLVERS, ("a", "b", "c"), Material(), PATCH)
    assert [solver.name for solver in chosen] == ["b"]
    assert unsupported == {"a": "no load 'patch'", "c": "no load 'patch'"}


def test_a_solver_that_was_asked_for_is_not():
    with pytest.raises(UnsupportedProblemError, match="c takes the loads mean, not 'patch'"):
        supported_solvers(SOLVERS, ("a", "b"), Material(), PATCH)


def test_a_job_that_no_solver_can_do_is_refused():
    with pytest.raises(UnsupportedProblemError):
        supported_solvers([SOLVERS[0], SOLVERS[2]], ("a", "c"), Material(), PATCH)


def test_solvers_with_the_same_reason_share_a_line():
    assert unsupported_remarks({"a": "no load", "b": "too few markers", "c": "no load"}) == [
        "left out: a, c (no load)",
        "left out: b (too few markers)",
    ]


@pytest.mark.slow
def test_a_named_solver_that_cannot_is_left_out_and_the_first_that_can_is_the_reference(tmp_path, capsys):
    line = "compare --load cylinder --solvers fem,fem-nonlinear --mesh-size 2 --stroke 1 --quiet --out"
    assert main([*line.split(), str(tmp_path / "run")]) == 0
    assert "left out: fem (no load 'cylinder')" in capsys.readouterr().err
    assert json.loads((tmp_path / "run" / "metrics.json").read_text())["reference"] == "fem-nonlinear"
