"""The paper's network: its size, its derivatives and its gradient against automatic differentiation."""

import pytest
import torch

from solvers.pinn.paper.modified_mlp import ModifiedMlp


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
