"""The command line as a user meets it: what it prints and returns."""

import csv
import json
import os
import sys
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from importlib.metadata import version
from io import BytesIO, TextIOWrapper
from pathlib import Path

import pytest

from pinnray.cli import compare_main, main
from pinnray.geometry.cache import cad_files, finger_mesh
from pinnray.geometry.finger.design import Design
from pinnray.options.preset_jobs import JOBS, JobDefaults
from pinnray.options.shared import FingerOptions, PhysicsOptions, SolverOptions
from pinnray.runtime.exits import BAD_INPUT, INTERRUPTED, NOT_CONVERGED
from pinnray.solvers.fem import adaptive_refinement as adapt
from pinnray.solvers.fem.linear import FemSolver
from pinnray.solvers.registry import PRESETS, solver_names
from pinnray.solvers.solution import Solution, Status
from tests.pinnray.commands.programs import run_python

pytestmark = pytest.mark.usefixtures("few_elements_throughout")

HEADER = "x_mm,y_mm,u_mm,v_mm"
SMALL = ["compare", "--solvers", "fem", "--mesh-size", "1.0"]


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The current folder, with displacements of two markers."""
    (tmp_path / "good.csv").write_text(f"{HEADER}\n20,-1,0,-5\n85,-1,-2,-0.5\n", encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    return tmp_path


# What is printed


def test_the_table_and_the_report_are_named(folder, capsys, without_pictures):
    assert compare_main([*SMALL[1:], "--measurements", "good.csv"]) == 0
    output = capsys.readouterr()
    mae = json.loads(Path("out/default-good/metrics.json").read_text())["solvers"]["fem"]["markers"]["mae_u"]
    row, _ = [line for line in output.out.splitlines() if line.startswith("  fem ")]
    assert f"{mae:.3f}" in row
    assert Path("out/default-good/report.html").is_file()
    stages = [line.split(":")[0] for line in output.err.splitlines()]
    assert stages == [
        "mesh",
        "measurements",
        "fem",
        "certificate",
        "checks",
        "fields",
        "tables",
        "pictures",
        "report",
    ]


def test_json_prints_the_metrics_and_nothing_else(folder, capsys, without_pictures):
    assert main([*SMALL, "--measurements", "good.csv", "--json", "--out", "here"]) == 0
    output = capsys.readouterr()
    assert json.loads(output.out) == json.loads(Path("here/metrics.json").read_text())
    assert output.err == ""


@pytest.mark.slow
def test_markers_that_no_finger_explains_are_said_first(folder, capsys, without_pictures):
    """They were in reverse order: the run had ended with 0, "converged" and no warning."""
    markers = Path(__file__).parents[2] / "data" / "second-renderer" / "reversed.csv"
    given = "--mesh-size 3 --set contact_position=36.5 --stroke 9.5 --solvers fem,fem-id --out here"
    given += " --solver-set fem-id.law=given --solver-set fem-id.parameters=position,normal_force"
    assert main(["compare", *given.split(), "--measurements", str(markers)]) == NOT_CONVERGED
    told = json.loads(Path("here/metrics.json").read_text())
    assert told["solvers"]["fem-id"]["status"] == "not converged"
    assert "NO FINGER OF THIS DRAWING EXPLAINS THE MARKERS" in told["warnings"][0]
    assert told["solvers"]["fem-id"]["identified"]["force"]["value"] > 0
    errors = capsys.readouterr().err
    assert errors.index(told["warnings"][0]) < errors.index("error: fem-id did not converge")
    assert "NO FINGER OF THIS DRAWING" in Path("here/report.html").read_text()


def test_the_options_reach_the_job(folder, capsys, without_pictures):
    options = "--set N=5 --young 3 --poisson 0.3 --plane stress --load point --stroke 4 --slide"
    options += " --solver-set fem.degree=1"  # whose stress is far from that of quadratic elements
    given = [*SMALL, *options.split(), "--measurements", "good.csv", "--json", "--out", "here"]
    assert main(given) == NOT_CONVERGED
    told = json.loads(capsys.readouterr().out)
    assert told["design"]["rib_count"] == 5
    elastic = {"young": 3, "young_deviation": 0, "poisson": 0.3, "plane": "stress", "law": "linear"}
    assert told["material"] == {**elastic, "loss": 0}
    unsaid = {"position": None, "radius": None, "friction": 0.0}
    assert told["load"] == {"kind": "point", "displacement": [None, -4], **unsaid}
    assert told["solvers"]["fem"]["stats"]["degree"] == 1
    assert json.loads(Path("here/run.json").read_text())["mesh"]["size"] == 1


def test_the_direction_turns_the_travel_toward_the_tip():
    _, load = PhysicsOptions(stroke=5.0, direction=30.0).read()
    assert load.displacement == pytest.approx((2.5, -2.5 * 3**0.5))


@pytest.mark.parametrize(
    ("settings", "name"),
    [
        ([], "default"),
        (["N=5"], "default-rib_count-5"),
        (["rib_count=+5", "L_angle=-10.5"], "default-rib_count-5-rib_angle--10.5"),
        (["N=5", "name=mine"], "mine"),
    ],
)
def test_a_changed_design_has_a_folder_of_its_own(settings, name):
    assert FingerOptions(set=tuple(settings)).read()[0].name == name


@pytest.mark.parametrize(
    ("preset", "finger", "physics", "mesh", "load"),
    [
        (None, {}, {}, (0.25, 4), "mean"),
        ("fast", {}, {}, (0.25, 4), "mean"),
        ("paper", {}, {}, (0.0823, 1), "point"),
        ("paper", {"mesh_size": 0.5}, {"load": "mean"}, (0.5, 1), "mean"),  # what is given wins
        ("paper", {"mesh_size": 0.25}, {"load": "point"}, (0.25, 1), "point"),  # even if it is the usual
    ],
)
def test_a_preset_brings_its_job_unless_told_otherwise(preset, finger, physics, mesh, load):
    settings = FingerOptions(**finger).read(preset)[1]
    assert (settings.size, settings.coarsening) == mesh
    assert PhysicsOptions(**physics).read(preset)[1].kind == load


def test_the_seed_reaches_every_preset():
    for preset in ("fast", "paper", "trained"):
        (solver,) = SolverOptions(preset=preset, seed=7).read("pinn-std")
        assert (solver.settings()["preset"], solver.settings()["seed"]) == (preset, 7)


def test_a_setting_of_one_solver_wins_over_an_option_for_all():
    texts = ("pinn-std.preset=fast", "pinn-std.seed=3")
    (solver,) = SolverOptions(preset="paper", seed=7, solver_set=texts).read("pinn-std")
    assert (solver.settings()["preset"], solver.settings()["seed"]) == ("fast", 3)


@pytest.mark.slow
def test_the_paper_mesh_has_about_as_many_nodes_as_the_paper():
    """90,959; another release of Gmsh may place them a little differently."""
    design, settings = FingerOptions().read("paper")
    assert len(finger_mesh(design, settings=settings).points) == pytest.approx(90_959, rel=0.005)


def test_a_design_with_many_changes_still_has_a_name():
    changes = ("rib_thickness=2.1", "front_thickness=2.1", "back_thickness=2.1", "base_thickness=2.1")
    names = {FingerOptions(set=(*changes, f"height={height}")).read()[0].name for height in (95, 96)}
    assert [len(name) for name in names] == [64, 64]  # and they differ


def test_without_names_a_solver_that_cannot_do_the_job_is_left_out(folder, capsys, monkeypatch):
    """Two are known before anything is solved, for their law, and one once the markers are."""
    monkeypatch.setattr("pinnray.comparison.pipeline.pipeline.draw_all", lambda *_: [])
    monkeypatch.setitem(JOBS, "", JobDefaults(solvers="gp,fem-id,fem,fem-nonlinear"))
    options = ["--load", "patch", "--plane", "stress", "--mesh-size", "1", "--measurements", "good.csv"]
    assert main(["compare", *options]) == 0
    output = capsys.readouterr()
    warnings = [line for line in output.err.splitlines() if line.startswith("warning: ")]
    assert len(warnings) == 3
    assert not any(line.startswith("gp:") for line in output.err.splitlines())
    run = json.loads(Path("out/default-good/run.json").read_text())
    assert (list(run["solvers"]), list(run["left_out"])) == (["fem"], ["fem-id", "fem-nonlinear", "gp"])


# How a run ends


def ends(monkeypatch: pytest.MonkeyPatch, end: BaseException | Callable[[Solution], Solution]) -> None:
    """Let `fem` end as the test says."""
    solve = FemSolver.solve

    def scripted(self: FemSolver, *arguments: object) -> Solution:
        if isinstance(end, BaseException):
            raise end
        return end(solve(self, *arguments))

    monkeypatch.setattr(FemSolver, "solve", scripted)
    # The check of the measurements solves with `fem`, too.
    monkeypatch.setattr("pinnray.comparison.pipeline.pipeline.displacement_remarks", lambda *_: [])


def test_an_interrupted_run_says_how_to_go_on(folder, capsys, monkeypatch, without_pictures):
    options = ["compare", "--solvers", "fem-nonlinear,fem", "--mesh-size", "1.0", "--quiet"]
    options += ["--measurements", "good.csv"]
    with monkeypatch.context() as patch:
        ends(patch, KeyboardInterrupt())
        assert main(options) == INTERRUPTED
    output = capsys.readouterr()
    assert output == ("", "interrupted; what was finished is kept; --resume goes on from it\n")
    assert not Path("out/default-good").exists()
    assert main([*options, "--resume"]) == 0
    assert not Path("out/default-good.partial").exists()


def test_another_jobs_finished_run_is_not_replaced_without_being_asked(folder, capsys, without_pictures):
    """By a folder of its own for measurements, by a refusal for other options; --out asks."""
    again = ["compare", "--from", "out/default/run.json", "--quiet"]
    assert main([*SMALL, "--quiet"]) == 0
    before = Path("out/default/run.json").read_bytes()
    assert main([*SMALL, "--measurements", "good.csv", "--quiet"]) == 0
    assert Path("out/default-good/run.json").is_file()
    capsys.readouterr()
    assert main([*SMALL, "--quiet", "--stroke", "5", "--seed", "1"]) == BAD_INPUT
    said = capsys.readouterr().err
    assert (
        "out/default holds the finished run of another job (other seed, stroke); name another output folder"
        in said
    )
    assert Path("out/default/run.json").read_bytes() == before
    assert main([*again, "--design", "default", "--load", "mean"]) == 0  # as by default: the same job
    assert main([*again, "--stroke", "5", "--out", "out/default"]) == 0
    assert json.loads(Path("out/default/run.json").read_text())["options"]["stroke"] == 5.0


def test_a_solver_that_did_not_converge_has_its_own_exit_code(folder, capsys, monkeypatch, without_pictures):
    """The result is written all the same."""
    status = Status(False, "stopped at 40 % of the load;\n take smaller steps")
    ends(monkeypatch, lambda solution: replace(solution, status=status))
    assert main([*SMALL, "--measurements", "good.csv", "--quiet"]) == NOT_CONVERGED
    said = "error: fem did not converge: stopped at 40 % of the load; take smaller steps\n"
    assert capsys.readouterr() == ("", said)
    assert Path("out/default-good/report.html").is_file()


@pytest.mark.parametrize(("width", "mm"), [("85", 85), ("85mm", 85), ("18 cm", 180), ("3.35in", 85.09)])
def test_a_width_has_a_unit_or_is_in_mm(folder, monkeypatch, width, mm):
    found = []
    monkeypatch.setattr(
        "pinnray.comparison.pipeline.pipeline.draw_all", lambda *given: found.append(given[-1]) or []
    )
    assert main([*SMALL, "--quiet", "--width", width]) == 0
    assert found == [pytest.approx(mm)]


def test_a_missing_library_is_one_line(folder, capsys, monkeypatch):
    monkeypatch.setitem(sys.modules, "pinnray.solvers.pinn.finite_basis.presets", None)
    assert main(["compare", "--solvers", "pinn-std"]) == BAD_INPUT
    assert capsys.readouterr().err.startswith("error: solver 'pinn-std' cannot be loaded: ")


# The other verbs


def test_solvers_are_listed(capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    assert main(["solvers"]) == 0
    listed = capsys.readouterr().out
    assert "…" not in listed  # no value is cut off
    assert all(f" {name} " in listed for name in solver_names())
    assert all(f"preset={preset}" in listed for presets in PRESETS.values() for preset in presets)


def test_a_terminal_in_ascii_shows_what_it_lacks_as_question_marks(monkeypatch):
    with TextIOWrapper(BytesIO(), encoding="ascii") as terminal:
        monkeypatch.setattr("sys.stdout", terminal)
        assert main(["material"]) == 0
        assert b"?" in terminal.buffer.getvalue()


def test_one_solver_that_follows_the_load_has_its_forces_beside_the_fields(folder, capsys):
    options = "--mesh-size 1.0 --load patch --slide --stroke 2 --law st-venant-kirchhoff"
    assert main(["solve", "fem-nonlinear", *options.split(), "--out", "fields/pressed.vtu"]) == 0
    written = [
        f"fields/pressed{end}" for end in (".vtu", "_force_displacement.csv", "_force_displacement.png")
    ]
    assert capsys.readouterr().out.splitlines()[-3:] == written
    rows = list(csv.DictReader(Path(written[1]).read_text().splitlines()))
    assert rows[0]["law"] == "st-venant-kirchhoff"
    assert rows[-1]["stroke_mm"] == "2.0"


@pytest.fixture
def cad_in_cache(tmp_path_factory) -> None:
    cad_files(Design(), tmp_path_factory.mktemp("cad"))


@pytest.mark.parametrize(
    ("command", "said"),
    [
        (["solve", "fem", "--out", "here/fem.vtu"], "error: here/fem.vtu: File too large"),
        (["mesh", "--out", "here"], "error: here/mesh.vtu: File too large"),
        (["design", "--out", "here"], "error: here/"),
    ],
)
def test_a_full_disk_is_told_in_one_line_and_leaves_no_part_of_a_file(
    command, said, folder, usual_mesh, cad_in_cache, full_disk, capsys
):
    assert main([*command, "--mesh-size", "1.0"]) == BAD_INPUT
    errors = [line for line in capsys.readouterr().err.splitlines() if not line.startswith(("mesh:", "fem:"))]
    assert len(errors) == 1 + (command[0] == "solve")  # the stage of the certificate
    assert errors[-1].startswith(said)
    assert all(path.stat().st_size < 4096 for path in Path("here").iterdir())
    assert not list(Path("here").glob(".*"))


# Surroundings


@pytest.mark.release
def test_a_home_that_cannot_be_written_is_not_needed(folder, tmp_path_factory):
    """Neither for the mesh nor for what DOLFINx compiles and matplotlib remembers."""
    cache = tmp_path_factory.mktemp("cache")
    place = {"HOME": "/proc/absent", "PINNRAY_CACHE": str(cache)}
    line = ["-m", "pinnray.cli", "solve", "fem", "--mesh-size", "1.0", "--out", "here/fem.vtu"]
    done = run_python(*line, before="unset XDG_CACHE_HOME;", **place)
    assert (done.returncode, "/proc/absent" in done.stderr) == (0, False), done.stderr
    assert {path.name for path in cache.iterdir()} >= {"fenics"}


# A solver of another package


@pytest.mark.slow
def test_a_plug_in_runs_in_the_main_job(folder, plugin_folder, monkeypatch, capsys, without_pictures):
    monkeypatch.syspath_prepend(str(plugin_folder))
    options = "--solvers fem,skfem-p2 --mesh-size 1.0 --measurements good.csv --json"
    assert main(["compare", *options.split()]) == 0
    output = capsys.readouterr()
    assert output.err == ""
    told = json.loads(output.out)["solvers"]["skfem-p2"]
    assert told["message"] == "solved directly"
    # The same elements as those of `fem`, assembled by another program: rounding.
    assert told["to_reference"]["rel_l2_displacement"] < 1e-8
    assert Path("out/default-good/fields/skfem-p2.vtu").is_file()


# Help


@pytest.mark.parametrize("arguments", [["--version"], ["compare", "--version"]])
def test_the_version_is_that_of_this_program(arguments, capsys):
    assert main(arguments) == 0
    assert capsys.readouterr().out == f"{version('pinn-ray')}\n"


def test_a_tolerance_that_is_missed_ends_with_its_own_code(folder, monkeypatch, capsys, without_pictures):
    """Everything is written, and the line says how far it came."""
    monkeypatch.setattr(adapt, "adapted", partial(adapt.adapted, most_rounds=2))
    options = ["--adapt", "1e-6", "--measurements", "good.csv", "--out", "adapted"]
    assert main([*SMALL, *options]) == NOT_CONVERGED
    assert "error: the markers are known to 0.01" in capsys.readouterr().err
    assert len(Path("adapted/adapt.csv").read_text(encoding="utf-8").splitlines()) == 3


@pytest.mark.parametrize(("given", "threads"), [("", {1}), ("OPENBLAS_NUM_THREADS=2", {2})])
def test_the_linear_algebra_computes_on_one_thread_unless_told_otherwise(given, threads):
    """So that numbers do not depend on the cores of a machine."""
    program = (
        "import pinnray.cli, numpy, petsc4py.PETSc; from threadpoolctl import threadpool_info; "
        "print({each['num_threads'] for each in threadpool_info() if each['internal_api'] == 'openblas'})"
    )
    unset = f"unset {' '.join(key for key in os.environ if key.endswith('_NUM_THREADS'))};"
    answer = run_python("-c", program, before=f"{unset} {given}")
    assert answer.stdout == f"{threads}\n"
