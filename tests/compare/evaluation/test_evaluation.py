from dataclasses import fields, replace

import numpy as np
import pytest

from pinnray.comparison.evaluation.evaluation import Evaluation
from pinnray.solvers.lagrange import LagrangeField, LagrangeSpace
from pinnray.solvers.solution import Uncertainty
from tests.compare.conftest import closed_form
from tests.meshes import permuted


def test_it_samples_the_nodes_the_markers_and_three_points_a_triangle(fem, mesh):
    x, y = mesh.points.T
    np.testing.assert_allclose(fem.node_displacement, np.stack([0.01 * y**2, -0.02 * x**2], axis=1))
    np.testing.assert_array_equal(fem.marker_displacement, fem.node_displacement[mesh.marker_nodes])
    assert fem.strain.shape == (3 * len(mesh.triangles), 2, 2)
    assert fem.weights.sum() == pytest.approx(12 * 4)


def test_energy_density_is_that_of_pure_shear(fem):
    shear_modulus = 11.4 / (2 * 1.45)
    np.testing.assert_allclose(fem.energy_density, 2 * shear_modulus * fem.strain[:, 0, 1] ** 2, rtol=1e-12)


def test_the_mean_over_a_triangle_is_weighted_by_area(fem):
    two = replace(fem, weights=np.array([1.0, 1.0, 2.0, 5.0, 0.0, 0.0]))
    np.testing.assert_allclose(two.per_triangle(np.array([4.0, 8.0, 2.0, 7.0, 99.0, 99.0])), [4.0, 7.0])
    tensors = np.arange(6.0)[:, None, None] * np.eye(2)
    np.testing.assert_allclose(two.per_triangle(tensors), np.array([1.25, 3.0])[:, None, None] * np.eye(2))


def test_everything_comes_back_from_disk(pinn, tmp_path):
    path = tmp_path / "pinn.npz"
    pinn.save(path, "digest")
    back = Evaluation.load(path, "digest")
    assert back is not None
    for entry in fields(Evaluation):
        before, after = getattr(pinn, entry.name), getattr(back, entry.name)
        if entry.name == "history":
            assert list(before) == list(after)
            assert all(np.array_equal(before[name], after[name]) for name in before)
        elif isinstance(before, np.ndarray):
            np.testing.assert_array_equal(after, before, err_msg=entry.name)
        else:
            assert after == before, entry.name


@pytest.mark.parametrize("stress", [True, False])
def test_deviations_are_those_that_the_solver_estimates(mesh, stress, tmp_path):
    field = LagrangeField(LagrangeSpace(mesh, 1), np.zeros((len(mesh.points), 2)))
    known = Uncertainty(
        lambda where: 0.1 * where.points, (lambda where: where.points[:, 0]) if stress else None
    )
    found = Evaluation.of(closed_form(mesh, field, uncertainty=known), mesh)
    np.testing.assert_allclose(found.node_deviation, 0.1 * mesh.points, atol=1e-12)
    if stress:
        np.testing.assert_allclose(found.von_mises_deviation, mesh.points[mesh.triangles, 0].mean(axis=1))
    else:
        assert found.von_mises_deviation is None
    found.save(tmp_path / "a.npz", "key")
    np.testing.assert_array_equal(
        Evaluation.load(tmp_path / "a.npz", "key").node_deviation, found.node_deviation
    )


def test_a_solution_found_on_another_mesh_is_sampled_at_the_same_places(mesh):
    """Where an element has another number there, the values must still be those of the place."""
    own, other = (
        closed_form(shared, LagrangeField(LagrangeSpace(shared, 1), shared.points * [0.1, -0.2] + [0.0, 0.3]))
        for shared in (mesh, permuted(mesh, 3))
    )
    expected, sampled = (Evaluation.of(solution, mesh) for solution in (own, other))
    for name in ("marker_displacement", "node_displacement", "displacement", "stress"):
        np.testing.assert_allclose(getattr(sampled, name), getattr(expected, name), atol=1e-12, err_msg=name)
