"""The hidden layers of a modified MLP with one gate, and their exact derivatives.

The network of Wang, Teng and Perdikaris (Understanding and mitigating gradient flow pathologies in
physics-informed neural networks, SIAM J. Sci. Comput. 43 (2021) A3055-A3081), which the paper uses, mixes two
encoders A and B of the input by a gate Z: H' = (1 - Z) A + Z B. Here every unit j has two encoders, a hidden
layer of four neurons of its own, and a gate:

    A_j = tanh(X w_A + b_A)    B_j = tanh(X w_B + b_B)    h_jk = tanh(X w_k + b_k), k = 1..4
    Z_j = tanh(sum_k v_k h_jk + c_j)                      H_j = (1 - Z_j) A_j + Z_j B_j

They start where geometry says: the four neurons are two crossed strips around a point of the body, so that
the gate opens there and closes away from it; the encoders are a ridge across that point and its negative.
"""

from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np
import torch

from geometry.arrays import FloatArray

STRIP_PEAK = 2 * float(np.tanh(1.0))
"""Height of tanh(s + 1) - tanh(s - 1) at the middle of a strip."""


@dataclass(frozen=True, eq=False)
class GatedUnits:
    """Weights of U gated units.

    Attributes:
        encoder_a: Weights (3, U) of A: two slopes, 1/mm, and the bias.
        encoder_b: Weights (3, U) of B.
        strips: Weights (3, U, 4) of the four hidden neurons of each unit.
        gate: Weights (5, U) of the gate: one for each hidden neuron and the bias.
    """

    encoder_a: torch.Tensor
    encoder_b: torch.Tensor
    strips: torch.Tensor
    gate: torch.Tensor

    @property
    def count(self) -> int:
        """Number of units."""
        return self.encoder_a.shape[1]

    @classmethod
    def around(
        cls, centres: FloatArray, *, width: float, slope: float, steepness: float, rng: np.random.Generator
    ) -> "GatedUnits":
        """Units whose gates open around points of the body.

        Args:
            centres: Shape (U, 2), mm.
            width: Half width of the strips, mm.
            slope: Slope of the encoders, 1/mm.
            steepness: Slope of the gate in units of the strips' height.
            rng: Draws the directions.
        """
        count = len(centres)
        turn = rng.uniform(0, np.pi, count)
        across = np.stack([np.cos(turn), np.sin(turn)])
        along = np.stack([-np.sin(turn), np.cos(turn)])
        strips = np.stack(
            [
                _through(centres, direction / width, offset)
                for direction in (across, along)
                for offset in (1.0, -1.0)
            ],
            axis=2,
        )
        gate = np.tile(steepness * np.array([1.0, -1.0, 1.0, -1.0]), (count, 1)).T
        # Open where both strips are: the threshold lies between one strip's height and two.
        threshold = np.full((1, count), -1.35 * steepness * STRIP_PEAK)
        ridge = rng.uniform(0, 2 * np.pi, count)
        encoder = _through(
            centres, slope * np.stack([np.cos(ridge), np.sin(ridge)]), rng.uniform(-1, 1, count)
        )
        weights = (encoder, -encoder, strips, np.concatenate([gate, threshold]))
        return cls(*(torch.from_numpy(np.ascontiguousarray(array)) for array in weights))

    @classmethod
    def joined(cls, parts: Sequence["GatedUnits"]) -> "GatedUnits":
        """The units of all the parts, in their order."""
        return cls(
            *(torch.cat([getattr(part, entry.name) for part in parts], dim=1) for entry in fields(cls))
        )

    def values(self, points: torch.Tensor) -> torch.Tensor:
        """Values of the units at points (n, 2), mm: (n, U)."""
        opening = self.gate[4] + sum(self.gate[k] * _ridge(points, self.strips[:, :, k]) for k in range(4))
        first, second = _ridge(points, self.encoder_a), _ridge(points, self.encoder_b)
        return first + torch.tanh(opening) * (second - first)

    def with_derivatives(self, points: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor]:
        """Values of the units and their derivatives along x and y at points (n, 2), mm; each (n, U)."""
        first, first_x, first_y = _ridge_with_derivatives(points, self.encoder_a)
        second, second_x, second_y = _ridge_with_derivatives(points, self.encoder_b)
        opening = self.gate[4].repeat(len(points), 1)
        opening_x, opening_y = torch.zeros_like(opening), torch.zeros_like(opening)
        for k in range(4):
            strip, strip_x, strip_y = _ridge_with_derivatives(points, self.strips[:, :, k])
            opening.addcmul_(strip, self.gate[k])
            opening_x.addcmul_(strip_x, self.gate[k])
            opening_y.addcmul_(strip_y, self.gate[k])
        gate = torch.tanh(opening)
        step = second - first
        rate = (1 - gate * gate) * step
        return (
            torch.addcmul(first, gate, step),
            first_x.addcmul_(gate, second_x - first_x).addcmul_(rate, opening_x),
            first_y.addcmul_(gate, second_y - first_y).addcmul_(rate, opening_y),
        )


def _through(centres: FloatArray, slopes: FloatArray, offset: FloatArray | float) -> FloatArray:
    """Weights (3, U) of ridges with slopes (2, U) that have the value `offset` at the centres (U, 2)."""
    return np.concatenate([slopes, (offset - (centres.T * slopes).sum(axis=0))[None]])


def _ridge(points: torch.Tensor, weights: torch.Tensor) -> torch.Tensor:
    return torch.addmm(weights[2], points, weights[:2]).tanh_()


def _ridge_with_derivatives(
    points: torch.Tensor, weights: torch.Tensor
) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor]:
    value = _ridge(points, weights)
    rate = 1 - value * value
    return value, rate * weights[0], rate * weights[1]
