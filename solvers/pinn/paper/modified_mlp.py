"""The paper's modified MLP: shape, initial weights, values and derivatives.

With X = (x, y) and `*` by element (S. Wang, Y. Teng, P. Perdikaris: Understanding and mitigating gradient
flow pathologies in physics-informed neural networks, SIAM J. Sci. Comput. 43 (2021) A3055-A3081):

    A = tanh(X W_A + b_A)         B = tanh(X W_B + b_B)
    Z_1 = tanh(X W_1 + b_1)       Z_k = tanh(H_k W_k + b_k), k = 2..L
    H_k+1 = (1 - Z_k) * A + Z_k * B
    output = H_L+1 w + b

The paper prints a layer more, H_1 = tanh(X W_0 + b_0), of which Z_1 is made as the other gates are. X is in
mm, as it is: the paper mentions no scaling.
"""

from dataclasses import dataclass
from typing import NamedTuple

import torch


class Weights(NamedTuple):
    """Parameters of the networks, as views of one tensor."""

    # The input layers, those of A, B and Z_1: weights of x and y and the bias, shape (networks, 3, 3, width)
    first: torch.Tensor
    gates: list[torch.Tensor]  # Matrices of the gates on hidden layers, each (networks, width, width)
    biases: list[torch.Tensor]  # Their biases, each (networks, 1, width)
    output: torch.Tensor  # Shape (networks, width, 1)
    output_bias: torch.Tensor  # Shape (networks, 1)


@dataclass(frozen=True)
class ModifiedMlp:
    """Shape of modified MLPs of one output each, evaluated together."""

    networks: int = 2  # Number of networks
    width: int = 64  # Neurons in a layer
    layers: int = 4  # Number of gates L

    @property
    def gates(self) -> int:
        """Number of gates on hidden layers."""
        return self.layers - 1

    @property
    def parameters(self) -> int:
        """Number of parameters of one network."""
        return 9 * self.width + self.gates * (self.width + 1) * self.width + self.width + 1

    def weights(self, parameters: torch.Tensor) -> Weights:
        """Views of a parameter tensor of shape (networks, parameters)."""
        width, gate = self.width, (self.width + 1) * self.width
        first, *gates, output, bias = parameters.split([9 * width, *[gate] * self.gates, width, 1], dim=1)
        layers = [part.unflatten(1, (width + 1, width)) for part in gates]
        return Weights(
            first.unflatten(1, (3, 3, width)),
            [layer[:, :-1] for layer in layers],
            [layer[:, -1:] for layer in layers],
            output[:, :, None],
            bias,
        )

    def initial(self, seed: int, dtype: torch.dtype) -> torch.Tensor:
        """Glorot-normal weights and zero biases, shape (networks, parameters).

        Source: X. Glorot, Y. Bengio: Understanding the difficulty of training deep feedforward neural
        networks, AISTATS 2010: variance 2 / (inputs + outputs).
        """
        generator = torch.Generator().manual_seed(seed)
        parameters = torch.zeros(self.networks, self.parameters, dtype=torch.float64)
        weights = self.weights(parameters)
        for matrix in (weights.first[:, :, :-1], *weights.gates, weights.output):
            variance = 2 / sum(matrix.shape[-2:])
            matrix.normal_(0, variance**0.5, generator=generator)
        return parameters.to(dtype)

    def values(self, parameters: torch.Tensor, points: torch.Tensor) -> torch.Tensor:
        """Outputs at points (n, 2), or at points of each network's own, (networks, n, 2): (networks, n)."""
        weights = self.weights(parameters)
        points = points.expand(self.networks, -1, -1)
        with_one = torch.cat([points, torch.ones_like(points[..., :1])], dim=-1)
        a, b, first = torch.tanh(with_one[:, None] @ weights.first).unbind(1)
        hidden = torch.lerp(a, b, first)
        for matrix, bias in zip(weights.gates, weights.biases, strict=True):
            hidden = torch.lerp(a, b, torch.tanh(torch.baddbmm(bias, hidden, matrix)))
        return (hidden @ weights.output)[..., 0] + weights.output_bias

    def gradients(self, parameters: torch.Tensor, points: torch.Tensor) -> torch.Tensor:
        """Derivatives of the outputs by x and y at points (n, 2): (networks, n, 2).

        They can be differentiated by the parameters where these require it.
        """
        with torch.enable_grad():
            own = points.repeat(self.networks, 1, 1).requires_grad_()
            total = self.values(parameters, own).sum()
            return torch.autograd.grad(total, own, create_graph=parameters.requires_grad)[0]
