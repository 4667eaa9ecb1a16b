import numpy as np
import pytest
import torch

from benchmarks.finger_network import FingerNetwork
from benchmarks.finger_residuals import FingerResiduals, everywhere
from benchmarks.pinn_recipes import through_points, with_exact_output
from geometry.cache import finger_mesh
from geometry.finger.design import Design
from geometry.mesh.settings import MeshSettings
from solvers.pinn.paper.modified_mlp import ModifiedMlp
from solvers.problem import Load, Problem, contact_functional

STEP = 1e-5
"""Of central differences, mm or in weights: their error is about its square, 1e-10, and rounding's 1e-11."""


@pytest.fixture(scope="module")
def network() -> FingerNetwork:
    mesh = finger_mesh(Design(), settings=MeshSettings(size=1.0))
    problem = Problem(mesh, load=Load(displacement=(1.0, -2.0)))
    return FingerNetwork(problem, ModifiedMlp(width=5, layers=3), degree=1)


def test_clamp_and_load_hold_whatever_the_weights(network):
    mesh = network.problem.mesh
    field = network.field(network.initial(3))
    points, weights = contact_functional(network.problem)
    assert weights @ field.displacement(mesh.locate(points)) == pytest.approx([1.0, -2.0], abs=1e-12)
    base = mesh.locate(mesh.points[mesh.boundary("base").ravel()])
    assert abs(field.displacement(base)).max() < 1e-12


def test_derivatives_along_x_and_y_are_those_of_the_displacement(network):
    inside = network.problem.mesh.at_centroids().points[::50]
    field, locate = network.field(network.initial(3)), network.problem.mesh.locate
    gradient = field.gradient(locate(inside))
    for axis in range(2):
        shift = STEP * np.eye(2)[axis]
        ahead, behind = (field.displacement(locate(inside + sign * shift)) for sign in (1, -1))
        assert gradient[:, :, axis] == pytest.approx((ahead - behind) / (2 * STEP), abs=1e-7)


def test_the_energys_derivatives_are_those_of_central_differences(network):
    parameters = network.initial(0)
    direction = torch.linspace(-1, 1, len(parameters), dtype=torch.float64)
    gradient = network.energy(parameters)[1]
    ahead, behind = (network.energy(parameters + sign * STEP * direction)[0] for sign in (1, -1))
    assert float(gradient @ direction) == pytest.approx((ahead - behind) / (2 * STEP), rel=1e-6)


def test_half_the_square_of_the_residuals_is_the_energy_and_their_jacobian_is_right(network):
    parameters = network.initial(0)
    values = everywhere(network).values(parameters)
    assert 0.5 * float(values @ values) == pytest.approx(network.energy(parameters)[0], rel=1e-12)
    some = FingerResiduals(network, network.points[::200], network.weights[::200])
    direction = torch.linspace(-1, 1, len(parameters), dtype=torch.float64)
    ahead, behind = (some.values(parameters + sign * STEP * direction) for sign in (1, -1))
    torch.testing.assert_close(
        some.linearised(parameters)[1] @ direction, (ahead - behind) / (2 * STEP), rtol=1e-6, atol=1e-7
    )


def test_an_exact_output_layer_leaves_no_gradient_in_it(network):
    start = through_points(network, slope=0.1)
    best = with_exact_output(network, start)
    value, gradient = network.energy(best)
    assert value < network.energy(start)[0]
    in_output = network.output_layers(gradient)
    assert float(in_output.abs().max()) < 1e-6 * value
