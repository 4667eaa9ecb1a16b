"""The command: its files, what it says of several layouts and truths, and what it refuses."""

import json
import re
import shlex
import subprocess
import sys
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import ClassVar

import numpy as np
import pandas as pd
import pytest

from pinnray.cli import main
from pinnray.geometry.finger.design import Design
from pinnray.geometry.mesh.settings import MeshSettings
from pinnray.geometry.picture_frame import HAND_HELD
from pinnray.runtime.errors import UserError
from pinnray.solvers.fem.linear import FemSolver
from pinnray.solvers.problem import Problem
from pinnray.solvers.registry import BUILT_IN, make_solver
from pinnray.solvers.solution import Solution, Status
from pinnray.solvers.solver import Progress, silent
from pinnray.studies.crossval import cross_validation
from pinnray.studies.crossval.cross_validation import cross_validate
from pinnray.studies.crossval.folds import ONE
from pinnray.studies.crossval.scores import HELD_OUT, SCORED
from pinnray.studies.crossval.study import CrossvalStudy
from pinnray.studies.sweep.store import JOURNAL, opened
from pinnray.vision.measurements import write_measurements
from tests.solvers.conftest import observed_at
from tests.studies.crossval.conftest import NOISE


def run(line: str, out: Path) -> int:
    return main([*shlex.split(f"crossval {line} --mesh-size 2"), "--out", str(out)])


def scores_of(out: Path) -> pd.DataFrame:
    return pd.read_csv(out / "scores.csv").set_index([*SCORED, "score"]).sort_index()


def samples_of(out: Path) -> pd.DataFrame:
    return pd.read_parquet(out / "samples.parquet")


@pytest.mark.slow
def test_the_command_writes_what_the_guide_says_and_goes_on(tmp_path, capsys, in_line, monkeypatch):
    line = "--solvers fem,gp,fem-asm --schemes tip-out --solver-set fem-asm.choose=given"
    assert run(f"{line} --seeds 1", tmp_path) == 0
    first, scores = samples_of(tmp_path), scores_of(tmp_path)
    assert list(first["solver"].unique()) == ["fem", "gp", "fem-asm"]
    assert np.isnan(scores.loc["sliding", "joints", "fem", "tip-out", HELD_OUT]["low"])
    assert "simulated by fem-nonlinear" in (tmp_path / "report.html").read_text()

    assert run(f"{line} --seeds 2", tmp_path) == 0
    both = samples_of(tmp_path)
    pd.testing.assert_frame_equal(both[both["seed"] == 0].reset_index(drop=True), first)  # not run again
    scores = scores_of(tmp_path)
    own = scores.loc["sliding", "joints", "fem-asm"]["against_fem"]
    assert (own["tip-out", HELD_OUT], own["tip-out", "von_mises"]) == ("better", "worse")
    assert ("sliding", "joints", "fem", "all", "in_sample_mae_sum_mm") not in scores.index

    assert run(f"{line} --seeds 1 --noise 0.02", tmp_path) == 2
    assert "holds a cross-validation with other settings (noise_mm)" in capsys.readouterr().err


@pytest.mark.slow
def test_truths_and_layouts_stay_apart(tmp_path, capsys, in_line):
    """`fem` has one field, as far from one truth with other markers, whose errors differ."""
    line = "--truth {} --solvers fem,gp --schemes one-out --seeds 1 --layouts {}"
    assert run(line.format("cylinder,base", "front,joints"), tmp_path) == 0
    said = capsys.readouterr().out
    assert all(len(each) <= 80 for each in said.splitlines() if not each.startswith(str(tmp_path)))
    scores = scores_of(tmp_path)
    means, gp = scores["mean"], scores["against_gp"]
    assert gp["cylinder", "joints", "fem", "one-out", HELD_OUT] == "worse"
    fields, errors, forces = (
        [
            means[truth, layout, "fem", scheme, score]
            for truth, layout in (("base", "front"), ("base", "joints"), ("cylinder", "joints"))
        ]
        for scheme, score in (("all", "displacement"), ("one-out", HELD_OUT), ("all", "force_error"))
    )
    assert fields[0] == pytest.approx(fields[1], rel=1e-9)
    assert abs(errors[0] - errors[1]) > 0.01
    assert abs(forces[1] - forces[2]) > 0.05
    content = json.loads((tmp_path / "crossval.json").read_text())
    assert list(content["contacts"]) == ["cylinder", "base"]
    # One of them alone takes its folds over, and has what it had beside the others.
    with opened(tmp_path / JOURNAL) as journal:
        before = journal.numbers()
    assert run(line.format("base", "front"), tmp_path) == 0
    with opened(tmp_path / JOURNAL) as journal:
        assert journal.numbers() == before
    pd.testing.assert_series_equal(scores_of(tmp_path)["mean"], means.loc[["base"], ["front"]])


