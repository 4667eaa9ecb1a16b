"""The command: its files, what it says of several layouts and truths, and what it refuses."""

import csv
import json
import re
import shlex
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pinnray.cli import main
from pinnray.comparison.crossval.cross_validation import cross_validate
from pinnray.comparison.crossval.folds import ALL, ONE
from pinnray.comparison.crossval.study import CrossvalStudy, solver_variants
from pinnray.geometry.finger.design import Design
from pinnray.geometry.mesh.settings import MeshSettings
from pinnray.geometry.registration import HAND_HELD
from pinnray.solvers.fem.linear import FemSolver
from pinnray.solvers.problem import Material, Problem
from pinnray.solvers.registry import BUILT_IN, make_solver
from pinnray.solvers.solution import Solution, Status
from pinnray.solvers.solver import Progress, silent
from pinnray.vision.measurements import write_measurements
from tests.compare.crossval.conftest import NOISE
from tests.solvers.conftest import observed_at


def run(line: str, out: Path) -> int:
    return main([*shlex.split(f"crossval {line} --mesh-size 2"), "--out", str(out)])


def layouts_of(out: Path, truth: str = "sliding") -> dict[str, Any]:
    """The layouts of a truth in `crossval.json`."""
    return json.loads((out / "crossval.json").read_text())["truths"][truth]["layouts"]


def rows_of(file: Path, *keys: str) -> dict[tuple[str, ...], dict[str, str]]:
    """The rows of a CSV file by some of their cells."""
    with file.open() as opened:
        return {tuple(row[key] for key in keys): row for row in csv.DictReader(opened)}


@pytest.mark.slow
def test_the_command_writes_what_the_guide_says_and_goes_on(tmp_path, capsys, in_line):
    line = "--solvers fem,gp,fem-asm --schemes tip-out --solver-set fem-asm.choose=given"
    assert run(f"{line} --seeds 1 --pictures pdf", tmp_path) == 0
    assert {path.name for path in tmp_path.glob("*.pdf")} == {"fields.pdf", "l_curve.pdf"}
    joints = layouts_of(tmp_path)["joints"]
    assert list(joints["solvers"]) == ["fem", "gp", "fem-asm"]
    assert joints["solvers"]["fem"]["schemes"]["tip-out"]["held_out"]["mae_sum"]["low"] is None
    before = joints["solvers"]["gp"]["schemes"]["tip-out"]["held_out"]["mae_sum"]["mean"]
    assert "simulated by fem-nonlinear" in joints["measurements"]["description"]
    curve = rows_of(tmp_path / "l_curve.csv", "truth", "layout")
    assert list(curve) == [("sliding", "joints")]

    assert run(f"{line} --seeds 2", tmp_path) == 0
    assert not [*tmp_path.glob("*.pdf")]  # of the earlier study
    solvers = layouts_of(tmp_path)["joints"]["solvers"]
    against = solvers["fem-asm"]["against"]["fem"]["tip-out"]
    assert (against["mae_sum"]["verdict"], against["von_mises"]["verdict"]) == ("better", "worse")
    predictions, stresses = json.loads((tmp_path / "crossval.json").read_text())["answers"].values()
    assert predictions == [
        f"{label} against {baseline}: {schemes['tip-out']['mae_sum']['verdict']} in tip-out."
        for label in ("gp", "fem-asm")
        for baseline, schemes in solvers[label]["against"].items()
    ]
    assert any("von Mises stress" in sentence for sentence in stresses)
    rows = rows_of(tmp_path / "held_out.csv", "solver", "scheme")
    mean = solvers["gp"]["schemes"]["tip-out"]["held_out"]["mae_sum"]["mean"]
    assert float(rows["gp", "tip-out"]["held_out_mae_sum_mm"]) == mean != before
    assert rows["fem", "all"]["in_sample_mae_sum_mm"] == ""

    assert run(f"{line} --seeds 1 --noise 0.02", tmp_path) == 2
    assert "holds a cross-validation with other settings (noise_mm)" in capsys.readouterr().err


