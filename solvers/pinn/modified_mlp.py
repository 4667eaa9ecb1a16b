"""The modified MLP that the paper uses, with its exact derivatives along x and y.

With X = (x, y), tanh as activation and `*` by element (S. Wang, Y. Teng, P. Perdikaris: Understanding and
mitigating gradient flow pathologies in physics-informed neural networks, SIAM J. Sci. Comput. 43 (2021)
A3055-A3081):

    A = tanh(X W_A + b_A)         B = tanh(X W_B + b_B)
    Z_1 = tanh(X W_1 + b_1)       Z_k = tanh(H_k W_k + b_k), k = 2..L
    H_k+1 = (1 - Z_k) * A + Z_k * B
    output = H_L+1 w + b

The paper prints a layer more: Z_1 is made of H_1 = tanh(X W_0 + b_0), as the other gates are. `literal_gate`
takes that reading. Several networks of one output each are evaluated together. Arrays have the shape
(networks, streams, n, width) with the value and its two derivatives as streams, or the value alone.
"""

from dataclasses import dataclass
from typing import NamedTuple

import torch


class Weights(NamedTuple):
    """The parameters of the networks; views of one tensor.

    Attributes:
        first: The layers that see X, those of A, B and Z_1 (or H_1): slopes along x and y and the bias, shape
            (networks, 3, 3, width).
        gates: The other gates: weights and, in the last row, the bias, shape (networks, gates, width + 1,
            width).
        output: Weights and, last, the bias, shape (networks, width + 1).
    """

    first: torch.Tensor
    gates: torch.Tensor
    output: torch.Tensor


class Layers(NamedTuple):
    """What a forward pass leaves behind for the reverse pass.

    Attributes:
        points: Points with a column of ones, shape (n, 3).
        first: A, B and Z_1 (or H_1), shape (networks, 3, streams, n, width).
        step: B - A.
        hidden: H_k, the inputs of the gates and of the output layer.
        gates: Z_k of the gates that see H_k.
        output: The output's streams, shape (networks, streams, n).
    """

    points: torch.Tensor
    first: torch.Tensor
    step: torch.Tensor
    hidden: list[torch.Tensor]
    gates: list[torch.Tensor]
    output: torch.Tensor


