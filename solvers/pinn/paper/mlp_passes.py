"""Values of modified MLPs, their derivatives along x and y, and the derivatives of both over the parameters.

With σ the logistic function, whose argument s is twice tanh's, and a, b, σ_k in the place of A, B, Z_k, the
formulas of `modified_mlp` read

    step = 4 (b - a)        base = 4 a - 2 b - 1        H_k+1 = base + σ_k * step

The derivatives along x and y take one pass down through the layers, as in reverse differentiation. What a
loss needs of them over the parameters is the sum over points of f_x du/dx + f_y du/dy, the derivative of u
along a direction f at each point. Over a matrix between a layer h and an argument s the derivative of u is
h^T δ with δ = du/ds; that of the sum is, by the product rule,

    h'^T δ + h^T δ'

with h' and δ' the derivatives of h and δ along f: one more pass up and one down. These are two thirds of the
matrix products that it takes to carry both derivatives forward. Arrays have the shape (networks, n, width),
those of the layers that see X (networks, 3, n, width); the three are a, b and σ_1 (or that of H_1).
"""

from typing import NamedTuple

import torch

from solvers.pinn.paper.modified_mlp import ModifiedMlp, Weights


class Ascent(NamedTuple):
    """A pass from the points to the output, or its derivatives along directions.

    Attributes:
        points: Points with a column of ones, shape (n, 3); or directions with zeros, (networks, 1, n, 3).
        first: The layers that see the points.
        step: 4 (b - a).
        gates: σ_k of the gates that see a hidden layer.
        hidden: What they see and, last, what the output layer sees.
    """

    points: torch.Tensor
    first: torch.Tensor
    step: torch.Tensor
    gates: list[torch.Tensor]
    hidden: list[torch.Tensor]


class Descent(NamedTuple):
    """A pass from the output to the points: derivatives of the output along the layers.

    Attributes:
        above: Along `Ascent.hidden`.
        rates: Derivative of σ_k along the gate's argument, in the order of `Ascent.gates`.
        arguments: Along the gates' arguments.
        outer: Along `Ascent.first`.
        first_rates: Derivative of `Ascent.first` along its arguments.
        first: Along those arguments.
    """

    above: list[torch.Tensor]
    rates: list[torch.Tensor]
    arguments: list[torch.Tensor]
    outer: torch.Tensor
    first_rates: torch.Tensor
    first: torch.Tensor


