"""Values of modified MLPs, their gradients in x and y, and the gradients of both in the parameters.

With σ the logistic function, whose argument s is twice tanh's, and a, b, σ_k in the place of A, B, Z_k, the
formulas of `modified_mlp` read

    step = 4 (b - a)        base = 4 a - 2 b - 1        H_k+1 = base + σ_k * step

The gradient in x and y takes one backward pass. A loss needs the gradient in the parameters of the sum over
points of f_x du/dx + f_y du/dy, the derivative of u along a direction f at each point. The derivative of u by
a matrix between a layer h and an argument s is h^T δ with δ = du/ds; that of the sum is

    h'^T δ + h^T δ'

with the tangents h' and δ', the derivatives of h and δ along f: one more forward and one more backward pass.
These take two thirds of the matrix products of carrying both derivatives forward. Arrays have the shape
(networks, n, width), those of the input layers (networks, 3, n, width), which are a, b and σ_1 (or H_1's).
"""

from typing import NamedTuple

import torch

from pinnray.solvers.pinn.paper.modified_mlp import ModifiedMlp, Weights


class ForwardPass(NamedTuple):
    """Layers from the points to the output, or their tangents along directions."""

    # Points with a column of ones, shape (n, 3); or directions with zeros, (networks, 1, n, 3)
    points: torch.Tensor
    first: torch.Tensor  # The input layers
    step: torch.Tensor  # 4 (b - a)
    gates: list[torch.Tensor]  # σ_k of the gates on hidden layers
    hidden: list[torch.Tensor]  # Inputs of these gates and, last, of the output layer


class BackwardPass(NamedTuple):
    """Derivatives of the output with respect to the layers, or their tangents."""

    above: list[torch.Tensor]  # With respect to `ForwardPass.hidden`
    rates: list[torch.Tensor]  # Of σ_k with respect to its argument, in the order of `ForwardPass.gates`
    arguments: list[torch.Tensor]  # With respect to the gates' arguments
    outer: torch.Tensor  # With respect to `ForwardPass.first`
    first_rates: torch.Tensor  # Of `ForwardPass.first` with respect to its arguments
    first: torch.Tensor  # With respect to those arguments


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
        self._forward_pass = ForwardPass(ones, first, step, gates, hidden)

    def values(self) -> torch.Tensor:
        """Outputs of the networks, shape (networks, n)."""
        return (self._forward_pass.hidden[-1] @ self._weights.output)[..., 0] + self._weights.output_bias

    def input_gradients(self) -> torch.Tensor:
        """Derivatives of the outputs with respect to x and y, shape (networks, n, 2)."""
        self._backward_pass = self._backward(self._forward_pass.first.new_ones(1))
        return torch.matmul(self._backward_pass.first, self._weights.first[:, :, :2].mT).sum(1)

    def backward_values(self, factors: torch.Tensor, sums: Weights) -> None:
        """Add the gradient of Σ factors * values in the weights to `sums`; factors (networks, n)."""
        backward = self._backward(factors[..., None])
        _add_products(self._forward_pass, backward.first, backward.arguments, sums)
        _add_biases(backward.arguments, sums)
        sums.output.add_(self._forward_pass.hidden[-1].mT @ factors[..., None])
        sums.output_bias.add_(factors.sum(1, keepdim=True))

    def backward_input_gradients(self, factors: torch.Tensor, sums: Weights) -> None:
        """The same for Σ factors * input gradients, factors (networks, n, 2); after `input_gradients`."""
        forward, backward = self._forward_pass, self._backward_pass
        forward_tangent = self._forward_tangent(factors)
        first, arguments = self._backward_tangent(forward_tangent)
        _add_products(forward, first, arguments, sums)
        _add_biases(arguments, sums)
        _add_products(forward_tangent, backward.first, backward.arguments, sums)
        sums.output.add_(forward_tangent.hidden[-1].sum(1)[..., None])

    def _backward(self, factors: torch.Tensor) -> BackwardPass:
        """Derivatives of the sum of factors times values."""
        forward, weights = self._forward_pass, self._weights
        above = [(factors * weights.output.mT).expand_as(forward.step)]
        rates: list[torch.Tensor] = []
        arguments: list[torch.Tensor] = []
        to_base, to_step = torch.zeros_like(forward.step), torch.zeros_like(forward.step)
        for gate, matrix in zip(reversed(forward.gates), reversed(weights.gates), strict=True):
            rates.insert(0, torch.addcmul(gate, gate, gate, value=-1))
            to_base += above[0]
            to_step.addcmul_(above[0], gate)
            arguments.insert(0, (above[0] * forward.step).mul_(rates[0]))
            above.insert(0, arguments[0] @ matrix.mT)
        outer = torch.empty_like(forward.first)
        if self._literal:
            torch.mul(above[0], 2, out=outer[:, 2])
        else:
            to_base += above[0]
            to_step.addcmul_(above[0], forward.first[:, 2])
            torch.mul(above[0], forward.step, out=outer[:, 2])
        _to_encoders(to_base, to_step, outer)
        first_rates = torch.addcmul(forward.first, forward.first, forward.first, value=-1)
        return BackwardPass(above, rates, arguments, outer, first_rates, outer * first_rates)

    def _forward_tangent(self, directions: torch.Tensor) -> ForwardPass:
        """Tangents of the forward pass along directions of shape (networks, n, 2)."""
        forward, backward, weights = self._forward_pass, self._backward_pass, self._weights
        points = torch.nn.functional.pad(directions, (0, 1))[:, None]
        first = torch.matmul(points, weights.first).mul_(backward.first_rates)
        step, base = _step_and_base(first)
        third = first[:, 2]
        gates: list[torch.Tensor] = []
        product = _product_tangent(base, forward.first[:, 2], third, forward.step, step)
        hidden = [2 * third if self._literal else product]
        for gate, rate, matrix in zip(forward.gates, backward.rates, weights.gates, strict=True):
            gates.append((hidden[-1] @ matrix).mul_(rate))
            hidden.append(_product_tangent(base, gate, gates[-1], forward.step, step))
        return ForwardPass(points, first, step, gates, hidden)

    def _backward_tangent(self, tangent: ForwardPass) -> tuple[torch.Tensor, list[torch.Tensor]]:
        """Tangents of `BackwardPass.first` and `BackwardPass.arguments` along the same directions."""
        forward, backward, weights = self._forward_pass, self._backward_pass, self._weights
        above = torch.zeros_like(forward.step)
        arguments: list[torch.Tensor] = []
        to_base, to_step = torch.zeros_like(forward.step), torch.zeros_like(forward.step)
        for k in reversed(range(len(forward.gates))):
            gate, gate_tangent, higher = forward.gates[k], tangent.gates[k], backward.above[k + 1]
            to_base += above
            to_step.addcmul_(above, gate).addcmul_(higher, gate_tangent)
            rate = torch.addcmul(gate_tangent, gate, gate_tangent, value=-2)
            level = (tangent.step * backward.rates[k]).addcmul_(forward.step, rate)
            argument = (higher * level).addcmul_(above * forward.step, backward.rates[k])
            arguments.insert(0, argument)
            above = argument @ weights.gates[k].mT
        outer = torch.empty_like(forward.first)
        third, third_tangent = forward.first[:, 2], tangent.first[:, 2]
        if self._literal:
            torch.mul(above, 2, out=outer[:, 2])
        else:
            to_base += above
            to_step.addcmul_(above, third).addcmul_(backward.above[0], third_tangent)
            torch.mul(above, forward.step, out=outer[:, 2]).addcmul_(backward.above[0], tangent.step)
        _to_encoders(to_base, to_step, outer)
        rates = torch.addcmul(tangent.first, forward.first, tangent.first, value=-2)
        return outer.mul_(backward.first_rates).addcmul_(backward.outer, rates), arguments


