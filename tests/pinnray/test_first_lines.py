"""First lines of a user: keywords, defaults, one-line reprs, messages that suggest the right word."""

import sys
import warnings
from collections.abc import Callable
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import get_args

import numpy as np
import pandas as pd
import pytest

import pinnray as pr
from pinnray.comparison.figures.fields import VIEWED
from pinnray.geometry.mesh.settings import MeshSettings
from pinnray.solution import FieldName
from pinnray.solvers.finger_figures import figures_of
from pinnray.solvers.load import Physics

pytestmark = pytest.mark.usefixtures("few_elements_throughout", "discs_fitted_once")

ROOT = Path(__file__).parents[2]
COARSE = {"size": 2.0}
SHORT = [[20.0, -1.0], [50.0, -1.0]], [[-1.0, -3.0], [-1.5, -8.5]]


@pytest.fixture(scope="module")
def solved() -> pr.Solution:
    return pr.solve("default", "fem", **COARSE)


@pytest.fixture(scope="module")
def compared() -> pr.Comparison:
    return pr.compare("default", "fem", **COARSE)


# --- the words are understood ---


def test_finger_material_and_travel_are_keywords_of_solve():
    found = pr.solve("default", rib_count=6, young=5, stroke=8, **COARSE)
    material, load = pr.Material(young=5), pr.Load(displacement=(0.0, -8.0))
    design = pr.load_design("default", {"rib_count": 6})
    other = pr.solve(design, "fem", material=material, load=load, **COARSE)
    assert found.solver == "fem"
    assert found.problem.digest == other.problem.digest
    assert found.energy == pytest.approx(other.energy, rel=1e-12)


def test_a_preset_alone_means_the_network_that_has_it(monkeypatch: pytest.MonkeyPatch):
    from pinnray import functions

    class AskedToTrainError(Exception):
        """Stands for a training of minutes."""

    made = []

    def asked(solver, *_):
        made.append(solver)
        raise AskedToTrainError

    monkeypatch.setattr(functions, "solved", asked)
    with pytest.raises(AskedToTrainError):
        pr.solve("default", preset="trained", **COARSE)
    assert (made[0].name, made[0].settings()["preset"]) == ("pinn-std", "trained")


def test_a_design_is_changed_by_keywords_or_a_dictionary():
    assert pr.load_design("default", rib_count=6) == pr.load_design("default", {"N": 6})
    assert pr.mesh(rib_count=6, **COARSE).digest == pr.mesh(pr.Design(rib_count=6), **COARSE).digest


@pytest.mark.parametrize(
    ("short", "full"),
    [
        (lambda: pr.Load(stroke=5), lambda: pr.Load(displacement=(0.0, -5.0))),
        (lambda: pr.Load("cylinder"), lambda: pr.Load(kind="cylinder", radius=5.0)),
        (lambda: pr.Load("patch", slide=True), lambda: pr.Load(kind="patch", displacement=(None, -10.0))),
        (lambda: pr.Material(**{"E": 3, "nu": 0.4}), lambda: pr.Material(young=3, poisson=0.4)),
        (lambda: pr.Load("cylinder", stroke=4, direction=30), lambda: physics("cylinder", 4.0, 30.0)),
    ],
)
def test_the_short_way_is_the_long_one(short: Callable[[], object], full: Callable[[], object]):
    assert short() == full()


def physics(load: str, stroke: float, direction: float) -> pr.Load:
    return Physics(load=load, stroke=stroke, direction=direction).parts[1]


def test_observations_need_points_and_displacements_only(tmp_path: Path):
    given = pr.Observations(*SHORT)
    assert given.visible.all()
    assert not given.standard_deviations.any()
    assert (pr.Observations(*SHORT, 0.02).standard_deviations == 0.02).all()
    file = tmp_path / "markers.csv"
    file.write_text("x_mm,y_mm,u_mm,v_mm\n20,-1,-1,-3\n50,-1,-1.5,-8.5\n")
    read, framed = pr.load_measurements(file), pr.load_measurements(pd.read_csv(file))
    for other in (read, framed):
        assert (other.points == given.points).all()
        assert (other.displacements == given.displacements).all()
        assert other.marker_radius == given.marker_radius == pr.Design().marker_radius


