"""The main job: what it writes, what it leaves when it is stopped, and how it goes on from there."""

import hashlib
import json
import re
from collections.abc import Callable
from dataclasses import dataclass, replace
from datetime import datetime
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import pytest
import pyvista

from pinnray.comparison.evaluation.scores import Scores
from pinnray.comparison.figures.gallery import GALLERY
from pinnray.comparison.pipeline.job import Job
from pinnray.geometry.cache import finger_mesh
from pinnray.geometry.finger.design import Design
from pinnray.geometry.mesh.settings import MeshSettings
from pinnray.geometry.observations import Observations
from pinnray.geometry.picture_frame import FIXED, HAND_HELD
from pinnray.runtime.errors import UserError
from pinnray.runtime.machine import package_versions
from pinnray.solvers.fem.linear import FemSolver
from pinnray.solvers.problem import Material, Problem
from pinnray.solvers.solution import Solution, Status
from pinnray.solvers.solver import NoSolutionError, Progress, silent
from pinnray.vision.measurements import read_measurements
from tests.compare.pipeline.runs import compare
from tests.compare.tables import rows_of

pytestmark = pytest.mark.usefixtures("few_elements_throughout")

COARSE = MeshSettings(size=1.0)


@dataclass
class Scripted:
    """`fem` under another name, which counts its calls and ends as the test says."""

    name: str
    end: BaseException | Callable[[Solution], Solution] | None = None
    degree: int = 2
    calls: int = 0
    laws: ClassVar[tuple[str, ...]] = ("linear",)
    loads: ClassVar[tuple[str, ...]] = ("mean", "point")

    def settings(self) -> dict[str, object]:
        return {"degree": self.degree}

    def solve(self, problem: Problem, progress: Progress = silent) -> Solution:
        self.calls += 1
        if isinstance(self.end, BaseException):
            raise self.end
        solution = FemSolver(degree=self.degree).solve(problem, progress)
        return self.end(solution) if self.end else solution


def files(folder: Path) -> dict[str, bytes]:
    return {
        path.relative_to(folder).as_posix(): path.read_bytes() for path in folder.rglob("*") if path.is_file()
    }


def strictly(path: Path) -> dict[str, Any]:
    """JSON without the NaN and Infinity that Python would let pass."""

    def refuse(constant: str) -> None:
        raise AssertionError(f"{path.name} holds {constant}")

    return json.loads(path.read_text(encoding="utf-8"), parse_constant=refuse)


def without_times(told: dict[str, Any]) -> dict[str, Any]:
    copy = json.loads(json.dumps(told))
    for solver in copy["solvers"].values():
        del solver["seconds"], solver["stats"]["seconds"], solver["stats"]["estimate_seconds"]
    return copy


# What a whole run writes


def test_every_file_of_the_design_is_there(finished):
    pictures = (
        "design force_displacement marker_errors mesh overlay strain_principal strain_xx "
        "strain_xy strain_yy von_mises"
    )
    others = (
        "report.html metrics.json run.json markers.csv summary.csv observations.csv table1.csv "
        "force_displacement.csv fields/truth.vtu fields/fem.vtu fields/fem-nonlinear.vtu solutions/fem.npz "
        "solutions/fem-nonlinear.npz"
    )
    content = files(finished)
    assert set(content) == {*others.split(), *(f"figures/{name}.png" for name in pictures.split())}
    digests = {name: hashlib.sha256(file).hexdigest() for name, file in content.items() if name != "run.json"}
    assert strictly(finished / "run.json")["files_sha256"] == digests
    assert not finished.with_name("run.partial").exists()


def test_run_json_tells_where_the_result_comes_from(finished):
    told = strictly(finished / "run.json")
    mesh = finger_mesh(Design(), settings=COARSE)
    assert told["design_sha256"] == Design().digest
    assert told["mesh_sha256"] == mesh.digest
    assert told["problem_sha256"] == Problem(mesh).digest
    assert told["measurements_sha256"] == told["files_sha256"]["observations.csv"]
    assert told["mesh"] == COARSE.model_dump()
    assert told["solvers"]["fem"] == {"degree": 2, "estimate": True}
    assert told["versions"] == package_versions()
    assert told["machine"]["cores"] > 0
    stages = "mesh measurements fem fem-nonlinear certificate checks fields tables pictures"
    assert list(told["seconds"]) == stages.split()
    assert datetime.fromisoformat(told["started"]).tzinfo is not None


