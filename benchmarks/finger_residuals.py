"""The residuals of `FingerNetwork` with their Jacobian, for optimisers of sums of squares."""

from collections.abc import Iterator
from dataclasses import dataclass

import torch

from benchmarks.finger_network import PIECE, FingerNetwork
from solvers.pinn.threading import map_in_threads, slices


@dataclass(frozen=True, eq=False)
class FingerResiduals:
    """Residuals at some quadrature points.

    Attributes:
        network: The networks.
        points: Shape (n, 2), mm.
        weights: Shape (n,), mm²; the energy is |r|² / 2 if they belong to a rule.
    """

    network: FingerNetwork
    points: torch.Tensor
    weights: torch.Tensor

    @torch.no_grad()
    def values(self, parameters: torch.Tensor) -> torch.Tensor:
        """Shape (3 n,), the residuals of one point together."""
        shift = self.network.shift(parameters)

        @torch.no_grad()
        def piece(rows: slice) -> torch.Tensor:
            return self.network.residuals(parameters, shift, self.points[rows], self.weights[rows])

        return torch.cat(map_in_threads(piece, slices(len(self.points), PIECE)), dim=1).T.flatten()

    def linearised(self, parameters: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
        """Residuals and their Jacobian, shape (3 n, p)."""
        shift = self.network.shift(parameters)

        def at_point(
            parameters: torch.Tensor, shift: torch.Tensor, point: torch.Tensor, weight: torch.Tensor
        ) -> torch.Tensor:
            return self.network.residuals(parameters, shift, point[None], weight[None])[:, 0]

        jacobians = torch.func.vmap(
            torch.func.jacrev(at_point, argnums=(0, 1)), in_dims=(None, None, 0, 0), chunk_size=256
        )
        direct, over_shift = jacobians(parameters, shift, self.points, self.weights)
        of_shift = torch.func.jacrev(self.network.shift)(parameters)
        return self.values(parameters), (direct + over_shift @ of_shift).flatten(0, 1)


def everywhere(network: FingerNetwork) -> FingerResiduals:
    """At all quadrature points."""
    return FingerResiduals(network, network.points, network.weights)


def random_samples(network: FingerNetwork, count: int, seed: int) -> Iterator[FingerResiduals]:
    """At quadrature points drawn by their weights, again and again."""
    generator = torch.Generator().manual_seed(seed)
    equal = torch.full((count,), float(network.weights.sum()) / count, dtype=torch.float64)
    while True:
        chosen = torch.multinomial(network.weights, count, replacement=True, generator=generator)
        yield FingerResiduals(network, network.points[chosen], equal)
