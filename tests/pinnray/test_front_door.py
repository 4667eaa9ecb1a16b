"""The front door: names, quick import, forgiving inputs, objects that show themselves."""

import dataclasses
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import pinnray as pr
from pinnray.comparison.figures.gallery import GALLERY
from pinnray.geometry.mesh.settings import MeshSettings
from pinnray.solvers.fem.linear import FemSolver

pytestmark = pytest.mark.usefixtures("few_elements_throughout")

HEAVY = ("torch", "dolfinx", "cadquery", "gmsh", "cv2", "pyvista", "pandas", "matplotlib", "scipy")
COARSE = {"size": 1.0}


@pytest.fixture(scope="module")
def comparison() -> pr.Comparison:
    return pr.compare("default", ["fem", "fem-asm"], size=1.0)


def test_the_import_loads_no_heavy_library():
    code = f"import pinnray, sys; print([name for name in {HEAVY} if name in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


@pytest.mark.parametrize("name", pr.__all__)  # type: ignore[attr-defined]
def test_every_name_leads_somewhere(name: str):
    found = getattr(pr, name)
    assert found if name == "MATERIALS" else found.__name__ == name


def test_an_unknown_name_is_an_attribute_error():
    with pytest.raises(AttributeError, match="'pinnray' has no attribute 'sovle'"):
        _ = pr.sovle  # type: ignore[attr-defined]


def test_the_table_has_a_row_a_solver_and_units_in_its_columns(comparison: pr.Comparison):
    table = comparison.table()
    assert list(table.index) == ["fem", "fem-asm"]
    assert table.loc["fem", "held_out_mae_u_mm"] == pytest.approx(1.41, abs=0.05)
    assert np.isnan(table.loc["fem", "in_sample_mae_u_mm"])
    assert table.loc["fem-asm", "in_sample_mae_u_mm"] < 0.1
    assert table.loc["fem", "to_reference_displacement_rel_l2"] == 0
    assert table["energy_N_mm_per_mm"].dtype == float


@pytest.mark.parametrize("picture", ["overlay", "marker_errors", "von_mises", "design"])
def test_a_picture_of_the_comparison_is_a_png_in_a_notebook(comparison: pr.Comparison, picture: str):
    assert comparison.plot(picture)._repr_png_()[:8] == b"\x89PNG\r\n\x1a\n"