def test_metrics_of_the_default_finger(finished):
    """At the markers `fem` is about 1.4 mm and 0.5 mm from a finite-strain run."""
    told = strictly(finished / "metrics.json")
    assert told["measurements"]["source"] == "simulated"
    assert told["measurements"]["markers"] == 9
    assert told["reference"] == "fem"
    assert told["solvers"]["fem"]["markers"]["mae_u"] == pytest.approx(1.41, abs=0.1)
    assert told["solvers"]["fem"]["markers"]["mae_v"] == pytest.approx(0.53, abs=0.05)
    assert told["solvers"]["fem"]["to_reference"]["rel_l2_displacement"] == 0
    assert 0.05 < told["solvers"]["fem-nonlinear"]["to_reference"]["rel_l2_displacement"] < 0.5


def test_tables_agree_with_metrics(finished):
    solvers = strictly(finished / "metrics.json")["solvers"]
    for marker, row in enumerate(rows_of(finished / "markers.csv")):
        for name, told in solvers.items():
            assert float(row[f"{name}_ae_u_mm"]) == told["markers"]["ae_u"][marker]
            assert float(row[f"{name}_ae_v_mm"]) == told["markers"]["ae_v"][marker]
    summary = {row["solver"]: row for row in rows_of(finished / "summary.csv")}
    assert list(summary) == list(solvers)
    for name, told in solvers.items():
        expected = {f"{key}_mm": told["markers"][key] for key in ("mae_u", "mae_v", "mae_sum", "mae_rss")}
        expected["energy_N_mm_per_mm"] = told["energy"]
        expected["to_reference_displacement_rel_l2"] = told["to_reference"]["rel_l2_displacement"]
        assert {key: float(summary[name][key]) for key in expected} == expected


@pytest.mark.parametrize("solver", ["fem", "fem-nonlinear"])
def test_fields_can_be_read_elsewhere(finished, solver):
    """The largest displacement of the VTU file is that of the solution at the mesh's nodes."""
    grid = pyvista.read(finished / "fields" / f"{solver}.vtu")
    mesh = finger_mesh(Design(), settings=COARSE)
    assert (grid.n_points, grid.n_cells) == (len(mesh.points), len(mesh.triangles))
    with np.load(finished / "solutions" / f"{solver}.npz") as archive:
        expected = np.abs(archive["node_displacement"]).max()
    assert np.abs(grid.point_data["displacement_mm"]).max() == pytest.approx(expected)
    assert grid.cell_data["von_mises_MPa"].min() > 0


def test_the_report_holds_the_numbers(finished):
    report = (finished / "report.html").read_text(encoding="utf-8")
    for told in strictly(finished / "metrics.json")["solvers"].values():
        for key in ("mae_u", "mae_v", "mae_sum", "mae_rss"):
            assert f"{told['markers'][key]:.3f}" in report
    pictures = re.findall("data:image/(?:png|webp);base64,", report)
    shown = [each for each in (finished / "figures").iterdir() if not each.stem.startswith("strain_")]
    shown += [finished / "figures" / "strain_principal.png"]
    assert len(pictures) == len(shown)
    assert strictly(finished / "run.json")["mesh_sha256"] in report


def test_the_observations_of_a_run_give_the_same_metrics_again(finished, job):
    """They stay simulated."""
    again = job(FemSolver(), mesh=COARSE, measurements=finished / "observations.csv")
    before, after = Scores.read(finished), compare(again).scores
    assert after.measurements == before.measurements
    assert after["fem"].markers == before["fem"].markers


def test_without_the_mark_they_count_as_measured(finished, tmp_path, job):
    bare = tmp_path / "bare.csv"
    bare.write_text((finished / "observations.csv").read_text().split("\n", 2)[2])
    again = job(FemSolver(), measurements=bare)
    outcome = compare(again)
    assert outcome.scores.content()["measurements"]["source"] == "measured"
    assert {row["observations"] for row in rows_of(again.out / "markers.csv")} == {"measured"}
    assert "simulated" not in (again.out / "observations.csv").read_text()
    assert "imulated" not in (again.out / "report.html").read_text(encoding="utf-8")


def test_a_marker_that_was_not_seen(tmp_path, monkeypatch):
    """Its errors are null and empty; pictures are drawn; the markers are not those of the design."""
    chosen = {name: GALLERY[name] for name in ("overlay", "marker_errors")}
    monkeypatch.setattr("pinnray.comparison.figures.gallery.GALLERY", chosen)
    path = tmp_path / "measured.csv"
    path.write_text("x_mm,y_mm,u_mm,v_mm,visible\n20,-1,-0.5,-5,1\n50,-1,,,0\n85,-1,-2,-0.5,1\n")
    out = tmp_path / "run"
    compare(Job(Design(), [FemSolver()], mesh=COARSE, measurements=path, out=out))
    told = strictly(out / "metrics.json")
    assert told["measurements"]["markers"] == 2
    errors = told["solvers"]["fem"]["markers"]
    assert [value is None for value in errors["ae_u"]] == [False, True, False]
    assert [value is None for value in errors["ae_v"]] == [False, True, False]
    assert errors["mae_u"] == pytest.approx((errors["ae_u"][0] + errors["ae_u"][2]) / 2)
    hidden = rows_of(out / "markers.csv")[1]
    assert hidden["visible"] == "0"
    assert [hidden[name] for name in ("observed_u_mm", "fem_ae_u_mm", "fem_ae_v_mm")] == [""] * 3
    read = read_measurements(out / "observations.csv", marker_radius=0.8)
    assert read.visible.tolist() == [True, False, True]