@dataclass(frozen=True)
class ModifiedMlp:
    """Shape of modified MLPs that are evaluated together.

    Attributes:
        networks: How many.
        width: Neurons in a layer.
        layers: Number of gates L.
        literal_gate: Whether the first gate has a layer of its own, as printed in the paper.
    """

    networks: int = 2
    width: int = 64
    layers: int = 4
    literal_gate: bool = False

    @property
    def gates(self) -> int:
        """Number of gates that see a hidden layer."""
        return self.layers if self.literal_gate else self.layers - 1

    @property
    def parameters(self) -> int:
        """Number of parameters of one network."""
        return 9 * self.width + self.gates * (self.width + 1) * self.width + self.width + 1

    def weights(self, parameters: torch.Tensor) -> Weights:
        """Views of a parameter tensor of shape (networks, parameters)."""
        shapes = (
            (3, 3, self.width),
            (self.gates, self.width + 1, self.width),
            (self.width + 1,),
        )
        counts = [torch.Size(shape).numel() for shape in shapes]
        parts = parameters.split(counts, dim=1)
        return Weights(*(part.unflatten(1, shape) for part, shape in zip(parts, shapes, strict=True)))

    def initial(self, seed: int, dtype: torch.dtype) -> torch.Tensor:
        """Glorot-normal weights and zero biases (Glorot and Bengio 2010), shape (networks, parameters)."""
        generator = torch.Generator().manual_seed(seed)
        parameters = torch.zeros(self.networks, self.parameters, dtype=torch.float64)
        first, gates, output = self.weights(parameters)
        for matrix, fan_in, fan_out in (
            (first[:, :, :2], 2, self.width),
            (gates[:, :, :-1], self.width, self.width),
            (output[:, :-1], self.width, 1),
        ):
            matrix.normal_(0, (2 / (fan_in + fan_out)) ** 0.5, generator=generator)
        return parameters.to(dtype)

    def forward(self, parameters: torch.Tensor, points: torch.Tensor, *, derivatives: bool) -> Layers:
        """Evaluate at points of shape (n, 2), with derivatives or without."""
        weights = self.weights(parameters)
        ones = torch.cat([points, points.new_ones(len(points), 1)], dim=1)
        streams = 3 if derivatives else 1
        first = points.new_empty(self.networks, 3, streams, len(points), self.width)
        torch.matmul(ones, weights.first, out=first[:, :, 0])
        first[:, :, 1:] = weights.first[:, :, : streams - 1, None]
        _activate(first)
        base, step = first[:, 0], first[:, 1] - first[:, 0]
        third = first[:, 2]
        hidden = [third if self.literal_gate else _blend(base, step, third)]
        gates = []
        for k in range(self.gates):
            gate = torch.matmul(hidden[-1].flatten(1, 2), weights.gates[:, k, :-1]).view_as(base)
            gate[:, 0] += weights.gates[:, k, -1:]
            gates.append(_activate(gate))
            hidden.append(_blend(base, step, gate))
        output = torch.matmul(hidden[-1].flatten(1, 2), weights.output[:, :-1, None])
        output = output.view(self.networks, streams, len(points))
        output[:, 0] += weights.output[:, -1:]
        return Layers(ones, first, step, hidden, gates, output)

    def reverse(
        self, parameters: torch.Tensor, layers: Layers, adjoint: torch.Tensor, gradient: torch.Tensor
    ) -> None:
        """Add to `gradient` what the loss changes with the parameters, given how it changes with the output.

        Args:
            parameters: Shape (networks, parameters).
            layers: What `forward` returned for them.
            adjoint: Derivatives of the loss along the output's streams, shape (networks, streams, n).
            gradient: Shape (networks, parameters).
        """
        weights, sums = self.weights(parameters), self.weights(gradient)
        first, step = layers.first, layers.step
        above = adjoint[..., None] * weights.output[:, None, None, :-1]
        sums.output[:, :-1] += (adjoint.flatten(1)[:, None] @ layers.hidden[-1].flatten(1, 2))[:, 0]
        sums.output[:, -1] += adjoint[:, 0].sum(1)
        to_first = torch.zeros_like(first)
        for k in reversed(range(self.gates)):
            above = _blend_adjoint(above, step, layers.gates[k], to_first)
            _activation_adjoint(above, layers.gates[k])
            matrix = above.flatten(1, 2)
            sums.gates[:, k, :-1].baddbmm_(layers.hidden[k].flatten(1, 2).transpose(1, 2), matrix)
            sums.gates[:, k, -1] += above[:, 0].sum(1)
            above = torch.matmul(matrix, weights.gates[:, k, :-1].transpose(1, 2)).view_as(above)
        to_first[:, 2] = above if self.literal_gate else _blend_adjoint(above, step, first[:, 2], to_first)
        _activation_adjoint(to_first, first)
        sums.first.add_(layers.points.T @ to_first[:, :, 0])
        sums.first[:, :, : to_first.shape[2] - 1].add_(to_first[:, :, 1:].sum(3))


def _activate(streams: torch.Tensor) -> torch.Tensor:
    """Apply tanh in place to streams (..., streams, n, width), to the derivatives by the chain rule."""
    value = streams[..., 0, :, :].tanh_()
    streams[..., 1:, :, :] *= (1 - value * value).unsqueeze(-3)
    return streams


def _activation_adjoint(adjoint: torch.Tensor, streams: torch.Tensor) -> None:
    """Turn the adjoint of tanh's streams into that of its argument's, in place."""
    value, slopes = streams[..., 0, :, :], streams[..., 1:, :, :]
    rate = 1 - value * value
    curvature = (adjoint[..., 1:, :, :] * slopes).sum(-3)
    adjoint *= rate.unsqueeze(-3)
    adjoint[..., 0, :, :].addcmul_(value, curvature, value=-2)


def _blend(base: torch.Tensor, step: torch.Tensor, gate: torch.Tensor) -> torch.Tensor:
    """(1 - gate) * A + gate * B = A + gate * (B - A), with its derivatives."""
    blend = torch.addcmul(base, gate[:, :1], step)
    blend[:, 1:].addcmul_(gate[:, 1:], step[:, :1])
    return blend


def _blend_adjoint(
    above: torch.Tensor, step: torch.Tensor, gate: torch.Tensor, to_first: torch.Tensor
) -> torch.Tensor:
    """Adjoint of the gate's streams; what goes to A and B is added to `to_first`."""
    to_b = above * gate[:, :1]
    to_b[:, 0] += (above[:, 1:] * gate[:, 1:]).sum(1)
    to_first[:, 1] += to_b
    to_first[:, 0] += above - to_b
    to_gate = above * step[:, :1]
    to_gate[:, 0] += (above[:, 1:] * step[:, 1:]).sum(1)
    return to_gate
