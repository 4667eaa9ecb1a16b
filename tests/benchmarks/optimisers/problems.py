"""Known problems for the optimisers."""

from dataclasses import dataclass

import torch


@dataclass(frozen=True, eq=False)
class LinearLeastSquares:
    """|A x - b|² / 2, whose minimum `torch.linalg.lstsq` knows."""

    matrix: torch.Tensor
    right: torch.Tensor

    def values(self, x: torch.Tensor) -> torch.Tensor:
        return self.matrix @ x - self.right

    def linearised(self, x: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
        return self.values(x), self.matrix

    @property
    def solution(self) -> torch.Tensor:
        return torch.linalg.lstsq(self.matrix, self.right[:, None], driver="gelsd").solution[:, 0]


class RosenbrockResiduals:
    """10 (x_2 - x_1²) and 1 - x_1 (J. Moré, B. Garbow, K. Hillstrom 1981, problem 1); zero at (1, 1)."""

    start = torch.tensor([-1.2, 1.0], dtype=torch.float64)

    def values(self, x: torch.Tensor) -> torch.Tensor:
        return torch.stack([10 * (x[1] - x[0] ** 2), 1 - x[0]])

    def linearised(self, x: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
        return self.values(x), torch.autograd.functional.jacobian(self.values, x)


class KowalikOsborne:
    """Moré, Garbow, Hillstrom 1981, problem 15: |r|² is 3.07505e-4 at the minimum."""

    y = torch.tensor(
        [0.1957, 0.1947, 0.1735, 0.1600, 0.0844, 0.0627, 0.0456, 0.0342, 0.0323, 0.0235, 0.0246],
        dtype=torch.float64,
    )
    u = torch.tensor(
        [4.0, 2.0, 1.0, 0.5, 0.25, 0.1670, 0.1250, 0.1, 0.0833, 0.0714, 0.0625], dtype=torch.float64
    )
    start = torch.tensor([0.25, 0.39, 0.415, 0.39], dtype=torch.float64)

    def values(self, x: torch.Tensor) -> torch.Tensor:
        return self.y - x[0] * (self.u**2 + self.u * x[1]) / (self.u**2 + self.u * x[2] + x[3])

    def linearised(self, x: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
        return self.values(x), torch.autograd.functional.jacobian(self.values, x)


def random_least_squares(rows: int, columns: int, *, consistent: bool, spread: float) -> LinearLeastSquares:
    """Singular values from 1 to 1/spread."""
    generator = torch.Generator().manual_seed(0)
    left, right = (
        torch.linalg.qr(torch.randn(n, columns, generator=generator, dtype=torch.float64)).Q
        for n in (rows, columns)
    )
    matrix = left * torch.logspace(0, -float(torch.tensor(spread).log10()), columns).double() @ right.T
    truth = torch.randn(columns, generator=generator, dtype=torch.float64)
    noise = torch.randn(rows, generator=generator, dtype=torch.float64)
    return LinearLeastSquares(matrix, matrix @ truth + (0 if consistent else 0.1) * noise)