def test_a_data_frame_goes_through_no_file(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(pd.DataFrame, "to_csv", None)
    frame = pd.DataFrame({"x_mm": [20.1], "y_mm": [-1], "u_mm": [1 / 3], "v_mm": [-3], "visible": [True]})
    assert pr.load_measurements(frame).displacements[0, 0] == 1 / 3


# --- a solution ---


def test_a_point_has_a_displacement_and_a_state(solved: pr.Solution):
    alone, several = solved.displacement([35, 0]), solved.displacement([[35, 0], [36, 0]])
    assert alone.shape == (2,)
    assert (alone == several[0]).all()
    assert solved.displacement(np.array([35.0, 0.0])).tolist() == alone.tolist()
    assert solved.state([35, 0]).von_mises == solved.state([[35, 0]]).von_mises[0]
    assert solved.gradient((35, 0)).shape == (2, 2)


def test_markers_stress_and_force_of_a_solution(solved: pr.Solution):
    markers = solved.problem.mesh.markers
    assert (solved.at_markers() == solved.displacement(markers)).all()
    assert solved.von_mises.shape == (len(solved.problem.mesh.triangles),)
    assert solved.force == pytest.approx(-20.0 * solved.reaction[1])  # N/mm over a depth of 20 mm
    assert solved.force == figures_of(solved).force  # defined alike


def test_a_solution_is_a_table(solved: pr.Solution, compared: pr.Comparison):
    table, mesh = solved.to_dataframe(), solved.problem.mesh
    assert len(table) == len(mesh.triangles)
    assert table["area_mm2"].sum() == pytest.approx(mesh.areas.sum())
    assert table["von_mises_MPa"].tolist() == solved.von_mises.tolist()
    assert (table["energy_density_MPa"] * table["area_mm2"]).sum() == pytest.approx(solved.energy, rel=1e-3)
    markers = solved.to_dataframe("markers")
    assert list(markers) == ["x_mm", "y_mm", "u_mm", "v_mm"]
    assert (pr.load_measurements(markers).displacements == solved.at_markers()).all()
    assert len(solved.to_dataframe("nodes")) == len(mesh.points)


def test_a_solution_is_a_file_and_a_grid(solved: pr.Solution, tmp_path: Path):
    import pyvista

    written, grid = pyvista.read(solved.save(tmp_path / "x.vtu")), solved.to_pyvista()
    assert written.cell_data["von_mises_MPa"].tolist() == grid.cell_data["von_mises_MPa"].tolist()
    assert len(pd.read_csv(solved.save(str(tmp_path / "x.csv")))) == grid.n_cells


@pytest.mark.parametrize("quantity", get_args(FieldName))
def test_every_quantity_of_the_viewer_is_plotted(solved: pr.Solution, quantity: FieldName):
    assert [each.name for each in VIEWED] == list(get_args(FieldName))
    drawn = solved.plot(quantity)
    low, high = drawn.axes[1].get_xlim()
    signed = next(each.signed for each in VIEWED if each.name == quantity)
    assert low == (-high if signed else 0)
    assert high > 0


def test_every_object_is_one_short_line(solved: pr.Solution, compared: pr.Comparison):
    shown = [
        *(solved, solved.problem, solved.problem.mesh, solved.state([[35, 0]]), solved.error, solved.status),
        *(compared, compared["fem"], compared.observations, compared.mesh.locate([[35, 0]])),
        *(pr.Design(), pr.Design().section, pr.Material(), pr.Load(), pr.solver("pinn-std"), MeshSettings()),
    ]
    lines = {type(each).__name__: repr(each) for each in shown}
    long = {name: line for name, line in lines.items() if "\n" in line or len(line) > 250}
    assert long == {}
    assert repr(solved).startswith("Solution('fem', converged; load mean (0.0, -10.0) mm, force 4.")


def test_the_repr_of_a_design_makes_it_again():
    design = pr.load_design("slender", rib_count=3)
    assert eval(repr(design), {"Design": pr.Design}) == design


# --- studies ---


def test_a_dictionary_is_swept(in_line: None):
    found = pr.sweep({"front_thickness": [1.2, 1.8]}, young=5, **COARSE)
    assert found["front_thickness_mm"].tolist() == [1.2, 1.8]
    assert found["force_N"].is_monotonic_increasing
    assert set(found["state"]) == {"done"}  # though the usual markers do not fit into 1.2 mm
    once = pr.solve("default", front_thickness=1.8, young=5, **COARSE)
    assert found["force_N"][1] == pytest.approx(once.force, rel=1e-9)


def test_ranges_are_sampled_and_a_design_may_be_an_object(in_line: None):
    ends = {"E": {"from": 3.0, "to": 5.0}}
    found = pr.sweep(ends, design=pr.Design(rib_count=3), samples=2, **COARSE)
    assert found["young_MPa"].between(3, 5).all()
    assert (found["force_N"] / found["young_MPa"]).std() < 1e-9


# --- what the camera sees ---


@pytest.mark.release
def test_the_rig_films_what_is_calibrated_tracked_and_weighed(tmp_path: Path):
    motion, out = pr.Motion(rest=2, moving=1, held=2), tmp_path / "film"
    film = pr.rig(
        out=out, stroke=4, motion=motion, frame="640x360", boards=6, square=20.0, rib_count=2, size=1.0
    )
    camera = pr.calibrate(out / "boards", "9x6", square=20.0, out=tmp_path / "camera.json")
    assert camera.rms < 1.0
    seen = pr.track(film, pr.Design(rib_count=2), camera=out / "camera.json")
    true = pr.load_measurements(out / "observations_true.csv")
    assert np.abs(seen.displacements - true.displacements).max() < 0.2
    forces = pr.film_forces(film, rib_count=2, camera=out / "camera.json")
    expected = pd.read_csv(out / "truth_force.csv")["force_N"]
    assert forces["force_N"].iloc[-1] == pytest.approx(expected.iloc[-1], rel=0.3)


# --- progress ---


def test_a_notebook_shows_the_progress_in_one_line(monkeypatch: pytest.MonkeyPatch):
    from rich.console import Console

    from pinnray.runtime.stages import NotebookLine, shown_stages

    texts: list[str] = []

    def display(text: str, *, display_id: bool) -> SimpleNamespace:
        texts.append(text)
        return SimpleNamespace(update=texts.append)

    module = ModuleType("IPython.display")
    module.__dict__.update(display=display, Pretty=str)
    monkeypatch.setitem(sys.modules, "IPython", ModuleType("IPython"))
    monkeypatch.setitem(sys.modules, "IPython.display", module)
    monkeypatch.setattr(Console, "is_jupyter", True, raising=False)
    monkeypatch.setattr("rich.console._is_jupyter", lambda: True)
    monkeypatch.setattr(NotebookLine, "EVERY", 0.0)
    with shown_stages(None) as stages, stages.stage("fem") as report:
        report(0.5, "half way")
    assert texts[1:3] == ["fem", "fem: 50% half way"]
    assert texts[-1].startswith("fem 0.")
    with shown_stages(False) as stages, stages.stage("gp"):
        pass
    assert "gp" not in "".join(texts)


def test_outside_a_notebook_nothing_is_shown_unless_asked(capfd: pytest.CaptureFixture[str]):
    pr.solve("default", **COARSE)
    assert capfd.readouterr() == ("", "")
    pr.solve("default", progress=True, **COARSE)
    assert "fem: " in capfd.readouterr().err


# --- messages ---


def test_a_solver_that_is_to_fit_markers_says_what_it_does_without():
    said = r"fem-asm fits markers, and no measurements were given: .* this is fem"
    with pytest.warns(UserWarning, match=said):
        pr.solve("default", "fem-asm", **COARSE)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        pr.solve("default", "fem", **COARSE)


def test_a_thin_wall_has_smaller_markers():
    thin = pr.load_design("default", front_thickness=1.0)
    assert thin.marker_diameter == pytest.approx(0.8)
    assert thin.replaced(front_thickness=2.0).marker_diameter == 1.6
    assert pr.Design().small_markers == pr.load_design("slender").small_markers == ""
    assert pr.Design().digest == "0dde50692e7380cf9eeec686dc391289ae5b0969cfcecdac632f340ffe975f0b"
    assert pr.Design(back_thickness=0.5).marker_diameter == pytest.approx(0.3)
