"""The simulated measurements: what is solved, when, and what is said of it; on the small rectangle."""

import json
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pinnray.comparison.evaluation.comparison import Results
from pinnray.comparison.evaluation.truths import TRUTHS
from pinnray.comparison.evaluation.virtual_experiment import UnfinishedExperimentError, virtual_experiment
from pinnray.comparison.figures.gallery import GALLERY
from pinnray.comparison.pipeline.job import Job
from pinnray.geometry.cache import finger_mesh
from pinnray.geometry.finger.design import Design
from pinnray.geometry.mesh.settings import MeshSettings
from pinnray.geometry.mesh.triangle_mesh import TriangleMesh
from pinnray.runtime.errors import UserError
from pinnray.solvers.fem.finite_strain.solver import FemNonlinearSolver
from pinnray.solvers.problem import Load, Material, Problem
from pinnray.solvers.registry import make_solver
from pinnray.solvers.solution import Solution, Status
from tests.compare.pipeline.runs import compare
from tests.compare.tables import rows_of
from tests.meshes import permuted

pytestmark = pytest.mark.usefixtures("few_elements_throughout")
MODULE = virtual_experiment.__module__


@pytest.fixture
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A cache of this test's own."""
    monkeypatch.setenv("PINNRAY_CACHE", str(tmp_path / "cache"))
    return tmp_path / "cache"


@pytest.fixture
def solutions(cache: Path, monkeypatch: pytest.MonkeyPatch) -> list[Solution]:
    """What the finite-strain solver has returned so far."""
    returned: list[Solution] = []
    solve = FemNonlinearSolver.solve

    def watched(self: FemNonlinearSolver, *arguments: object) -> Solution:
        returned.append(solve(self, *arguments))
        return returned[-1]

    monkeypatch.setattr(FemNonlinearSolver, "solve", watched)
    return returned


@pytest.fixture
def problem(mesh: TriangleMesh) -> Problem:
    return Problem(mesh, load=Load(displacement=(0.0, -0.5)))


def test_a_cache_that_cannot_be_written_is_a_warning(problem, cache):
    cache.touch()  # a file, not a folder
    with pytest.warns(RuntimeWarning, match="cannot write to the cache folder"):
        observations, _ = virtual_experiment(problem, 0.8)
    assert observations.visible.all()


def test_a_sliding_patch_presses_on_a_neo_hookean_finger(problem, solutions):
    virtual_experiment(problem, 0.8)
    (solution,) = solutions
    solved = solution.problem
    assert (solved.load.kind, solved.load.displacement) == ("patch", (None, -0.5))
    assert (solved.material.law, solved.material.plane) == ("neo-hookean", "strain")
    assert (solved.material.young, solved.material.poisson) == (11.4, 0.45)
    contact = problem.mesh.points[np.unique(problem.mesh.boundary("contact"))]
    u, v = solution.displacement(contact).T
    np.testing.assert_allclose(v, -0.5, atol=1e-12)
    assert abs(u).max() > 1e-3  # it slides
    assert abs(solution.reaction[0]) < 1e-8 * abs(solution.reaction[1])  # without friction


def test_the_truth_is_the_simulated_field_on_the_mesh_and_is_kept(problem, solutions):
    notes: list[str] = []
    (first, field), (second, kept) = (
        virtual_experiment(problem, 0.8, lambda _, note: notes.append(note)) for _ in range(2)
    )
    assert (len(solutions), notes[-1]) == (1, "from the cache")
    for truth in (field, kept):
        np.testing.assert_array_equal(truth.node_displacement, solutions[0].displacement(problem.mesh.points))
        np.testing.assert_array_equal(truth.marker_displacement, first.displacements)
        assert truth.law == "neo-hookean"
    np.testing.assert_array_equal(second.displacements, first.displacements)
    assert (second.source, second.simulated) == (first.source, first.simulated)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("changes", "simulations"),
    [
        ({"load": Load(displacement=(0.0, -0.4))}, 2),
        ({"material": Material(young=5.0)}, 2),
        ({"material": Material(poisson=0.3)}, 2),
        ({"mesh": 1}, 2),  # with its elements in another order
        # no part of the experiment
        ({"load": Load(kind="point", displacement=(0.0, -0.5))}, 1),
        ({"load": Load(displacement=(None, -0.5))}, 1),
        ({"material": Material(plane="stress")}, 1),
    ],
)
def test_another_problem_is_simulated_again(problem, solutions, changes, simulations):
    virtual_experiment(problem, 0.8)
    if "mesh" in changes:
        changes = {"mesh": permuted(problem.mesh, changes["mesh"])}
    virtual_experiment(replace(problem, **changes), 0.8)
    assert len(solutions) == simulations


def test_another_version_of_a_package_or_of_our_sources_is_simulated_again(problem, solutions, monkeypatch):
    virtual_experiment(problem, 0.8)
    monkeypatch.setattr("pinnray.comparison.evaluation.evaluation.package_versions", lambda: {"numpy": "9"})
    virtual_experiment(problem, 0.8)
    monkeypatch.setattr("pinnray.comparison.evaluation.evaluation.sources_digest", lambda *_: "other")
    virtual_experiment(problem, 0.8)
    assert len(solutions) == 3