def test_the_report_is_one_file(comparison: pr.Comparison, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    chosen = {name: GALLERY[name] for name in ("overlay", "mesh")}
    monkeypatch.setattr("pinnray.comparison.figures.gallery.GALLERY", chosen)
    text = comparison.report(tmp_path / "report.html").read_text(encoding="utf-8")
    assert "data:image/webp;base64," in text  # the large ones
    assert [path.name for path in tmp_path.iterdir()] == ["report.html"]


def test_measurements_can_be_a_data_frame_and_a_solver_an_object():
    frame = pd.DataFrame({"x_mm": [20, 85], "y_mm": [-1, -1], "u_mm": [-0.5, np.nan], "v_mm": [-5, np.nan]})
    frame["visible"] = [True, False]
    compared = pr.compare(pr.Design(), [FemSolver(degree=1)], measurements=frame, size=1.5)
    assert compared.observations.visible.tolist() == [True, False]
    assert not compared.observations.simulated


class Raising(FemSolver):
    """A solver with a fault."""

    name = "raising"

    def solve(self, problem, progress=None):
        raise ZeroDivisionError("by nothing")


def test_a_solver_that_raises_has_a_warning_a_row_and_a_traceback():
    with pytest.warns(UserWarning, match="solver raising raised ZeroDivisionError: by nothing"):
        compared = pr.compare("default", ["fem", Raising()], size=2.0)
    row = compared.table().loc["raising"]
    assert not row["converged"]
    assert np.isnan(row["energy_N_mm_per_mm"])
    assert row["status"] == compared.failed["raising"]
    assert 'raise ZeroDivisionError("by nothing")' in compared.tracebacks["raising"]
    with pytest.raises(pr.UserError, match="solver raising raised ZeroDivisionError"):
        compared["raising"]


class Lost(FemSolver):
    """A solver without a number."""

    name = "lost"

    def solve(self, problem, progress=None):
        return dataclasses.replace(super().solve(problem), energy=np.nan)


def test_a_solution_without_numbers_takes_no_other_ones_away():
    with pytest.warns(UserWarning, match="solver lost: its energy is not finite"):
        compared = pr.compare("default", ["fem", Lost()], size=2.0)
    assert compared.table().loc["fem", "converged"]
    assert compared.table().loc["lost", "status"] == compared.failed["lost"]


def test_what_does_not_converge_is_said_as_on_the_command_line():
    """By the certificate, too: these elements are too stiff, and the solver does not know it."""
    stiff = FemSolver(degree=1)
    with pytest.warns(UserWarning, match="fem did not converge: .* its energy is .* above that of fem"):
        alone = pr.solve("default", stiff, size=2.0)
    assert not alone.status.converged
    with pytest.warns(UserWarning, match="fem did not converge: .* its energy is .* above that of fem"):
        assert pr.compare("default", [stiff], size=2.0).unconverged


def test_constants_of_a_named_material_can_be_other_ones():
    """As with `--material tpu-95a --young 9`."""
    given = pr.solve("default", "fem", material="TPU 95A", young=9.0, size=2.0).problem.material
    assert (given.young, given.poisson, given.substance.name) == (9.0, 0.45, "tpu-95a")


def test_the_first_call_warns_as_every_other(tmp_path: Path):
    """FFCx, which it imports, would send all warnings into a log."""
    code = (
        "import pinnray as pr, warnings\n"
        "with warnings.catch_warnings(record=True) as told:\n"
        "    pr.solve('default', 'fem', size=2, stroke=80.0)\n"
        "print(len(told))"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=tmp_path
    )
    assert int(done.stdout) > 0


def test_a_folder_of_temporary_files_that_cannot_be_written_ends_nothing(tmp_path: Path):
    """MPI would abort with a page of text."""
    code = "import pinnray as pr; pr.solve('default', 'fem', size=2)"
    environment = os.environ | {"TMPDIR": "/proc/none"}
    subprocess.run([sys.executable, "-c", code], check=True, cwd=tmp_path, env=environment)


def test_a_design_or_a_problem_is_solved_and_shows_itself():
    mesh = pr.mesh("default", **COARSE)
    solution = pr.solve(pr.Problem(mesh), pr.solver("fem"))
    again = pr.solve("default", size=1.0)
    assert again.energy == pytest.approx(solution.energy, rel=1e-9)
    assert solution.plot("von_mises")._repr_png_().startswith(b"\x89PNG")
    assert solution.plot(scale=0.0).axes[0].get_title("left").endswith("displacement times 0")


def test_a_design_and_a_mesh_show_themselves():
    shown = pr.load_design("slender")._repr_html_()
    assert 'src="data:image/png;base64,' in shown
    assert shown.count("<tr>") == 9
    mesh = pr.mesh("default", **MeshSettings(**COARSE).model_dump())
    assert f'<td style="text-align:left">{len(mesh.points)}</td>' in mesh._repr_html_()
    assert pr.Design().plot()._repr_png_().startswith(b"\x89PNG")


def test_a_load_that_does_not_move_has_no_displacement():
    solution = pr.solve("default", "fem", load=pr.Load(displacement=(0.0, 0.0)), **COARSE)
    assert not solution.reaction.any()


def test_what_no_real_finger_does_is_said_of_a_solution():
    with pytest.warns(UserWarning, match="fem: THE BODY GOES THROUGH ITSELF; self-contact is not modelled"):
        solution = pr.solve("default", "fem", load=pr.Load(displacement=(0.0, -60.0)), **COARSE)
    assert "THE BODY GOES THROUGH ITSELF" in solution.status.message


@pytest.mark.slow
def test_a_sweep_is_a_data_frame_and_predicts(tmp_path: Path):
    from tests.studies.emulator.sweeps import solved_sweep

    folder = solved_sweep(tmp_path / "ref", count=24)
    finger = {"height": 95, "base_width": 30, "rib_angle": 5, "tip_length": 20, "rib_count": 4}
    walls = {"rib_thickness": 1.5, "front_thickness": 1.5, "back_thickness": 1.5}
    found = pr.predict(folder, [{**finger, **walls}, {**finger, **walls, "front_thickness": 2.0}])
    assert list(found["front_thickness_mm"]) == [1.5, 2.0]
    assert (found["force_N_low"] < found["force_N"]).all()
    assert found["force_N"].is_monotonic_increasing
    with pytest.raises(pr.UserError, match=r"finger 1: .*rib_thickness"):
        pr.predict(folder, [{**finger, **walls}, {**finger, **walls, "rib_thickness": 9.0}])
