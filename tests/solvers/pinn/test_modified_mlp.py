"""The paper's network: its size, its derivatives and its gradient against automatic differentiation."""

import pytest
import torch

from solvers.pinn.paper.mlp_passes import MlpPass
from solvers.pinn.paper.modified_mlp import ModifiedMlp


def plain(network: ModifiedMlp, parameters: torch.Tensor, points: torch.Tensor) -> torch.Tensor:
    """The published formulas, one network after the other: shape (networks, n)."""
    first, gates, biases, output, output_bias = network.weights(parameters)
    results = []
    for k in range(network.networks):
        a, b, hidden = (torch.tanh(points @ layer[:2] + layer[2]) for layer in first[k])
        if not network.literal_gate:
            hidden = (1 - hidden) * a + hidden * b
        for gate, bias in zip(gates, biases, strict=True):
            z = torch.tanh(hidden @ gate[k] + bias[k])
            hidden = (1 - z) * a + z * b
        results.append((hidden @ output[k])[:, 0] + output_bias[k])
    return torch.stack(results)


def plain_slopes(network, parameters, points) -> torch.Tensor:
    """Derivatives along x and y by automatic differentiation, shape (networks, n, 2)."""
    points = points.clone().requires_grad_()
    values = plain(network, parameters, points)
    return torch.stack([torch.autograd.grad(value.sum(), points, create_graph=True)[0] for value in values])


def noise(*shape: int, seed: int) -> torch.Tensor:
    return torch.randn(*shape, generator=torch.Generator().manual_seed(seed), dtype=torch.float64)


@pytest.fixture(params=[False, True], ids=["published", "literal"])
def network(request) -> ModifiedMlp:
    return ModifiedMlp(width=7, layers=4, literal_gate=request.param)


@pytest.fixture
def parameters(network) -> torch.Tensor:
    """With biases that are not zero."""
    return network.initial(0, torch.float64) + 0.2 * noise(2, network.parameters, seed=1)


@pytest.fixture
def points() -> torch.Tensor:
    return noise(11, 2, seed=2)


@pytest.fixture
def at_points(network, parameters, points) -> MlpPass:
    return MlpPass(network, network.weights(network.in_logistic_form(parameters)), points)


@pytest.mark.parametrize(
    ("literal", "count"),
    [(False, 13_121), (True, 17_281)],  # the paper's 4 layers of 64; with the extra layer that it prints
)
def test_number_of_parameters(literal, count):
    network = ModifiedMlp(literal_gate=literal)
    assert network.parameters == count
    assert network.initial(0, torch.float32).shape == (2, count)


def test_initial_weights_are_glorot_normal():
    """Within three standard errors of the mean and the deviation; biases are exactly zero."""
    network = ModifiedMlp(networks=3)
    first, gates, biases, output, output_bias = network.weights(network.initial(0, torch.float64))
    for matrix, fans in ((first[:, :, :-1], 66), *((gate, 128) for gate in gates), (output, 65)):
        assert matrix.std() == pytest.approx((2 / fans) ** 0.5, rel=3 / (2 * matrix.numel()) ** 0.5)
        assert abs(matrix.mean()) < 3 * matrix.std() / matrix.numel() ** 0.5
    assert max(bias.abs().max() for bias in (first[:, :, -1], *biases, output_bias)) == 0


def test_values_and_slopes(network, parameters, points, at_points):
    torch.testing.assert_close(at_points.values(), plain(network, parameters, points), rtol=1e-12, atol=1e-13)
    expected = plain_slopes(network, parameters, points).detach()
    torch.testing.assert_close(at_points.input_gradients(), expected, rtol=1e-12, atol=1e-13)


@pytest.mark.parametrize("of", ["values", "slopes"])
def test_gradient_over_every_parameter(network, parameters, points, at_points, of):
    """Rounding of sums of some hundred terms; what is there already is added to."""
    gradient = torch.ones_like(parameters)
    variable = parameters.clone().requires_grad_()
    if of == "values":
        factors = noise(2, 11, seed=3)
        at_points.backward_values(factors, network.weights(gradient))
        loss = (factors * plain(network, variable, points)).sum()
    else:
        factors = noise(2, 11, 2, seed=3)
        at_points.input_gradients()
        at_points.backward_input_gradients(factors, network.weights(gradient))
        loss = (factors * plain_slopes(network, variable, points)).sum()
    expected = torch.autograd.grad(loss, variable)[0]
    ours = network.in_logistic_form(gradient - 1)
    torch.testing.assert_close(ours, expected, rtol=1e-11, atol=1e-12)
    unused = (expected == 0).sum().item()
    assert unused == (2 if of == "slopes" else 0), "only the output's biases do not move the slopes"
