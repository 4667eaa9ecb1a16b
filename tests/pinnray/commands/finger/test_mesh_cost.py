"""The price of a fine mesh, told before it is made."""

import re

import pytest

from compare.runtime.exits import BAD_INPUT
from geometry.cache import finger_mesh
from geometry.errors import UserError
from geometry.finger.presets import load_design
from geometry.mesh.element_size import estimated_triangles
from geometry.mesh.settings import MeshSettings
from pinnray.cli import main
from pinnray.options.cost import EXPERIMENT, MeshCost, check_mesh_cost


@pytest.mark.parametrize(("name", "size"), [("default", 0.25), ("csiro", 0.12), ("slender", 0.1)])
def test_the_number_of_triangles_is_known_before_the_mesh_is_made(name, size):
    """To a tenth here; three elements across a wall, where it is thin for the size, may take a few more."""
    finger, settings = load_design(name), MeshSettings(size=size)
    made = len(finger_mesh(finger, settings=settings).triangles)
    assert estimated_triangles(finger, settings) == pytest.approx(made, rel=0.15)


@pytest.mark.parametrize("command", ["compare", "crossval", "solve fem-nonlinear", "rig", "gridsearch"])
def test_a_fine_mesh_asks_for_consent_before_anything_is_done(command, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("pinnray.options.cost.free_memory_gb", lambda: 4.0)
    assert main([*command.split(), "--mesh-size", "0.02"]) == BAD_INPUT
    (line,) = capsys.readouterr().err.splitlines()
    assert re.match(
        r"error: --mesh-size 0\.02 gives about 354,\d+ triangles, .* and 10\.6 GB \(4\.0 GB ", line
    )
    assert list(tmp_path.iterdir()) == []


def test_consent_goes_on(tmp_path, monkeypatch):
    class Began(Exception):
        pass

    def mesh(*_: object, **__: object) -> None:
        raise Began

    monkeypatch.setattr("compare.pipeline.shared_mesh.finger_mesh", mesh)
    with pytest.raises(Began):
        main(["compare", "--mesh-size", "0.02", "--yes", "--quiet", "--out", str(tmp_path / "out")])


def test_the_size_that_is_advised_needs_no_consent():
    finger, parts = load_design("default"), [EXPERIMENT, "fem-nonlinear"]
    with pytest.raises(UserError) as refused:
        check_mesh_cost(finger, MeshSettings(size=0.02), parts)
    advised = float(str(refused.value).rpartition(" ")[2])
    assert 0.02 < advised < 0.25
    check_mesh_cost(finger, MeshSettings(size=advised), parts)


def test_every_default_needs_no_consent():
    """On a machine with 4 GB, the mesh of the paper's preset included."""
    assert MeshCost(182_000, ["mesh", EXPERIMENT, "fem", "pinn-std", "pinn-asm"]).seconds < 300
    assert MeshCost(18_193, [EXPERIMENT, "fem", "fem-nonlinear", "fem-asm", "fem-id", "statfem"]).fits(4.0)
