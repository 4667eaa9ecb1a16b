"""Elastic energy of a finite-basis network, with its gradient and Hessian in the output layer.

Source of stress and tangent: J. Bonet, R. D. Wood, Nonlinear Continuum Mechanics for Finite Element Analysis,
2nd ed., section 6.4.3; with d(F^-T) = -F^-T dF^T F^-T.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import torch

from geometry.arrays import FloatArray, IntArray
from solvers.elasticity import Lame, LawName, energy_density_of
from solvers.pinn.finite_basis.network import FiniteBasis, FiniteBasisField
from solvers.pinn.finite_basis.sparse_cholesky import BlockMatrix
from solvers.pinn.threading import boxes_around, imap_in_threads
from solvers.problem import Material


class QuadraturePatch(NamedTuple):
    """A few neighbouring quadrature points.

    Attributes:
        points: Shape (p, 2), mm.
        weights: Shape (p,), mm^2.
        near: Numbers of the windows that reach them, (w,).
        pairs: Block numbers in the matrix of these windows' pairs i <= j, (w (w + 1) / 2,).
    """

    points: torch.Tensor
    weights: torch.Tensor
    near: torch.Tensor
    pairs: torch.Tensor


@dataclass(frozen=True, eq=False)
class NetworkEnergy:
    """Integral of the energy density over the body, by patches of quadrature points.

    Every patch adds a small dense Hessian of the output weights that reach it. With the derivatives Z_x and
    Z_y of the basis functions and the tangent A, the block of the components i and k is the sum over j and l
    of Z_j^T w A_ijkl Z_l; one matrix product gives all blocks.

    Attributes:
        basis: The basis functions.
        material: The elastic law.
        patches: The quadrature.
        rows: First window of every pair that a patch has, shape (b,).
        columns: Second window, not before the first, shape (b,).
        origin: Displacement of zero energy; None for zero.
    """

    basis: FiniteBasis
    material: Material
    patches: list[QuadraturePatch]
    rows: IntArray
    columns: IntArray
    origin: FiniteBasisField | None = None

    @classmethod
    def of(
        cls, basis: FiniteBasis, material: Material, points: FloatArray, weights: FloatArray
    ) -> "NetworkEnergy":
        """The energy by a quadrature rule: points (q, 2), mm, and weights (q,), mm^2."""
        cuts, keys = basis.patches(points), []
        for _, _, windows in cuts:
            first, second = torch.triu_indices(len(windows), len(windows))
            keys.append(windows[first] * basis.windows.count + windows[second])
        count = basis.windows.count
        diagonal = torch.arange(count) * (count + 1)
        known, number = torch.unique(torch.cat([*keys, diagonal]), return_inverse=True)
        pairs = number[:-count].split([len(key) for key in keys])
        patches = [
            QuadraturePatch(places, torch.from_numpy(weights[cut]), near, blocks)
            for (cut, places, near), blocks in zip(cuts, pairs, strict=True)
        ]
        rows, columns = np.divmod(known.numpy(), count)
        return cls(basis, material, patches, rows, columns)

    @property
    def points(self) -> int:
        """Number of quadrature points."""
        return sum(len(patch.points) for patch in self.patches)

    def total(self, output: torch.Tensor) -> float:
        """The energy per depth of an output layer (c, 2, m + 1), N mm / mm."""
        field = FiniteBasisField(self.basis, output)

        def task(patch: QuadraturePatch) -> float:
            density = energy_density(
                field.gradient_of_patch(patch.points, patch.near), self.material.lame, self.material.law
            )
            return float(patch.weights @ density)

        return sum(imap_in_threads(task, self.patches))

    def derivatives(self, output: torch.Tensor) -> tuple[torch.Tensor, BlockMatrix]:
        """Gradient and Hessian of the energy at an output layer (c, 2, m + 1).

        Returns:
            The gradient, of the shape of `output`, N/mm, and the Hessian, N/mm^2.
        """
        size = 2 * self.basis.per_window
        blocks = output.new_zeros(len(self.rows), size, size)
        first = torch.zeros_like(output)

        def task(patch: QuadraturePatch) -> tuple[QuadraturePatch, torch.Tensor, torch.Tensor]:
            return patch, *self._of_patch(patch, output[patch.near])

        for patch, gradient, curvature in imap_in_threads(task, self.patches):
            first.index_add_(0, patch.near, gradient)
            blocks.index_add_(0, patch.pairs, curvature)
        # Windows that reach one patch need not overlap; one that reaches none keeps its empty diagonal.
        filled = (blocks.abs().amax(dim=(1, 2)).numpy() > 0) | (self.rows == self.columns)
        parts = (self.rows[filled], self.columns[filled], blocks.numpy()[filled])
        return first, BlockMatrix(self.basis.windows.count, *parts)

    def _of_patch(self, patch: QuadraturePatch, output: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
        """Contribution of a patch to the gradient, (w, 2, m + 1), and to the blocks of its pairs."""
        along = self.basis.gradients(patch.points, patch.near)
        windows, functions = along.shape[2:]
        gradient = torch.einsum("xnwu,wiu->nix", along, output)
        if self.origin is not None:
            (near,) = self.origin.basis.windows.near(boxes_around([patch.points]))
            gradient -= self.origin.gradient_of_patch(patch.points, near)
        stress, tangent = piola_stress_and_tangent(gradient, self.material.lame, self.material.law)
        first = torch.einsum("xnwu,nix->wiu", along, patch.weights[:, None, None] * stress)
        weighted = patch.weights[:, None, None, None, None] * tangent
        flat = along.flatten(2)
        right = flat.new_empty(2, len(patch.points), 3, windows * functions)
        for part, (i, k) in enumerate(((0, 0), (0, 1), (1, 1))):
            for j in range(2):
                torch.mul(weighted[:, i, j, k, 0, None], flat[0], out=right[j, :, part])
                right[j, :, part].addcmul_(weighted[:, i, j, k, 1, None], flat[1])
        product = flat.flatten(0, 1).T @ right.flatten(0, 1).flatten(1)
        uu, uv, vv = product.view(windows, functions, 3, windows, functions).unbind(2)
        above, below = torch.triu_indices(windows, windows)
        blocks = product.new_empty(len(above), 2, functions, 2, functions)
        blocks[:, 0, :, 0] = uu[above, :, below]
        blocks[:, 0, :, 1] = uv[above, :, below]
        blocks[:, 1, :, 0] = uv[below, :, above].mT
        blocks[:, 1, :, 1] = vv[above, :, below]
        return first, blocks.view(len(above), 2 * functions, 2 * functions)


def energy_density(gradient: torch.Tensor, lame: Lame, law: LawName) -> torch.Tensor:
    """ψ of a law at displacement gradients (n, 2, 2): (n,), MPa."""
    return torch.as_tensor(energy_density_of(law, gradient, lame, torch.log))


def piola_stress_and_tangent(
    gradient: torch.Tensor, lame: Lame, law: LawName
) -> tuple[torch.Tensor, torch.Tensor]:
    """P = dψ/dH and A = dP/dH of the laws of `solvers.elasticity`.

    With G = F^-T, the neo-Hookean law has P = μ (F - G) + λ ln(J) G and

        A_ijkl = μ δ_ik δ_jl + (μ - λ ln J) G_il G_kj + λ G_ij G_kl

    Hooke's law has the same tangent at H = 0, whatever H.

    Args:
        gradient: H[n, i, j] = du_i/dx_j, shape (n, 2, 2), with det(I + H) > 0 for the law "neo-hookean".
        lame: Lamé constants of the plane law, MPa.
        law: "linear" or "neo-hookean".

    Returns:
        P, shape (n, 2, 2), and A, shape (n, 2, 2, 2, 2), MPa.
    """
    λ, μ = lame.λ, lame.μ
    one = torch.eye(2, dtype=gradient.dtype)
    linear = law == "linear"
    deformation = one + (torch.zeros_like(gradient) if linear else gradient)
    log_j = torch.linalg.det(deformation).log()[:, None, None]
    inverse = torch.linalg.inv(deformation).mT
    pressure = λ * log_j
    tangent = (
        μ * torch.einsum("ik,jl->ijkl", one, one)
        + torch.einsum("nil,nkj->nijkl", (μ - pressure) * inverse, inverse)
        + λ * torch.einsum("nij,nkl->nijkl", inverse, inverse)
    )
    if linear:
        return torch.einsum("nijkl,nkl->nij", tangent, gradient), tangent
    return μ * (deformation - inverse) + pressure * inverse, tangent