class MlpPass:
    """Modified MLPs at a few points.

    Args:
        network: The networks' shape.
        weights: Their parameters in logistic form (`ModifiedMlp.in_logistic_form`).
        points: Shape (n, 2), mm.
    """

    def __init__(self, network: ModifiedMlp, weights: Weights, points: torch.Tensor) -> None:
        self._literal, self._weights = network.literal_gate, weights
        ones = torch.cat([points, points.new_ones(len(points), 1)], dim=1)
        first = torch.matmul(ones, weights.first).sigmoid_()
        step, base = _step_and_base(first)
        base -= 1
        third = first[:, 2]
        gates: list[torch.Tensor] = []
        hidden = [2 * third - 1 if self._literal else torch.addcmul(base, third, step)]
        for matrix, bias in zip(weights.gates, weights.biases, strict=True):
            gates.append(torch.baddbmm(bias, hidden[-1], matrix).sigmoid_())
            hidden.append(torch.addcmul(base, gates[-1], step))
        self._up = Ascent(ones, first, step, gates, hidden)

    def values(self) -> torch.Tensor:
        """Outputs of the networks, shape (networks, n)."""
        return (self._up.hidden[-1] @ self._weights.output)[..., 0] + self._weights.output_bias

    def slopes(self) -> torch.Tensor:
        """Derivatives of the outputs along x and y, shape (networks, n, 2)."""
        self._down = self._descend(self._up.first.new_ones(1))
        return torch.matmul(self._down.first, self._weights.first[:, :, :2].mT).sum(1)

    def add_value_gradient(self, factors: torch.Tensor, sums: Weights) -> None:
        """Add to `sums` the derivatives over the parameters of Σ factors * values.

        Args:
            factors: Shape (networks, n).
            sums: Views of a tensor in the shape of the parameters in logistic form.
        """
        down = self._descend(factors[..., None])
        _add_products(self._up, down.first, down.arguments, sums)
        _add_biases(down.arguments, sums)
        sums.output.add_(self._up.hidden[-1].mT @ factors[..., None])
        sums.output_bias.add_(factors.sum(1, keepdim=True))

    def add_slope_gradient(self, factors: torch.Tensor, sums: Weights) -> None:
        """Add those of Σ factors * slopes, with factors of shape (networks, n, 2); after `slopes`."""
        up, down = self._up, self._down
        up_along = self._ascend_along(factors)
        first, arguments = self._descend_along(up_along)
        _add_products(up, first, arguments, sums)
        _add_biases(arguments, sums)
        _add_products(up_along, down.first, down.arguments, sums)
        sums.output.add_(up_along.hidden[-1].sum(1)[..., None])

    def _descend(self, factors: torch.Tensor) -> Descent:
        """Derivatives of the sum of factors times values."""
        up, weights = self._up, self._weights
        above = [(factors * weights.output.mT).expand_as(up.step)]
        rates: list[torch.Tensor] = []
        arguments: list[torch.Tensor] = []
        to_base, to_step = torch.zeros_like(up.step), torch.zeros_like(up.step)
        for gate, matrix in zip(reversed(up.gates), reversed(weights.gates), strict=True):
            rates.insert(0, torch.addcmul(gate, gate, gate, value=-1))
            to_base += above[0]
            to_step.addcmul_(above[0], gate)
            arguments.insert(0, (above[0] * up.step).mul_(rates[0]))
            above.insert(0, arguments[0] @ matrix.mT)
        outer = torch.empty_like(up.first)
        if self._literal:
            torch.mul(above[0], 2, out=outer[:, 2])
        else:
            to_base += above[0]
            to_step.addcmul_(above[0], up.first[:, 2])
            torch.mul(above[0], up.step, out=outer[:, 2])
        _to_encoders(to_base, to_step, outer)
        first_rates = torch.addcmul(up.first, up.first, up.first, value=-1)
        return Descent(above, rates, arguments, outer, first_rates, outer * first_rates)

    def _ascend_along(self, directions: torch.Tensor) -> Ascent:
        """Derivatives of the way up along directions of shape (networks, n, 2)."""
        up, down, weights = self._up, self._down, self._weights
        points = torch.nn.functional.pad(directions, (0, 1))[:, None]
        first = torch.matmul(points, weights.first).mul_(down.first_rates)
        step, base = _step_and_base(first)
        third = first[:, 2]
        gates: list[torch.Tensor] = []
        hidden = [2 * third if self._literal else _product_along(base, up.first[:, 2], third, up.step, step)]
        for gate, rate, matrix in zip(up.gates, down.rates, weights.gates, strict=True):
            gates.append((hidden[-1] @ matrix).mul_(rate))
            hidden.append(_product_along(base, gate, gates[-1], up.step, step))
        return Ascent(points, first, step, gates, hidden)

    def _descend_along(self, along: Ascent) -> tuple[torch.Tensor, list[torch.Tensor]]:
        """Derivatives of `Descent.first` and `Descent.arguments` along the same directions."""
        up, down, weights = self._up, self._down, self._weights
        above = torch.zeros_like(up.step)
        arguments: list[torch.Tensor] = []
        to_base, to_step = torch.zeros_like(up.step), torch.zeros_like(up.step)
        for k in reversed(range(len(up.gates))):
            gate, gate_along, higher = up.gates[k], along.gates[k], down.above[k + 1]
            to_base += above
            to_step.addcmul_(above, gate).addcmul_(higher, gate_along)
            rate = torch.addcmul(gate_along, gate, gate_along, value=-2)
            level = (along.step * down.rates[k]).addcmul_(up.step, rate)
            argument = (higher * level).addcmul_(above * up.step, down.rates[k])
            arguments.insert(0, argument)
            above = argument @ weights.gates[k].mT
        outer = torch.empty_like(up.first)
        third, third_along = up.first[:, 2], along.first[:, 2]
        if self._literal:
            torch.mul(above, 2, out=outer[:, 2])
        else:
            to_base += above
            to_step.addcmul_(above, third).addcmul_(down.above[0], third_along)
            torch.mul(above, up.step, out=outer[:, 2]).addcmul_(down.above[0], along.step)
        _to_encoders(to_base, to_step, outer)
        rates = torch.addcmul(along.first, up.first, along.first, value=-2)
        return outer.mul_(down.first_rates).addcmul_(down.outer, rates), arguments


def _step_and_base(first: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
    """4 (b - a) and 4 a - 2 b."""
    step = torch.sub(first[:, 1], first[:, 0]).mul_(4)
    return step, torch.sub(2 * first[:, 0], step, alpha=0.5)


def _to_encoders(to_base: torch.Tensor, to_step: torch.Tensor, outer: torch.Tensor) -> None:
    """Derivatives along a and b, the first two of `outer`, from those along base and step."""
    torch.sub(to_base, to_step, out=outer[:, 0]).mul_(4)
    torch.sub(4 * to_step, to_base, alpha=2, out=outer[:, 1])


def _product_along(
    base: torch.Tensor,
    gate: torch.Tensor,
    gate_along: torch.Tensor,
    step: torch.Tensor,
    step_along: torch.Tensor,
) -> torch.Tensor:
    """Derivative of base + gate * step."""
    return torch.addcmul(base, gate_along, step).addcmul_(gate, step_along)


def _add_products(up: Ascent, first: torch.Tensor, arguments: list[torch.Tensor], sums: Weights) -> None:
    """Add inputs times derivatives along arguments, h^T δ, of every layer but the last."""
    sums.first.add_(torch.matmul(up.points.mT, first))
    for matrix, hidden, argument in zip(sums.gates, up.hidden[:-1], arguments, strict=True):
        matrix.baddbmm_(hidden.mT, argument)


def _add_biases(arguments: list[torch.Tensor], sums: Weights) -> None:
    for bias, argument in zip(sums.biases, arguments, strict=True):
        bias.add_(argument.sum(1, keepdim=True))