@pytest.mark.slow
def test_layouts_sample_one_truth_and_stay_apart(tmp_path, in_line):
    """`fem` has one field, so its distance from the truth is the same; its errors at markers are not."""
    line = "--solvers fem,gp --schemes one-out --seeds 1"
    assert run(f"{line} --layouts front,joints", tmp_path) == 0
    rows = rows_of(tmp_path / "held_out.csv", "layout", "solver", "scheme")
    assert list(rows)[::4] == [("front", "fem", "all"), ("joints", "fem", "all")]
    layouts = layouts_of(tmp_path)
    errors, fields = (
        [float(layouts[name]["solvers"]["fem"]["schemes"][ONE][kind][what]["mean"]) for name in layouts]
        for kind, what in (("held_out", "mae_v"), ("fields", "displacement"))
    )
    assert fields[0] == pytest.approx(fields[1], rel=1e-9)
    assert errors == pytest.approx([0.43, 0.53], abs=0.02)  # where the front wall alone is seen, and all
    # One layout alone reuses its folds, and has what it had beside the other.
    kept = tmp_path / "runs" / "sliding" / "front" / "gp" / "seed-0.json"
    before = kept.stat().st_mtime_ns
    assert run(f"{line} --layouts front", tmp_path) == 0
    assert kept.stat().st_mtime_ns == before
    assert layouts_of(tmp_path) == {"front": layouts["front"]}


@pytest.mark.slow
def test_solvers_are_judged_by_several_truths(tmp_path, capsys, in_line):
    """`fem` has one field: the same error in all truths would mean that there is one."""
    line = "--truth cylinder,base --solvers fem,gp --schemes one-out --seeds 1"
    assert run(line, tmp_path) == 0
    said = capsys.readouterr().out
    assert all(len(each) <= 80 for each in said.splitlines() if not each.startswith(str(tmp_path)))
    rows = rows_of(tmp_path / "truths.csv", "truth", "solver")
    assert list(rows) == [(truth, name) for truth in ("cylinder", "base") for name in ("fem", "gp")]
    assert rows["cylinder", "fem"]["mae_sum_against_gp"] == "worse"
    content = json.loads((tmp_path / "crossval.json").read_text())
    assert content["schema"] == 3
    for (truth, name), row in rows.items():
        each, contact = content["truths"][truth]["layouts"]["joints"], content["truths"][truth]["contact"]
        schemes = each["solvers"][name]["schemes"]
        assert float(row["true_force_N_mm"]) == contact["true_force_N_mm"]
        assert float(row["held_out_mae_sum_mm"]) == schemes[ONE]["held_out"]["mae_sum"]["mean"]
        assert float(row["force_error"]) == schemes[ALL]["force"]["mean"]
        assert ("cylinder" in each["measurements"]["description"]) == (truth == "cylinder")
    forces = [float(rows[truth, "fem"]["force_error"]) for truth in ("cylinder", "base")]
    assert abs(forces[0] - forces[1]) > 0.05
    names = [f"{name}-{truth}.png" for name in ("fields", "held_out") for truth in ("base", "cylinder")]
    assert sorted(path.name for path in tmp_path.glob("*.png")) == names

    assert run(line.replace("cylinder,base", "base"), tmp_path) == 0
    assert layouts_of(tmp_path, "base") == content["truths"]["base"]["layouts"]
    assert sorted(path.name for path in tmp_path.glob("*.png")) == ["fields.png", "held_out.png"]


@pytest.mark.slow
def test_force_and_place_that_a_solver_identifies_are_near_those_of_the_truth(tmp_path, in_line):
    """At finite strain `fem-id` finds both from the markers, and says how well."""
    assert run("--truth cylinder --solvers fem-id --schemes tip-out --seeds 1", tmp_path) == 0
    (row,) = rows_of(tmp_path / "truths.csv", "solver").values()
    assert abs(float(row["force_error"])) < 0.05
    assert abs(float(row["position_error_mm"])) < 0.5
    assert float(row["von_mises_within_stated"]) > 0.5  # on a mesh whose own error is 4 % of the stress
    assert {row["force_within_stated"], row["position_within_stated"]} <= {"0.0", "1.0"}


def test_measured_markers_have_no_truth(tmp_path, capsys, in_line, observations):
    file, out = tmp_path / "markers.csv", tmp_path / "out"
    write_measurements(file, replace(observations, simulated=False, visible=np.arange(9) != 4))
    assert run(f"--measurements {file} --solvers fem,gp --schemes one-out,load-out --seeds 1", out) == 0
    printed = capsys.readouterr()
    assert "load-out needs a truth at other loads, and is skipped" in printed.err
    assert str(out / "held_out.csv") in printed.out
    assert "fields.csv" not in printed.out
    assert list(json.loads((out / "crossval.json").read_text())["schemes"]) == ["all", "one-out"]
    gp = layouts_of(out, "measured")["measured"]["solvers"]["gp"]["schemes"]["one-out"]
    assert (len(gp["per_marker"]), gp["fields"]) == (8, {})
    assert not [*out.glob("fields.*")]


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
    assert len(layouts_of(out, "measured")["measured"]["remarks"]) == 2