@pytest.mark.parametrize("content", [b"", b"PK\x03\x04", b"\xff\x00"])
def test_a_damaged_file_in_the_cache_is_made_again(problem, solutions, cache, content):
    virtual_experiment(problem, 0.8)
    (entry,) = cache.iterdir()
    entry.write_bytes(content)
    with pytest.warns(RuntimeWarning, match="is damaged .* and is made again"):
        virtual_experiment(problem, 0.8)
    assert len(solutions) == 2
    assert virtual_experiment(problem, 0.8)[0].simulated
    assert len(solutions) == 2


def test_an_experiment_that_stops_halfway_is_refused_and_not_kept(problem, cache, monkeypatch):
    solve = FemNonlinearSolver.solve

    def stops(self: FemNonlinearSolver, *arguments: object) -> Solution:
        return replace(solve(self, *arguments), status=Status(False, "stopped at 50% of the load"))

    monkeypatch.setattr(FemNonlinearSolver, "solve", stops)
    with pytest.raises(UserError, match=r"experiment stopped at 50% of the load; or give measurements"):
        virtual_experiment(problem, 0.8)
    assert not any(cache.iterdir())


@pytest.mark.slow
def test_a_truth_in_three_dimensions_is_that_of_the_side_face(problem, cache, monkeypatch):
    """It is sampled on the shared mesh, and differs from plane strain as the depth makes it differ."""
    monkeypatch.setattr(f"{MODULE}.SOLID_SIZE", 2.5)
    design = Design(height=40, rib_count=0, tip_length=12, contact_position=18)
    short = finger_mesh(design, settings=MeshSettings(size=2.0))
    known = Problem(short, load=Load(displacement=(0.0, -0.5)), finger=design)
    plane, _ = virtual_experiment(known, 0.8)
    seen, truth = virtual_experiment(known, 0.8, truth=TRUTHS["3d"])
    assert truth.solid
    assert truth.solver == "fem-3d"
    assert "fem-3d" in seen.source
    assert truth.von_mises.shape == truth.weights.shape
    apart = np.abs(seen.displacements - plane.displacements).max()
    assert 1e-4 < apart < 0.1 * np.abs(plane.displacements).max()


def test_without_the_finite_element_library_measurements_are_asked_for(problem, cache, monkeypatch):
    monkeypatch.setitem(sys.modules, "pinnray.solvers.fem.finite_strain.solver", None)
    with pytest.raises(UserError, match=r"'fem-nonlinear' cannot be loaded: .*; or give measurements"):
        virtual_experiment(problem, 0.8)


@pytest.fixture
def unfinished(monkeypatch: pytest.MonkeyPatch) -> None:
    """A virtual experiment that stops before its full load."""

    def stops(*_: object) -> None:
        raise UnfinishedExperimentError("the virtual experiment stopped at 67.5% of the load")

    monkeypatch.setattr("pinnray.comparison.pipeline.pipeline.virtual_experiment", stops)


def _compared(out: Path, *names: str, spare: tuple[str, ...] = ()) -> Results:
    solvers = [make_solver(name) for name in names]
    return compare(Job(Design(), solvers, spare, MeshSettings(size=1.0), out=out))


@pytest.mark.slow
def test_a_comparison_goes_on_without_a_truth(tmp_path, unfinished, monkeypatch):
    chosen = {name: GALLERY[name] for name in ("overlay", "marker_errors")}
    monkeypatch.setattr("pinnray.comparison.figures.gallery.GALLERY", chosen)
    comparison = _compared(tmp_path / "run", "fem", "fem-asm", spare=("fem-asm",))
    assert [each.solver for each in comparison.evaluations] == ["fem"]
    assert comparison.truth is None
    assert not comparison.observations.known
    assert comparison.remarks == [
        "left out: fem-asm (no markers to assimilate)",
        "no truth: the virtual experiment stopped at 67.5% of the load",
    ]
    assert [path.name for path in (tmp_path / "run" / "figures").iterdir()] == ["overlay.png"]
    solver = json.loads((tmp_path / "run" / "metrics.json").read_text())["solvers"]["fem"]
    assert solver["held_out"] is None
    assert solver["markers"]["mae_sum"] is None
    [row] = rows_of(tmp_path / "run" / "summary.csv")
    assert row["mae_sum_mm"] == row["held_out_mae_sum_mm"] == ""
    assert float(row["energy_N_mm_per_mm"]) > 0


def test_without_a_truth_a_chosen_solver_that_needs_markers_is_refused(tmp_path, unfinished):
    with pytest.raises(UserError, match=r"stopped at 67\.5% of the load"):
        _compared(tmp_path / "run", "fem", "fem-asm")
    assert not (tmp_path / "run").exists()