def _step_and_base(first: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
    """4 (b - a) and 4 a - 2 b."""
    step = torch.sub(first[:, 1], first[:, 0]).mul_(4)
    return step, torch.sub(2 * first[:, 0], step, alpha=0.5)


def _to_encoders(to_base: torch.Tensor, to_step: torch.Tensor, outer: torch.Tensor) -> None:
    """Derivatives by a and b, the first two of `outer`, from those by base and step."""
    torch.sub(to_base, to_step, out=outer[:, 0]).mul_(4)
    torch.sub(4 * to_step, to_base, alpha=2, out=outer[:, 1])


def _product_tangent(
    base: torch.Tensor,
    gate: torch.Tensor,
    gate_tangent: torch.Tensor,
    step: torch.Tensor,
    step_tangent: torch.Tensor,
) -> torch.Tensor:
    """Tangent of base + gate * step."""
    return torch.addcmul(base, gate_tangent, step).addcmul_(gate, step_tangent)


def _add_products(
    forward: ForwardPass, first: torch.Tensor, arguments: list[torch.Tensor], sums: Weights
) -> None:
    """Add h^T δ, inputs times derivatives by arguments, of every layer but the last."""
    sums.first.add_(torch.matmul(forward.points.mT, first))
    for matrix, hidden, argument in zip(sums.gates, forward.hidden[:-1], arguments, strict=True):
        matrix.baddbmm_(hidden.mT, argument)


def _add_biases(arguments: list[torch.Tensor], sums: Weights) -> None:
    for bias, argument in zip(sums.biases, arguments, strict=True):
        bias.add_(argument.sum(1, keepdim=True))
