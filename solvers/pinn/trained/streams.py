"""Modified MLPs with their derivatives by position, and the derivatives of all of these by the weights.

A stream is a value, its derivative by x or that by y: three numbers a point and neuron that pass through the
layers together. Arrays have the networks first, then the streams, the points and the neurons.
"""

from dataclasses import dataclass
from typing import NamedTuple

import torch

from solvers.pinn.paper.modified_mlp import ModifiedMlp, Weights


class Layer(NamedTuple):
    """A layer of tanh neurons."""

    before: torch.Tensor  # Streams of the neurons' arguments, shape (..., 3, n, width)
    after: torch.Tensor  # Streams of tanh of them, the same shape

    @classmethod
    def of(cls, before: torch.Tensor) -> "Layer":
        """The layer with these arguments."""
        value = before.select(-3, 0).tanh().unsqueeze(-3)
        return cls(before, torch.cat([value, (1 - value * value) * before.narrow(-3, 1, 2)], dim=-3))

    def back(self, after: torch.Tensor) -> torch.Tensor:
        """Derivatives by `before` from those by `after`, each (networks, r, 3, n, width)."""
        value = self.after[:, None, 0]
        slope = 1 - value * value
        along = after[:, :, 1:] * slope[:, :, None]
        turning = (along * self.before[:, None, 1:]).sum(dim=2)
        return torch.cat([(after[:, :, 0] * slope - 2 * value * turning)[:, :, None], along], dim=2)


@dataclass(frozen=True, eq=False)
class Streams:
    """Networks evaluated at n points."""

    shape: ModifiedMlp  # Of the networks
    weights: Weights  # Of the networks
    inputs: torch.Tensor  # Streams of (x, y, 1), scaled, shape (3, n, 3)
    first: tuple[Layer, Layer, Layer]  # The layers of A, B and Z_1 (see `ModifiedMlp`)
    gates: list[Layer]  # Those of the other gates
    hidden: list[torch.Tensor]  # H_2, H_3, ..., each (networks, 3, n, width)
    output: torch.Tensor  # Streams of the outputs, shape (networks, 3, n)

    @classmethod
    def of(cls, shape: ModifiedMlp, parameters: torch.Tensor, inputs: torch.Tensor) -> "Streams":
        """Evaluate networks with `parameters`, shape (networks, parameters), at `inputs`, (3, n, 3)."""
        weights = shape.weights(parameters)
        closed, open_, gate = (
            Layer.of(inputs @ weights.first[:, number, None]) for number in range(weights.first.shape[1])
        )
        hidden, gates = [_blend(closed, open_, gate)], []
        for matrix, bias in zip(weights.gates, weights.biases, strict=True):
            before = hidden[-1] @ matrix[:, None]
            gates.append(Layer.of(torch.cat([before[:, :1] + bias[:, None], before[:, 1:]], dim=1)))
            hidden.append(_blend(closed, open_, gates[-1]))
        output = (hidden[-1] @ weights.output[:, None])[..., 0]
        output = torch.cat([output[:, :1] + weights.output_bias[:, None], output[:, 1:]], dim=1)
        return cls(shape, weights, inputs, (closed, open_, gate), gates, hidden, output)

    def jacobian(self, factors: torch.Tensor, chosen: torch.Tensor) -> torch.Tensor:
        """Derivatives of r combinations of the output's streams by chosen parameters.

        Args:
            factors: Of the streams in each combination, at each point, shape (r, n, 3).
            chosen: Numbers of the parameters, ascending, shape (networks, c).

        Returns:
            Shape (networks, r, n, c).
        """
        width, networks = self.shape.width, len(self.output)
        result = factors.new_empty((networks, *factors.shape[:2], chosen.shape[1]))

        def enter(start: int, left: torch.Tensor, right: torch.Tensor) -> None:
            """Enter those by the matrix that takes `left` (networks, 3, n, inputs) to a layer's arguments.

            The derivatives by these, (networks, r, 3, n, outputs), are `right`; parameters begin at `start`.
            """
            inputs, outputs = left.shape[-1], right.shape[-1]
            for network in range(networks):
                low, high = torch.searchsorted(
                    chosen[network], torch.tensor([start, start + inputs * outputs])
                )
                own = chosen[network, low:high] - start
                row, column = own // outputs, own % outputs
                for combination in range(len(factors)):
                    target = result[network, combination, :, low:high]
                    for stream in range(3):
                        part = left[network, stream][:, row]
                        part = part * right[network, combination, stream][:, column]
                        target.copy_(part) if stream == 0 else target.add_(part)

        weights, (closed, open_, gate) = self.weights, self.first
        streams = factors.transpose(1, 2)[None, ..., None]
        enter(
            self.shape.parameters - width - 1,
            _with_one(self.hidden[-1]),
            streams.expand(networks, -1, -1, -1, -1),
        )
        step = open_.after - closed.after
        of_hidden = streams * weights.output[:, None, None, None, :, 0]
        of_closed, of_step = torch.zeros_like(of_hidden), torch.zeros_like(of_hidden)

        def through(layer: Layer, of_hidden: torch.Tensor) -> torch.Tensor:
            """Derivatives by the gate's arguments; adds those by A and B - A to `of_closed`, `of_step`."""
            value, slopes = layer.after[:, None, :1], layer.after[:, None, 1:]
            of_closed.add_(of_hidden)
            of_step[:, :, 0] += of_hidden[:, :, 0] * value[:, :, 0] + (of_hidden[:, :, 1:] * slopes).sum(
                dim=2
            )
            of_step[:, :, 1:] += of_hidden[:, :, 1:] * value
            of_value = (of_hidden * step[:, None]).sum(dim=2, keepdim=True)
            return layer.back(torch.cat([of_value, of_hidden[:, :, 1:] * step[:, None, :1]], dim=2))

        for number in reversed(range(len(self.gates))):
            of_before = through(self.gates[number], of_hidden)
            start = 9 * width + number * (width + 1) * width
            enter(start, _with_one(self.hidden[number]), of_before)
            of_hidden = of_before @ weights.gates[number][:, None, None].transpose(-1, -2)
        of_gate = through(gate, of_hidden)
        inputs = self.inputs.expand(networks, -1, -1, -1)
        for number, of_before in enumerate((closed.back(of_closed - of_step), open_.back(of_step), of_gate)):
            enter(3 * width * number, inputs, of_before)
        return result


def _blend(closed: Layer, open_: Layer, gate: Layer) -> torch.Tensor:
    """Streams of (1 - Z) A + Z B."""
    step, value = open_.after - closed.after, gate.after[:, :1]
    blend = closed.after + value * step
    return torch.cat([blend[:, :1], blend[:, 1:] + gate.after[:, 1:] * step[:, :1]], dim=1)


def _with_one(hidden: torch.Tensor) -> torch.Tensor:
    """Streams of the hidden values and of the constant one that belongs to the bias."""
    one = torch.zeros_like(hidden[..., :1])
    one[:, 0] = 1
    return torch.cat([hidden, one], dim=-1)