@dataclass
class Assimilating(Scripted):
    """Remembers what it was given."""

    assimilates: ClassVar[bool] = True
    given: Observations | None = None

    def solve(self, problem: Problem, progress: Progress = silent) -> Solution:
        self.given = problem.observations
        return super().solve(problem, progress)


def test_only_a_solver_that_assimilates_is_given_the_markers_and_it_is_marked(job):
    """The other would remember them too; what it says at them is a prediction."""
    blind = Assimilating("blind")
    blind.assimilates = False
    seeing = Assimilating("seeing")
    outcome = compare(wanted := job(blind, seeing))
    assert blind.given is None
    assert seeing.given.displacements.tolist() == [[-0.5, -5], [-2, -0.5]]
    solvers = strictly(wanted.out / "metrics.json")["solvers"]
    assert [solvers[name]["markers"]["in_sample"] for name in ("blind", "seeing")] == [False, True]
    assert [solvers[name]["held_out"] is None for name in ("blind", "seeing")] == [False, True]
    assert [evaluation.certificate is None for evaluation in outcome.evaluations] == [False, True]


def test_other_measurements_are_assimilated_again(job, tmp_path):
    """One that does not assimilate is taken over: its displacement is the same at the same markers."""
    other = tmp_path / "other.csv"
    other.write_text("x_mm,y_mm,u_mm,v_mm\n20,-1,-0.6,-5\n85,-1,-2,-0.5\n")
    compare(job(Scripted("blind"), Assimilating("seeing")))
    again = job(Scripted("blind"), Assimilating("seeing"), measurements=other, resume=True)
    compare(again)
    assert [solver.calls for solver in again.solvers] == [0, 1]


# Stopped halfway


@pytest.mark.parametrize(
    "end",
    [RuntimeError("a fault\nof two lines"), SystemExit(3), FileNotFoundError("w.npz")],
    ids=lambda end: type(end).__name__,
)
def test_a_run_goes_on_without_a_solver_that_raises(job, end):
    """The line names solver, exception and place; the traceback is kept, and so is the rest."""
    found = compare(job(Scripted("first"), Scripted("second", end), Scripted("third")))
    assert [evaluation.solver for evaluation in found.evaluations] == ["first", "third"]
    line, said = found.failed["second"], f"{type(end).__name__}: {' '.join(str(end).split())}"
    assert re.fullmatch(rf"solver second raised {said} \(.*test_pipeline\.py:\d+\); .*", line)
    out = job().out
    trace = (out / "errors/second.txt").read_text()
    assert "raise self.end" in trace
    assert f"{type(end).__name__}: {end}" in trace
    assert json.loads((out / "run.json").read_text())["failed"] == {"second": line}
    compare(job(Scripted("first"), Scripted("third"), resume=True))  # its file is one of the run's own


def test_a_run_goes_on_without_a_solver_that_finds_no_solution(job):
    """Nobody needs a traceback of that."""
    found = compare(job(Scripted("first"), Scripted("second", NoSolutionError("no equilibrium near rest"))))
    assert found.failed == {"second": "second found no solution: no equilibrium near rest"}
    assert not (job().out / "errors").exists()


@pytest.mark.parametrize("reference", [None, "second"], ids=["nothing is left", "it is the reference"])
def test_a_run_without_the_solver_that_it_needs_ends_in_one_line(job, reference):
    solvers = [Scripted("first")] * (reference is not None) + [Scripted("second", KeyError("x"))]
    with pytest.raises(UserError, match=r"solver second raised KeyError: 'x' \(.*test_pipeline\.py:\d+\)$"):
        compare(job(*solvers, reference=reference))


@pytest.mark.slow
@pytest.mark.parametrize(
    "changes",
    [
        {"design": Design(front_thickness=2.2)},
        {"material": Material(young=5.0)},
        {"package_versions": {"other": "1"}},
        {"sources_digest": "other"},
        {"degree": 1},
        {"measured": "x_mm,y_mm,u_mm,v_mm\n30,-1,0,-5\n"},
    ],
    ids=lambda changes: next(iter(changes)),
)
def test_another_job_is_not_resumed_from(job, measured, monkeypatch, changes):
    first = Scripted("first")
    compare(job(first))
    ((name, value),) = changes.items()
    again = {"resume": True}
    if name in ("package_versions", "sources_digest"):
        monkeypatch.setattr(f"pinnray.comparison.evaluation.evaluation.{name}", lambda *_: value)
    elif name == "degree":
        first.degree = value
    elif name == "measured":
        measured.write_text(value)
    else:
        again |= changes
    compare(job(first, **again))
    assert first.calls == 2


