"""The simulated truths: walls, laws and loads, and fields at points that move with the walls."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from pinnray.comparison.evaluation.truths import LAWS, SLIDING, TRUTHS, WALLS, Truth
from pinnray.comparison.evaluation.virtual_experiment import experiment_source, simulate
from pinnray.geometry.cache import finger_mesh
from pinnray.geometry.finger.design import Design
from pinnray.geometry.finger.section import rib_axes
from pinnray.geometry.mesh.quadrature import body_quadrature
from pinnray.geometry.mesh.settings import MeshSettings
from pinnray.geometry.mesh.wall_motion import WallMotion
from pinnray.solvers.problem import Load, Problem
from pinnray.solvers.registry import make_solver
from pinnray.studies.crossval.folds import LoadCase
from pinnray.studies.crossval.study import CrossvalStudy
from pinnray.studies.crossval.true_fields import FieldSampler, TrueField, TruthTask, simulate_truth

FULL = LoadCase("full", Load(), 1.0, 35.0)


@pytest.fixture
def study(tmp_path, coarse_mesh, monkeypatch) -> CrossvalStudy:
    monkeypatch.setenv("PINNRAY_CACHE", str(tmp_path / "cache"))
    study = CrossvalStudy(design=Design(), solvers=[], out=tmp_path, mesh=MeshSettings(size=1.0))
    return study


@pytest.fixture
def true_field(study, coarse_mesh) -> Callable[..., TrueField]:
    """`true_field(truth, case)`: at the markers of the joints."""

    def found(truth: Truth, case: LoadCase = FULL, **changes: Any) -> TrueField:
        return simulate_truth(TruthTask(replace(study, **changes), truth, case, coarse_mesh))["joints"]

    return found


def test_walls_are_redrawn_around_the_axes_of_the_ribs():
    drawn = Design()
    printed, base = (TRUTHS[name].finger(drawn) for name in ("print", "base"))
    for finger, wall in ((printed, 2.0), (base, 3.0)):
        thickness = [getattr(finger, f"{name}_thickness") for name in ("front", "back", "rib", "base")]
        assert thickness == pytest.approx([2.1, 1.9, 2.1, wall])
        start, end = rib_axes(drawn).transpose(1, 0, 2)
        along, ends = end - start, rib_axes(finger)
        for side in (0, 1):
            offset = ends[:, side] - start
            away = offset[:, 0] * along[:, 1] - offset[:, 1] * along[:, 0]
            np.testing.assert_allclose(away, 0, atol=1e-9)  # rounding
    assert TRUTHS["cylinder"].finger(drawn) is drawn


def test_permitted_laws_and_walls_are_those_of_the_solvers_and_the_mesh(coarse_mesh):
    for name, laws in LAWS.items():
        assert {*laws} == {*make_solver(name).laws} - {"linear"}
    assert {*WALLS} == {*WallMotion.of(coarse_mesh).names}


def test_the_source_names_law_and_load(mesh):
    problem = Problem(mesh, load=Load(displacement=(0.0, -0.5)))
    said = experiment_source(problem, TRUTHS["cylinder"])
    assert said.startswith("simulated by fem-nonlinear (neo-Hookean, rigid cylinder of radius 10 mm")
    assert said.endswith("pressed in by 0.5 mm); no camera was involved")


@pytest.mark.usefixtures("few_elements")
def test_the_sliding_truth_is_the_virtual_experiment_on_the_finer_mesh(true_field, coarse_mesh):
    """By hand, as before there were other truths; force and contact are those of the solution."""
    found = true_field(SLIDING, mesh=MeshSettings(size=2.0))
    problem = Problem(finger_mesh(Design(), settings=MeshSettings(size=1.0)))
    solution = simulate(problem)
    points = body_quadrature(coarse_mesh).location.points
    np.testing.assert_allclose(found.sampled.displacement, solution.displacement(points), atol=1e-12)
    assert found.force == pytest.approx(np.linalg.norm(solution.reaction), abs=1e-12)
    assert found.position == pytest.approx(35.0, abs=2.0)  # its line of action: the load may pull, too


@pytest.mark.slow
def test_fields_are_compared_at_points_that_move_with_the_walls(study, true_field, coarse_mesh):
    """The finger with the same walls on a coarse mesh of its own is near; at fixed points it would not be."""
    truth = TRUTHS["base"]
    found = true_field(truth)
    finger = truth.finger(study.design)
    other = finger_mesh(finger, settings=MeshSettings(size=1.0))
    solution = simulate(Problem(other), truth=truth)
    sampler = FieldSampler.of(coarse_mesh, coarse_mesh.markers, 0.8)
    own = replace(solution.problem, mesh=coarse_mesh)
    moved, fixed = (
        sampler.of_solution(solution, coarse_mesh, changes).distances(
            found.sampled, own, own, sampler.weights
        )
        for changes in (truth.changes(study.design), None)
    )
    assert moved["displacement"] < 0.001  # 0.0002 by the coarse mesh; 0.005 at fixed points
    assert fixed["von_mises"] > 2 * moved["von_mises"]  # 0.14 and 0.036, which is the coarse mesh's error


@pytest.mark.slow
@pytest.mark.usefixtures("few_elements")
def test_a_cylinder_says_where_it_touches_and_is_kept_in_the_cache(true_field, monkeypatch):
    truth = TRUTHS["cylinder"]
    found = true_field(truth)
    assert found.position == pytest.approx(35.0, abs=1.0)  # within the contact, which rolls to the tip

    def again(*_: object, **__: object) -> None:
        raise RuntimeError("simulated again")

    monkeypatch.setattr("pinnray.studies.crossval.true_fields.simulate", again)
    assert true_field(truth).position == found.position
    half = replace(FULL, name="half", share=0.5)
    with pytest.raises(RuntimeError, match="simulated again"):
        true_field(truth, half)


@pytest.mark.slow
@pytest.mark.usefixtures("few_elements")
@pytest.mark.parametrize("name", [name for name, truth in TRUTHS.items() if not truth.solid])
def test_every_truth_comes_to_its_full_load(true_field, name):
    found = true_field(TRUTHS[name], mesh=MeshSettings(size=2.0))
    assert 0.1 < found.force < 2.0  # N/mm: thick or thin, sliding or not, it is one finger
    assert np.isfinite(found.sampled.gradient).all()
