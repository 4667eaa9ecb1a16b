"""The elastic energy as a quadratic form of the output layer, and its exact minimiser."""

from typing import NamedTuple

import torch

from geometry.errors import UserError
from solvers.elasticity import Lame


class Minimum(NamedTuple):
    """The output layer of least energy that satisfies the load.

    Attributes:
        output: Weights, shape (U, 2), mm.
        energy: Elastic energy per depth, N mm / mm.
        forces: Lagrange multipliers of the load's functionals: its force per depth, shape (k,), N/mm.
        regularisation: What was added to the diagonal, relative to its mean.
    """

    output: torch.Tensor
    energy: float
    forces: torch.Tensor
    regularisation: float


def stiffness_blocks(
    xx: torch.Tensor, yy: torch.Tensor, xy: torch.Tensor, lame: Lame
) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor]:
    """Hessian of the elastic energy over output weights that both displacement components have for each unit.

    With weighted derivatives X = sqrt(w) d/dx and Y = sqrt(w) d/dy of U units at the quadrature points,

        K_uu = (λ + 2 μ) X^T X + μ Y^T Y    K_uv = λ X^T Y + μ Y^T X    K_vv = (λ + 2 μ) Y^T Y + μ X^T X

    Args:
        xx: X^T X, shape (U, U).
        yy: Y^T Y.
        xy: X^T Y.
        lame: Lamé constants of the plane law, MPa.

    Returns:
        The blocks K_uu, K_uv and K_vv, each (U, U).
    """
    stiff, λ, μ = lame.λ + 2 * lame.μ, lame.λ, lame.μ
    return stiff * xx + μ * yy, λ * xy + μ * xy.T, stiff * yy + μ * xx


class QuadraticEnergy:
    """U(c) = 1/2 c^T K c over the output weights c of units that both displacement components share.

    K is made of products of the units' weighted derivatives (`stiffness_blocks`). Units can be added; the
    products of those that are there already are kept.
    """

    def __init__(self, weights: torch.Tensor, lame: Lame) -> None:
        self._root = weights.sqrt()[:, None]
        self._lame = lame
        self._x: list[torch.Tensor] = []
        self._y: list[torch.Tensor] = []
        self._xx = self._yy = self._xy = weights.new_empty(0, 0)

    def add(self, derivative_x: torch.Tensor, derivative_y: torch.Tensor) -> None:
        """Add units by their derivatives at the quadrature points, each (q, U_new), which are overwritten."""
        x, y = derivative_x.mul_(self._root), derivative_y.mul_(self._root)
        self._x.append(x)
        self._y.append(y)
        xx, yy = (torch.cat([block.T @ blocks[-1] for block in blocks]) for blocks in (self._x, self._y))
        upper = torch.cat([block.T @ y for block in self._x])
        left = [x.T @ block for block in self._y[:-1]]
        old = len(self._xx)
        self._xx = _bordered(self._xx, xx, xx[:old].T)
        self._yy = _bordered(self._yy, yy, yy[:old].T)
        self._xy = _bordered(self._xy, upper, torch.cat(left, dim=1) if left else x.new_empty(x.shape[1], 0))

    def gradient(self, output: torch.Tensor) -> torch.Tensor:
        """Displacement gradient at the quadrature points for an output layer (U, 2), shape (q, 2, 2)."""
        parts = output.split([block.shape[1] for block in self._x])
        along = [
            sum(block @ part for block, part in zip(blocks, parts, strict=True)) / self._root
            for blocks in (self._x, self._y)
        ]
        return torch.stack(along, dim=-1)

    def minimise(self, functionals: torch.Tensor, axes: list[int], prescribed: torch.Tensor) -> Minimum:
        """Least energy subject to linear conditions on the displacement.

        Args:
            functionals: The load's functional on every unit, shape (U,).
            axes: Which displacement components it prescribes.
            prescribed: Their values, shape (k,), mm.
        """
        count = len(functionals)
        uu, uv, vv = stiffness_blocks(self._xx, self._yy, self._xy, self._lame)
        matrix = torch.cat([torch.cat([uu, uv], dim=1), torch.cat([uv.T, vv], dim=1)])
        scale = matrix.diagonal().rsqrt()
        matrix = matrix * scale * scale[:, None]
        factor, regularisation = _regularised_cholesky(matrix)
        right = torch.zeros(2 * count, len(axes), dtype=matrix.dtype)
        for column, axis in enumerate(axes):
            right[axis * count : (axis + 1) * count, column] = functionals
        right = right * scale[:, None]
        responses = torch.cholesky_solve(right, factor)
        forces = torch.linalg.solve(right.T @ responses, prescribed)
        scaled = responses @ forces
        energy = 0.5 * float(scaled @ (matrix @ scaled))
        return Minimum((scale * scaled).reshape(2, count).T.contiguous(), energy, forces, regularisation)


def _bordered(old: torch.Tensor, right: torch.Tensor, left: torch.Tensor) -> torch.Tensor:
    """The matrix `old` with new columns `right`, which reach below it, and the rows `left` under it."""
    return torch.cat([torch.cat([old, left]), right], dim=1)


def _regularised_cholesky(matrix: torch.Tensor) -> tuple[torch.Tensor, float]:
    """Cholesky factor of a matrix with unit diagonal, plus the least power of ten that makes it definite."""
    for exponent in range(-14, -5):
        shifted = matrix + 10.0**exponent * torch.eye(len(matrix), dtype=matrix.dtype)
        factor, failed = torch.linalg.cholesky_ex(shifted)
        if not int(failed):
            return factor, 10.0**exponent
    raise UserError("the network's units are linearly dependent; take fewer of them or another seed")