def test_simulated_markers_of_a_file_are_called_simulated_everywhere(tmp_path, capsys, in_line, observations):
    file, out = tmp_path / "markers.csv", tmp_path / "out"
    write_measurements(file, replace(observations, simulated=True, source="made up"))
    assert run(f"--measurements {file} --solvers fem,gp --schemes one-out --seeds 1", out) == 0
    printed = capsys.readouterr()
    written = [path for path in out.rglob("*") if path.suffix in (".json", ".csv", ".html")]
    assert len(written) > 5
    for path in written:
        assert "measured" not in str(path.relative_to(tmp_path)), path
        assert not re.search(r"\bmeasured\b", path.read_text()), path
    for name in ("held_out.csv", "folds.csv"):
        assert set(rows_of(out / name, "truth", "layout")) == {("simulated", "simulated")}, name
    assert "measured" not in printed.out + printed.err


def test_a_study_runs_from_python_and_prints_nothing(tmp_path, capsys, in_line, observations):
    study = CrossvalStudy(
        design=Design(),
        variants=solver_variants([make_solver("gp")], Material()),
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
    row = result.table().loc["measured", "measured", "gp", ONE]
    assert (
        row["held_out_mae_sum_mm"]
        == result.cases["measured", "measured"].scores["gp"][ONE].held_out["mae_sum"].mean
    )
    assert np.isnan(row["from_fem_mean_mm"])  # fem is not in the study


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
    assert list(layouts_of(tmp_path / "out", "measured")["measured"]["solvers"]) == ["gp", "fem"]


def test_a_solver_that_chooses_its_weights_is_there_in_three_ways():
    from pinnray.commands.comparison.crossval import read_variants
    from pinnray.options.shared import SolverOptions

    variants = read_variants(SolverOptions(), "fem,fem-asm", Material())
    labels = ["fem", "fem-asm", "fem-asm left-out", "fem-asm evidence"]
    assert [variant.label for variant in variants] == labels
    assert [variant.settings.get("choose") for variant in variants] == [None, "given", "left-out", "evidence"]
    fixed = SolverOptions(solver_set=("fem-asm.choose=left-out",))
    assert [variant.label for variant in read_variants(fixed, "fem-asm", Material())] == ["fem-asm"]
    stiff = Material(law="neo-hookean")  # for which there is nothing to choose
    assert [variant.label for variant in read_variants(SolverOptions(), "fem-asm", stiff)] == ["fem-asm"]


@pytest.mark.slow
def test_turned_pictures_are_told_and_cost_statfem_little(tmp_path, in_line):
    """Its held-out error is that of straight pictures within a half; `fem` knows of no picture."""
    frame, errors = '--frame "turn 3 deg, shift 0.3 mm, scale 1 %"', {}
    for name, option in (("straight", ""), ("turned", frame)):
        line = f"--solvers statfem,fem --schemes one-out --seeds 1 {option}"
        assert run(line, tmp_path / name) == 0
        own = layouts_of(tmp_path / name)["joints"]["solvers"]
        errors[name] = {
            solver: own[solver]["schemes"]["one-out"]["held_out"]["mae_sum"]["mean"] for solver in own
        }
    assert errors["turned"]["statfem"] < 1.5 * errors["straight"]["statfem"]
    assert errors["turned"]["fem"] > errors["straight"]["fem"] + 0.1


def test_every_seed_has_its_own_frame_of_the_pictures(tmp_path, observations):
    study = CrossvalStudy(design=Design(), variants=[], out=tmp_path, frame=HAND_HELD)
    turned = study.pressed_picture(observations.points, 0)
    np.testing.assert_allclose(np.abs(turned.values), [5.0, 1.0, 1.0, 0.02, 0.01, 0.01])
    np.testing.assert_array_equal(turned.centre, observations.points.mean(axis=0))
    others = [study.pressed_picture(observations.points, seed).values.tolist() for seed in range(1, 9)]
    assert len({tuple(each) for each in others}) > 3