@pytest.mark.slow
def test_force_and_place_that_a_solver_identifies_are_near_those_of_the_truth(tmp_path, in_line):
    """At finite strain `fem-id` finds both from the markers, and says how well."""
    assert run("--truth cylinder --solvers fem-id --schemes tip-out --seeds 1", tmp_path) == 0
    row = samples_of(tmp_path).query("scheme == 'all'").iloc[0]
    assert abs(row["force_error"]) < 0.05
    assert abs(row["position_error_mm"]) < 0.5
    assert row["von_mises_within_stated"] > 0.5  # on a mesh whose own error is 4 % of the stress
    assert {row["force_within_stated"], row["position_within_stated"]} <= {0.0, 1.0}


def test_measured_markers_have_no_truth(tmp_path, capsys, in_line, observations):
    file, out = tmp_path / "markers.csv", tmp_path / "out"
    write_measurements(file, replace(observations, simulated=False, visible=np.arange(9) != 4))
    assert run(f"--measurements {file} --solvers fem,gp --schemes one-out,load-out --seeds 1", out) == 0
    printed = capsys.readouterr()
    assert "load-out needs a truth at other loads, and is skipped" in printed.err
    assert str(out / "scores.csv") in printed.out
    samples = samples_of(out)
    assert samples["scheme"].unique().tolist() == ["all", "one-out"]
    assert samples["marker"].max() == 8
    assert samples["displacement"].isna().all()


class Stopped(FemSolver):
    """`fem`, which says that it was not finished."""

    name = "stopped"

    def solve(self, problem: Problem, progress: Progress = silent) -> Solution:
        return replace(super().solve(problem), status=Status(False, "stopped early; take more epochs"))


def test_what_speaks_against_a_result_is_said_everywhere(tmp_path, capsys, monkeypatch, in_line, truth):
    """A body that goes through itself, a solver that did not converge, and a modulus in pascals."""
    monkeypatch.setitem(BUILT_IN, "stopped", f"{__name__}:Stopped")
    points = truth.problem.mesh.markers
    file, out = tmp_path / "markers.csv", tmp_path / "out"
    write_measurements(
        file, replace(observed_at(points, 6 * truth.displacement(points), NOISE), simulated=False)
    )
    line = f"--measurements {file} --solvers fem,stopped --schemes tip-out --seeds 1"
    assert run(f"{line} --stroke 60 --young 1e6", out) == 3
    printed = " ".join(capsys.readouterr().err.split())
    assert "Young's modulus of 1e+06 MPa is no rubber's or plastic's; this looks like pascals" in printed
    page = (out / "report.html").read_text()
    through = "2 of 2 folds and seeds, the first of them: {0}: THE BODY GOES THROUGH ITSELF"
    said = [f"{name}, {through.format(name)}" for name in ("fem", "stopped")]
    for text in (*said, "did not converge: stopped early"):
        assert text in printed
        assert text in page
    assert len(json.loads((out / "crossval.json").read_text())["remarks"]) == 2


def test_simulated_markers_of_a_file_are_called_simulated_everywhere(tmp_path, capsys, in_line, observations):
    file, out = tmp_path / "markers.csv", tmp_path / "out"
    write_measurements(file, replace(observations, simulated=True, source="made up"))
    assert run(f"--measurements {file} --solvers fem,gp --schemes one-out --seeds 1", out) == 0
    printed = capsys.readouterr()
    written = [path for path in out.rglob("*") if path.suffix in (".json", ".csv", ".html")]
    assert len(written) == 5
    for path in written:
        assert "measured" not in str(path.relative_to(tmp_path)), path
        assert not re.search(r"\bmeasured\b", path.read_text()), path
    assert set(samples_of(out)["truth"]) == set(samples_of(out)["layout"]) == {"simulated"}
    assert "measured" not in printed.out + printed.err


