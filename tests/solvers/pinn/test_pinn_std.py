"""`pinn-std`: its tree of gates, and its distance from finite elements."""

import numpy as np
import pytest
import torch

from pinnray.geometry.cache import finger_mesh
from pinnray.geometry.finger.design import Design
from pinnray.geometry.mesh.settings import MeshSettings
from pinnray.solvers.fem.linear import FemSolver
from pinnray.solvers.pinn.finite_basis import windows
from pinnray.solvers.pinn.finite_basis.presets import PinnLocalSolver, PinnStdSolver
from pinnray.solvers.pinn.finite_basis.windows import GateTree
from pinnray.solvers.pinn.threading import boxes_around
from pinnray.solvers.problem import Problem
from tests.solvers.conftest import distances

QUICK = {"wall_spacing": 1.2, "corner_spacing": 0.3, "neurons": 3}


@pytest.fixture(scope="module")
def centres() -> np.ndarray:
    """Points of a square, dense in a corner of it, at least a tenth of their distance from it apart."""
    rng = np.random.default_rng(0)
    drawn = rng.uniform(0, 10, (3000, 2)) * rng.uniform(0, 1, (3000, 1)) ** 2
    kept: list[np.ndarray] = []
    for point in drawn:
        if all(np.linalg.norm(point - other) > 0.2 + 0.1 * np.linalg.norm(point) for other in kept):
            kept.append(point)
    return np.array(kept)


@pytest.fixture(scope="module")
def tree(centres) -> GateTree:
    spacing = 0.2 + 0.1 * np.linalg.norm(centres, axis=1)
    return GateTree.over(centres, spacing, width=1.0, rng=np.random.default_rng(1))


@pytest.fixture
def points() -> torch.Tensor:
    return torch.from_numpy(np.random.default_rng(2).uniform(0, 10, (200, 2)))


def test_every_centre_has_an_encoder_of_its_own(tree, centres):
    assert tree.count == len(centres)
    ends = tree.children[tree.children < 0]
    np.testing.assert_array_equal(np.sort(~ends.numpy()), np.arange(len(centres)))


def test_shares_are_those_of_the_gates_applied_from_the_bottom_up(tree, points):
    """H = (1 - Z) H_closed + Z H_open, layer by layer, for encoders that give numbers of their own."""
    given = torch.from_numpy(np.random.default_rng(3).normal(size=tree.count))

    def mixed(number: int) -> torch.Tensor:
        if number < 0:
            return given[~number].expand(len(points))
        slope_x, slope_y, bias = tree.gates[number]
        linear = points[:, 0] * slope_x + points[:, 1] * slope_y + bias
        inside = (linear / 12).clamp(-1 + 1e-9, 1 - 1e-9)  # at the ends the gate is closed or open
        gate = torch.sigmoid(12 * inside / (1 - inside**2))
        closed, opened = tree.children[number].tolist()
        return (1 - gate) * mixed(closed) + gate * mixed(opened)

    everyone = torch.arange(tree.count)
    torch.testing.assert_close(tree.values(points, everyone) @ given, mixed(0), rtol=0, atol=1e-12)


def test_encoders_that_are_left_out_have_a_negligible_share(tree, points):
    patch = 4 + 0.05 * points
    shares = tree.values(patch, torch.arange(tree.count))
    left_out = np.setdiff1d(np.arange(tree.count), tree.near(boxes_around([patch]))[0].numpy())
    assert len(left_out) > tree.count / 3
    assert shares[:, left_out].max() <= windows.NEGLIGIBLE


def test_slopes_are_those_of_automatic_differentiation(tree, points):
    everyone = torch.arange(tree.count)
    variable = points.clone().requires_grad_()
    shares = tree.values(variable, everyone)
    _, slopes = tree.values_and_gradients(points, everyone)
    for encoder in (0, 7, tree.count - 1):
        (gradient,) = torch.autograd.grad(shares[:, encoder].sum(), variable, retain_graph=True)
        torch.testing.assert_close(gradient.T, slopes[:, :, encoder], rtol=1e-9, atol=1e-11)


def test_one_encoder_needs_no_gate(points):
    tree = GateTree.over(np.zeros((1, 2)), np.ones(1), width=1.0, rng=np.random.default_rng(0))
    (near,) = tree.near(boxes_around([points]))
    assert near.tolist() == [0]
    torch.testing.assert_close(tree.values(points, near), torch.ones(len(points), 1, dtype=torch.float64))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("solver", "corner_size", "limits"),
    [
        (PinnStdSolver(), 0.02, (0.003, 0.05)),
        pytest.param(PinnLocalSolver(), 0.002, (0.002, 0.02), marks=pytest.mark.release),
    ],
)
def test_displacement_and_stress_are_those_of_finite_elements(solver, corner_size, limits):
    """The default finger and settings; usual are 0.05 and 2.6 %, and with local windows 0.02 and 1.7 %."""
    mesh = finger_mesh(Design())
    graded = finger_mesh(Design(), settings=MeshSettings(corner_size=corner_size))
    network, reference = solver.solve(Problem(mesh)), FemSolver().solve(Problem(graded))
    assert np.less(distances(network, reference), limits).all()
    assert network.energy == pytest.approx(reference.energy, rel=0.005)
    assert np.abs(network.displacement(mesh.markers) - reference.displacement(mesh.markers)).mean() < 0.01
    assert network.energy > reference.energy, "fewer unknowns cannot have less energy than the finer space"
    assert network.status.converged, network.status.message


def test_energy_falls_from_level_to_level(short_mesh):
    solution = PinnStdSolver(**QUICK).solve(Problem(short_mesh))
    assert (np.diff(solution.history["energy"]) < 0).all()
    assert (np.diff(solution.history["units"]) > 0).all()


def test_too_few_encoders_are_reported_as_not_converged(short_mesh):
    solution = PinnStdSolver(wall_spacing=5.0, corner_spacing=5.0, neurons=2).solve(Problem(short_mesh))
    assert not solution.status.converged