def test_what_an_interrupted_run_finished_is_taken_over_and_a_damaged_part_made_again(job):
    stopped = job(
        first := Scripted("first"), second := Scripted("second"), Scripted("third", KeyboardInterrupt())
    )
    with pytest.raises(KeyboardInterrupt):
        compare(stopped)
    kept = stopped.out.with_name(f"{stopped.out.name}.partial") / "solutions" / "first.npz"
    kept.write_bytes(kept.read_bytes()[:1000])
    with pytest.warns(RuntimeWarning, match="first.npz is damaged .* and is made again"):
        found = compare(job(first, second, Scripted("third"), resume=True))
    assert (first.calls, second.calls) == (2, 1)
    alone = compare(job(Scripted("first"), Scripted("second"), Scripted("third")))
    assert without_times(found.scores.content()) == without_times(alone.scores.content())


def test_a_solver_that_was_typed_into_a_notebook_is_not_resumed(job, monkeypatch):
    """Its class has no source file, so that an edit would bring the old result back."""
    monkeypatch.setattr(Scripted, "__module__", "notebook")
    first = Scripted("first")
    compare(job(first))
    with pytest.raises(UserError, match=r"^solver first has no source file, .*; do not resume, or move"):
        compare(job(first, resume=True))
    assert first.calls == 1


# Solvers from elsewhere


def test_numbers_of_numpy_are_no_obstacle(job):
    def with_numpy(solution: Solution) -> Solution:
        status = Status(np.bool_(True), "solved")
        stats = {"seconds": np.float32(0.5), "unknowns": np.int64(7)}
        return replace(solution, status=status, stats=stats, energy=np.float32(solution.energy))

    asked = job(Scripted("first", with_numpy))
    compare(asked)
    told = strictly(asked.out / "metrics.json")["solvers"]["first"]
    assert (told["status"], told["stats"]) == ("converged", {"seconds": 0.5, "unknowns": 7})
    assert told["energy"] == pytest.approx(told["certificate"]["fem_energy"], rel=1e-6)  # single precision


def test_a_result_that_its_solver_believes_in_but_finite_elements_do_not_is_marked(job, monkeypatch):
    """Linear elements on a coarse mesh: in JSON, both CSV files, report, fields and what pictures get."""
    drawn = []
    monkeypatch.setattr(
        "pinnray.comparison.pipeline.pipeline.draw_all",
        lambda _, comparison, *rest: drawn.extend(comparison.evaluations) or [],
    )
    asked = job(FemSolver(), Scripted("linear", degree=1))
    compare(asked)
    assert [evaluation.label for evaluation in drawn] == ["fem", "linear (not converged)"]
    told = strictly(asked.out / "metrics.json")["solvers"]
    assert [told[name]["status"] for name in ("fem", "linear")] == ["converged", "not converged"]
    assert "; its stress is out of balance by" in told["linear"]["message"]
    assert told["linear"]["certificate"]["rel_excess"] > 0.05 > told["fem"]["certificate"]["rel_excess"]
    assert [row["converged"] for row in rows_of(asked.out / "summary.csv")] == ["1", "0"]
    assert {row["linear_converged"] for row in rows_of(asked.out / "markers.csv")} == {"0"}
    assert pyvista.read(asked.out / "fields" / "linear.vtu").field_data["converged"][0] == 0


def test_the_archive_keeps_the_solvers_own_word(job):
    """The verdict is found again when a run is resumed, maybe with other limits."""
    asked = job(Scripted("linear", degree=1))
    first = compare(asked)
    with np.load(asked.out / "solutions" / "linear.npz") as archive:
        assert json.loads(str(archive["header"]))["converged"] is True
    again = compare(replace(asked, resume=True))
    assert asked.solvers[0].calls == 1
    assert without_times(again.scores.content()) == without_times(first.scores.content())


# Refused before anything is computed


def test_pictures_that_were_taken_as_they_are_are_said(job, observations):
    """By solvers that were given the markers and told of no frame."""
    loose = replace(observations, simulated=False, pressed=HAND_HELD)
    warnings = compare(job(Scripted("blind"), Assimilating("seeing"), measurements=loose)).warnings
    said = "seeing: the pictures' frames are not known, and were taken as they are"
    assert said in warnings
    known = replace(loose, pressed=FIXED)
    assert said not in compare(job(Scripted("blind"), Assimilating("seeing"), measurements=known)).warnings
