"""The paper's network: its size, its derivatives and its reverse pass against automatic differentiation."""

import pytest
import torch

from solvers.pinn.modified_mlp import ModifiedMlp


def plain(network: ModifiedMlp, parameters: torch.Tensor, points: torch.Tensor) -> torch.Tensor:
    """The published formulas, one network after the other: shape (networks, n)."""
    first, gates, output = network.weights(parameters)
    results = []
    for k in range(network.networks):
        a, b, hidden = (torch.tanh(points @ layer[:2] + layer[2]) for layer in first[k])
        if not network.literal_gate:
            hidden = (1 - hidden) * a + hidden * b
        for gate in gates[k]:
            z = torch.tanh(hidden @ gate[:-1] + gate[-1])
            hidden = (1 - z) * a + z * b
        results.append(hidden @ output[k, :-1] + output[k, -1])
    return torch.stack(results)


@pytest.fixture(params=[False, True], ids=["published", "literal"])
def network(request) -> ModifiedMlp:
    return ModifiedMlp(width=7, layers=4, literal_gate=request.param)


@pytest.fixture
def parameters(network) -> torch.Tensor:
    """With biases that are not zero."""
    noise = torch.randn(
        2, network.parameters, generator=torch.Generator().manual_seed(1), dtype=torch.float64
    )
    return network.initial(0, torch.float64) + 0.2 * noise


@pytest.fixture
def points() -> torch.Tensor:
    return torch.randn(11, 2, generator=torch.Generator().manual_seed(2), dtype=torch.float64)


def streams(network, parameters, points) -> torch.Tensor:
    """Value and derivatives by automatic differentiation, shape (networks, 3, n)."""
    points = points.clone().requires_grad_()
    values = plain(network, parameters, points)
    slopes = [torch.autograd.grad(value.sum(), points, create_graph=True)[0].T for value in values]
    return torch.cat([values[:, None], torch.stack(slopes)], dim=1)


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
    first, gates, output = ModifiedMlp(networks=3).weights(ModifiedMlp(networks=3).initial(0, torch.float64))
    for matrix, fans in ((first[:, :, :-1], 66), (gates[:, :, :-1], 128), (output[:, :-1], 65)):
        assert matrix.std() == pytest.approx((2 / fans) ** 0.5, rel=3 / (2 * matrix.numel()) ** 0.5)
        assert abs(matrix.mean()) < 3 * matrix.std() / matrix.numel() ** 0.5
    assert max(bias.abs().max() for bias in (first[:, :, -1], gates[:, :, -1], output[:, -1])) == 0


def test_values_and_derivatives(network, parameters, points):
    expected = streams(network, parameters, points).detach()
    output = network.forward(parameters, points, derivatives=True).output
    torch.testing.assert_close(output, expected, rtol=1e-12, atol=1e-13)
    values = network.forward(parameters, points, derivatives=False).output
    torch.testing.assert_close(values, expected[:, :1], rtol=1e-12, atol=1e-13)


@pytest.mark.parametrize("derivatives", [True, False])
def test_gradient_over_every_parameter(network, parameters, points, derivatives):
    layers = network.forward(parameters, points, derivatives=derivatives)
    adjoint = torch.randn(
        layers.output.shape, generator=torch.Generator().manual_seed(3), dtype=torch.float64
    )
    gradient = torch.ones_like(parameters)  # what is there is added to
    network.reverse(parameters, layers, adjoint, gradient)
    variable = parameters.clone().requires_grad_()
    expected = streams(network, variable, points)[:, : adjoint.shape[1]]
    (wanted,) = torch.autograd.grad((expected * adjoint).sum(), variable)
    torch.testing.assert_close(gradient - 1, wanted, rtol=1e-11, atol=1e-12)
    assert (wanted != 0).all(), "a parameter that does nothing would not be checked"