def test_a_study_runs_from_python_and_prints_nothing(tmp_path, capsys, in_line, observations):
    study = CrossvalStudy(
        design=Design(),
        solvers=[make_solver("gp")],
        out=tmp_path / "out",
        mesh=MeshSettings(size=1.0),
        schemes=[ONE],
        seeds=1,
        measurements=replace(observations, simulated=False),
    )
    result = cross_validate(study)
    assert capsys.readouterr() == ("", "")
    assert len(repr(result)) < 250
    assert "\n" not in repr(result)
    row = result.table().loc["measured", "measured", "gp", ONE, HELD_OUT]
    held = result.samples[result.samples["held_out"]]
    assert row["mean"] == pytest.approx(held[["error_u_mm", "error_v_mm"]].abs().sum(axis=1).mean())
    assert "against_fem" not in row.index  # fem is not in the study


def test_folds_of_other_settings_or_of_a_class_without_source_are_run_again(tmp_path, monkeypatch):
    """An edit of a notebook's class cannot be told."""
    digest = partial(cross_validation._digests, seeds=2)
    one, other = (FemSolver(degree=degree) for degree in (1, 2))
    assert digest(one) == digest(one) != digest(other)
    monkeypatch.setattr(FemSolver, "__module__", "a notebook")
    assert digest(one) != digest(one)


class Refusing(FemSolver):
    """`fem`, which can do nothing."""

    name = "refusing"
    asked: ClassVar = 0

    def solve(self, problem: Problem, progress: Progress = silent) -> Solution:
        Refusing.asked += 1
        raise UserError("no")


def test_a_solver_that_fails_has_no_score_and_is_tried_again(tmp_path, in_line, observations):
    study = CrossvalStudy(
        design=Design(),
        solvers=[make_solver("gp"), Refusing()],
        out=tmp_path / "out",
        mesh=MeshSettings(size=2.0),
        schemes=[ONE],
        seeds=1,
        measurements=observations,
    )
    for times in (1, 2):
        result = cross_validate(study)
        assert result.failed == {"refusing, simulated, simulated": "no"}
        assert result.samples["solver"].unique().tolist() == ["gp"]
        assert Refusing.asked == times
    with pytest.raises(UserError, match="refusing, simulated, simulated: no"):
        cross_validate(replace(study, solvers=study.solvers[1:]))


OWN_SCRIPT = """
import pinnray as pr
from pinnray.solvers.fem.linear import FemSolver

class Own(FemSolver):
    def solve(self, problem, progress=print):
        print("solved by the own class")
        return super().solve(problem)

solvers = ["gp", Own(degree=1)]
pr.crossval("default", solvers, out="out", measurements="markers.csv", size=2, schemes="one-out", seeds=1)
"""


@pytest.mark.slow
def test_a_class_of_the_calling_script_is_judged_beside_solvers_in_processes(tmp_path, observations):
    """It has the name of a built-in solver."""
    write_measurements(tmp_path / "markers.csv", replace(observations, simulated=False))
    (tmp_path / "script.py").write_text(OWN_SCRIPT)
    command = [sys.executable, "-W", "ignore", "script.py"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.stderr == ""
    assert "solved by the own class" in done.stdout
    assert samples_of(tmp_path / "out")["solver"].unique().tolist() == ["gp", "fem"]


@pytest.mark.slow
def test_turned_pictures_are_told_and_cost_gp_little(tmp_path, in_line):
    """Its held-out error is that of straight pictures within a half; `fem` knows of no picture."""
    frame, errors = '--frame "turn 3 deg, shift 0.3 mm, scale 1 %"', {}
    for name, option in (("straight", ""), ("turned", frame)):
        line = f"--solvers gp,fem --schemes one-out --seeds 1 {option}"
        assert run(line, tmp_path / name) == 0
        means = scores_of(tmp_path / name)["mean"]
        own = means.xs(("one-out", HELD_OUT), level=("scheme", "score"))
        errors[name] = dict(zip(own.index.get_level_values("solver"), own, strict=True))
    assert errors["turned"]["gp"] < 1.5 * errors["straight"]["gp"]
    assert errors["turned"]["fem"] > errors["straight"]["fem"] + 0.1


def test_every_seed_has_its_own_frame_of_the_pictures(tmp_path, observations):
    study = CrossvalStudy(design=Design(), solvers=[], out=tmp_path, frame=HAND_HELD)
    turned = study.pressed_picture(observations.points, 0)
    np.testing.assert_allclose(np.abs(turned.values), [5.0, 1.0, 1.0, 0.02, 0.01, 0.01])
    np.testing.assert_array_equal(turned.centre, observations.points.mean(axis=0))
    others = [study.pressed_picture(observations.points, seed).values.tolist() for seed in range(1, 9)]
    assert len({tuple(each) for each in others}) > 3
