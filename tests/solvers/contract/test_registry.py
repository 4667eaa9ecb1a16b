"""Solvers by name, from here and from other packages."""

import sys

import pytest

from pinnray.runtime.errors import UserError
from pinnray.solvers.registry import (
    BUILT_IN,
    PRESETS,
    MissingLibraryError,
    make_solver,
    solver_names,
    usable_solvers,
)
from pinnray.solvers.solver import Traits


def test_settings_are_converted_from_text():
    made = make_solver("fem", degree="1", estimate="no")
    assert made.settings() == {"degree": 1, "estimate": False}


@pytest.mark.parametrize(("name", "preset"), [(name, preset) for name in PRESETS for preset in PRESETS[name]])
def test_a_preset_keeps_the_name_and_can_be_made_from_its_own_settings(name, preset):
    solver = make_solver(name, preset=preset)
    assert solver.name == name
    assert solver.settings()["preset"] == preset
    assert make_solver(name, **solver.settings()) == solver


def test_the_first_preset_is_the_usual_one():
    for name, presets in PRESETS.items():
        assert make_solver(name) == make_solver(name, preset=next(iter(presets)))


def test_a_package_adds_a_solver_by_its_entry_point(plugin_folder, monkeypatch):
    assert "skfem-p2" not in solver_names()
    monkeypatch.syspath_prepend(str(plugin_folder))
    assert solver_names()[-1] == "skfem-p2"
    made = make_solver("skfem-p2")
    assert made.name == "skfem-p2"
    assert Traits.of(made) == Traits(assimilates=False, family=None, twin=None), "it has none of its own"
    with pytest.raises(UserError, match="solver 'skfem-p2' cannot be made with "):
        make_solver("skfem-p2", mesh=2)


@pytest.mark.parametrize("name", BUILT_IN)
def test_a_solver_of_ours_has_its_family_and_its_twin_assimilates_too(name):
    traits = Traits.of(make_solver(name))
    kinds = {"fem": "finite elements", "pinn": "neural network"}
    assert traits.family == kinds.get(name.partition("-")[0], "statistics")
    if traits.twin:
        twin = Traits.of(make_solver(traits.twin))
        assert (twin.assimilates, twin.family, twin.twin) == (True, "finite elements", None)


def test_a_missing_library_is_said_and_the_other_solvers_work(monkeypatch):
    monkeypatch.setitem(sys.modules, "pinnray.solvers.fem.linear", None)
    with pytest.raises(MissingLibraryError, match=r"solver 'fem' cannot be loaded: .*solvers\.fem\.linear"):
        make_solver("fem")
    with pytest.warns(UserWarning, match="solver 'fem' is left out"):
        assert "pinn-std" in usable_solvers()


def test_a_missing_dolfinx_is_said_with_the_ways_to_it(monkeypatch):
    monkeypatch.delitem(sys.modules, "pinnray.solvers.petsc", raising=False)
    for module in [name for name in sys.modules if name.startswith("pinnray.solvers.fem")]:
        monkeypatch.delitem(sys.modules, module)
    monkeypatch.setitem(sys.modules, "petsc4py", None)
    with pytest.raises(
        MissingLibraryError, match=r'petsc4py.*pip install "pinn-ray\[fem\]" with Python 3.12'
    ):
        make_solver("fem")


@pytest.mark.parametrize(
    ("place", "said"),
    [("no_such_module:Solver", "cannot be loaded"), ("collections:OrderedDict", "not have the interface")],
)
def test_a_broken_package_warns_and_the_rest_goes_on(tmp_path, monkeypatch, place, said):
    info = tmp_path / "broken-0.1.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: broken\nVersion: 0.1\n")
    (info / "entry_points.txt").write_text(f"[pinnray.solvers]\nbroken = {place}\n")
    monkeypatch.syspath_prepend(str(tmp_path))
    with pytest.warns(UserWarning, match="solver 'broken' is left out: "):
        assert "fem" in usable_solvers()
    with pytest.raises(UserError, match=said):
        make_solver("broken")


@pytest.mark.parametrize("name", ["../up", "a/b", "", ".hidden", "a b", "<b>", "x" * 65, "truth", "a\n"])
def test_a_name_that_no_file_can_have_is_refused(name, plugin_folder, monkeypatch):
    monkeypatch.syspath_prepend(str(plugin_folder))
    from pinnray_skfem import SkfemSolver  # type: ignore[import-not-found]

    monkeypatch.setattr(SkfemSolver, "name", name)
    with pytest.raises(UserError, match="a solver is called"):
        make_solver("skfem-p2")
