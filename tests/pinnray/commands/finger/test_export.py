"""`pinnray export`: models that are pressed in the simulator, files for other programs, and bad input."""

import csv
import json

import pytest

import pinnray as pr
from pinnray.cli import main
from tests.solvers.conftest import SHORT


@pytest.mark.release
@pytest.mark.usefixtures("few_elements")
def test_the_models_for_mujoco_are_near_finite_elements_at_loads_that_they_have_not_seen(
    tmp_path, monkeypatch
):
    """Of a finger with four places for the fit and three for the score, short and stiff, so soon at rest."""
    pytest.importorskip("mujoco")
    monkeypatch.setattr("pinnray.robots.simulation.RAMP", 0.03)
    monkeypatch.setattr("pinnray.robots.simulation.HOLD", 0.04)
    made = pr.export("mujoco", SHORT, out=tmp_path, places=4, hinges=6, size=2.0, stroke=3.0, score=True)
    values = {each.model: each.values() for each in made.scores}
    assert values["chain"]["shape_error_mm"] < 0.12 * values["chain"]["motion_mm"]
    assert values["chain"]["force_error_percent"] < 10
    assert values["flex"]["shape_error_mm"] < 0.1 * values["flex"]["motion_mm"]
    assert values["flex"]["force_error_percent"] < 15
    found = json.loads((tmp_path / "score.json").read_text())
    assert found["models"]["chain"]["shape_error_mm"] == values["chain"]["shape_error_mm"]
    with (tmp_path / "score.csv").open() as file:
        assert [row["model"] for row in csv.DictReader(file)] == [*["chain"] * 6, *["flex"] * 6]


def test_a_mesh_is_written_with_the_material(tmp_path):
    short = [f"{name}={getattr(SHORT, name)}" for name in ("height", "tip_length", "rib_count")]
    finger = [word for each in short for word in ("--set", each)]
    common = [*finger, "--mesh-size", "2", "--young", "3", "--out", str(tmp_path)]
    assert main(["export", "mesh", *common]) == 0
    names = {each.name for each in tmp_path.iterdir()}
    assert names == {"finger.vtk", "finger.stl", "material.json"}
    assert json.loads((tmp_path / "material.json").read_text())["young_Pa"] == 3e6


@pytest.mark.parametrize("options", ["--loss-factor 3", "--friction 0.5", "--load mean"])
def test_what_no_model_for_mujoco_has_is_refused_before_a_file_is_written(options, tmp_path):
    pytest.importorskip("mujoco")
    out = tmp_path / "out"
    assert main(["export", "mujoco", *options.split(), "--mesh-size", "2", "--out", str(out)]) == 2
    assert not out.exists()


def test_without_mujoco_it_says_how_to_get_it(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    assert main(["export", "mujoco", "--mesh-size", "2", "--out", str(tmp_path / "out")]) == 2
    assert "pip install 'pinn-ray[robots]'" in capsys.readouterr().err
