"""The price of a fine mesh, told before it is made."""

import re

import pytest

from pinnray.cli import main
from pinnray.geometry.cache import drawn_finger, finger_mesh
from pinnray.geometry.drawing.description import Description
from pinnray.geometry.finger.presets import load_design
from pinnray.geometry.mesh.element_size import estimated_triangles
from pinnray.geometry.mesh.settings import MeshSettings
from pinnray.options.cost import MAX_SECONDS, USABLE, check_mesh_cost, mesh_price
from pinnray.options.preset_jobs import job_defaults
from pinnray.runtime.errors import UserError
from pinnray.runtime.exits import BAD_INPUT
from pinnray.solvers.registry import PRESETS, make_solver
from pinnray.solvers.solver import Cost, Traits
from tests.compare.pipeline.endings import Ending
from tests.geometry.drawing.files import write_beam_mesh


@pytest.mark.parametrize(("name", "size"), [("default", 0.25), ("csiro", 0.12), ("slender", 0.1)])
def test_the_number_of_triangles_is_known_before_the_mesh_is_made(name, size):
    """To a tenth here; three elements across a wall, where it is thin for the size, may take a few more."""
    finger, settings = load_design(name), MeshSettings(size=size)
    made = len(finger_mesh(finger, settings=settings).triangles)
    assert estimated_triangles(finger, settings) == pytest.approx(made, rel=0.15)


@pytest.mark.slow
@pytest.mark.parametrize("command", ["compare", "crossval", "solve fem-nonlinear", "rig"])
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

    monkeypatch.setattr("pinnray.comparison.pipeline.shared_mesh.finger_mesh", mesh)
    with pytest.raises(Began):
        main(["compare", "--mesh-size", "0.02", "--yes", "--quiet", "--out", str(tmp_path / "out")])


def test_the_mesh_of_a_file_needs_no_consent_unless_a_size_is_asked_for(tmp_path, monkeypatch):
    finger = drawn_finger(write_beam_mesh(tmp_path / "beam.msh"), Description())
    monkeypatch.setattr("pinnray.options.cost.free_memory_gb", lambda: 0.1)
    check_mesh_cost(finger, None, [make_solver("fem")])
    with pytest.raises(UserError, match=r"--mesh-size 0\.25 gives about"):
        check_mesh_cost(finger, MeshSettings(), [make_solver("fem")])


def test_every_default_needs_no_consent():
    """On a machine with 4 GB, the mesh of the paper's preset included."""
    paper, default = (job_defaults(preset).solvers.split(",") for preset in ("paper", None))
    of_paper = [make_solver(name, **({"preset": "paper"} if name in PRESETS else {})) for name in paper]
    assert mesh_price(182_000, of_paper, simulated=True)[0] < MAX_SECONDS
    seconds, memory = mesh_price(18_193, [make_solver(name) for name in default], simulated=True)
    assert seconds < MAX_SECONDS
    assert memory < USABLE * 4.0


def test_a_solver_says_what_it_costs_and_one_that_says_nothing_counts_as_fem():
    class Slow(Ending):
        cost = Cost(per_triangle=1000.0, fixed=60.0)

    assert mesh_price(18_000, [Slow("slow")])[0] - mesh_price(18_000)[0] == pytest.approx(18)
    assert Traits.of(Slow("slow")).cost.seconds(18_000) == pytest.approx(78)
    assert Traits.of(Ending("silent")).cost == Traits.of(make_solver("fem")).cost
    assert mesh_price(18_000, [make_solver("fem"), make_solver("fem-3d")])[1] > USABLE * 8.0
