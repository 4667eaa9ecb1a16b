"""Elastic energy of a finite-basis network, with its gradient and Hessian in the output layer.

Source of stress and tangent: J. Bonet, R. D. Wood, Nonlinear Continuum Mechanics for Finite Element Analysis,
2nd ed., sections 6.4.3 (neo-Hookean, with d(F^-T) = -F^-T dF^T F^-T) and 6.4.1 (St Venant-Kirchhoff).
"""

from dataclasses import dataclass
from dataclasses import field as dataclass_field
from typing import NamedTuple

import numpy as np
import torch
from scipy.sparse import csr_matrix

from geometry.arrays import FloatArray, IntArray
from solvers.elasticity import Lame, LawName, deformation_jacobian, energy_density_of
from solvers.pinn.finite_basis.network import FiniteBasis, FiniteBasisField
from solvers.pinn.finite_basis.sparse_cholesky import BlockMatrix
from solvers.pinn.threading import boxes_around, imap_in_threads
from solvers.problem import Material

KEPT = 2**30
"""Most bytes of basis gradients that an energy of finite strain keeps for its next evaluation.

The two levels of `pinn-std` on the default finger have 0.12 and 0.4 GB of them. Above the limit they are
computed anew for every evaluation.
"""


class QuadraturePatch(NamedTuple):
    """A few neighbouring quadrature points.

    Attributes:
        points: Shape (p, 2), mm.
        near: Numbers of the windows that reach them, (w,).
        pairs: Numbers of the blocks of all pairs of these windows, (w w,); see `NetworkEnergy`.
        rows: Of the points among those of all patches.
    """

    points: torch.Tensor
    near: torch.Tensor
    pairs: torch.Tensor
    rows: slice


@dataclass(frozen=True, eq=False)
class NetworkEnergy:
    """Integral of the energy density over the body, by patches of quadrature points.

    Every patch adds a small dense Hessian of the output weights that reach it. With the derivatives Z_x and
    Z_y of the basis functions and the tangent A, the block of the components i and k is the sum over j and l
    of Z_j^T w A_ijkl Z_l; one matrix product gives all blocks. Those of the windows (a, b) have the number of
    the pair's row and column if a <= b, else that of (b, a) plus the number of rows.

    Attributes:
        basis: The basis functions.
        material: The elastic law.
        patches: The quadrature points; all arrays by points have the patches' order.
        weights: Of the points, shape (q,), mm^2.
        rows: First window of every pair that a patch has, shape (b,).
        columns: Second window, not before the first, shape (b,).
        origin: Displacement of zero energy; None for zero.
        kept: Basis gradients of the patches met so far, by their numbers; None if they are not kept.
    """

    basis: FiniteBasis
    material: Material
    patches: list[QuadraturePatch]
    weights: torch.Tensor
    rows: IntArray
    columns: IntArray
    origin: FiniteBasisField | None = None
    kept: dict[int, torch.Tensor] | None = dataclass_field(default=None, repr=False)

    @classmethod
    def of(
        cls, basis: FiniteBasis, material: Material, points: FloatArray, weights: FloatArray
    ) -> "NetworkEnergy":
        """The energy by a quadrature rule: points (q, 2), mm, and weights (q,), mm^2."""
        cuts, keys, count = basis.patches(points), [], basis.windows.count
        for _, _, near in cuts:
            keys.append((torch.minimum(near, near[:, None]) * count + near.maximum(near[:, None])).flatten())
        diagonal = torch.arange(count) * (count + 1)
        known, number = torch.unique(torch.cat([*keys, diagonal]), return_inverse=True)
        patches, used, start = [], 0, 0
        for (_, places, near), pairs in zip(
            cuts, number[:-count].split([len(key) for key in keys]), strict=True
        ):
            below = torch.ones(len(near), len(near), dtype=torch.int64).tril_(-1).flatten()
            rows = slice(start, start + len(places))
            patches.append(QuadraturePatch(places, near, pairs + len(known) * below, rows))
            start = rows.stop
            used += 16 * len(places) * len(near) * basis.per_window
        order = np.concatenate([numbers for numbers, *_ in cuts])
        keep = material.law != "linear" and used <= KEPT
        return cls(
            basis=basis,
            material=material,
            patches=patches,
            weights=torch.from_numpy(weights[order]),
            rows=known.numpy() // count,
            columns=known.numpy() % count,
            kept={} if keep else None,
        )

    @property
    def points(self) -> int:
        """Number of quadrature points, q."""
        return len(self.weights)

    def total(self, output: torch.Tensor) -> float:
        """The energy per depth of an output layer (c, 2, m + 1), N mm / mm."""
        gradient = self.gradients(output[None])[0]
        return float(self.weights @ energy_density(gradient, self.material.lame, self.material.law))

    def derivatives(self, output: torch.Tensor) -> tuple[torch.Tensor, BlockMatrix]:
        """Gradient and Hessian of the energy at an output layer (c, 2, m + 1).

        Returns:
            The gradient, of the shape of `output`, N/mm, and the Hessian, N/mm^2.
        """
        gradient = self.gradients(output[None])[0]
        stress, tangent = piola_stress_and_tangent(gradient, self.material.lame, self.material.law)
        return self.forces(stress[None])[0], self.hessian(tangent)

    def gradients(self, outputs: torch.Tensor) -> torch.Tensor:
        """Gradients less the origin's at the points, (s, q, 2, 2), of output layers (s, c, 2, m + 1)."""
        found = outputs.new_zeros(len(outputs), self.points, 2, 2)
        if outputs.any():
            layers = outputs.permute(1, 3, 0, 2).contiguous()

            def task(number: int) -> tuple[slice, torch.Tensor]:
                patch, along = self.patches[number], self._along(number)
                here = along.flatten(2) @ layers[patch.near].flatten(0, 1).flatten(1)
                return patch.rows, here.view(2, len(patch.points), -1, 2).permute(2, 1, 3, 0)

            for rows, here in imap_in_threads(task, range(len(self.patches))):
                found[:, rows] = here
        return found if self.origin is None else found - self.gradients_of(self.origin)

    def gradients_of(self, field: FiniteBasisField) -> torch.Tensor:
        """Displacement gradients of another network at the points, shape (q, 2, 2)."""

        def task(patch: QuadraturePatch) -> torch.Tensor:
            (near,) = field.basis.windows.near(boxes_around([patch.points]))
            return field.gradient_of_patch(patch.points, near)

        return torch.cat(list(imap_in_threads(task, self.patches)))

    def forces(self, stresses: torch.Tensor) -> torch.Tensor:
        """Forces (s, c, 2, m + 1), N/mm, of Piola-Kirchhoff stresses P at the points, (s, q, 2, 2), MPa."""
        count = len(stresses)
        found = stresses.new_zeros(self.basis.windows.count, self.basis.per_window, count, 2)
        if stresses.any():
            weighted = (self.weights[:, None, None] * stresses).permute(3, 1, 0, 2).contiguous()

            def task(number: int) -> tuple[torch.Tensor, torch.Tensor]:
                patch, along = self.patches[number], self._along(number)
                here = along.flatten(2).flatten(0, 1).T @ weighted[:, patch.rows].flatten(0, 1).flatten(1)
                return patch.near, here.view(len(patch.near), -1, count, 2)

            for near, here in imap_in_threads(task, range(len(self.patches))):
                found.index_add_(0, near, here)
        return found.permute(2, 0, 3, 1).contiguous()

    def gradient_operator(self) -> csr_matrix:
        """The matrix from coefficients of the functions to gradients at the points, (2 q, c (m + 1)), 1/mm.

        Rows 2 n and 2 n + 1 are the derivatives by x and y at point n. For a few states at a time this was
        measured to be two to five times as fast as `gradients` and `forces`.
        """
        functions = np.arange(self.basis.per_window)

        def task(number: int) -> tuple[FloatArray, IntArray, IntArray]:
            patch = self.patches[number]
            along = self._along(number).flatten(2).transpose(0, 1).flatten(0, 1).numpy()
            row, column = np.nonzero(along)
            reached = (patch.near.numpy()[:, None] * self.basis.per_window + functions).ravel()
            return along[row, column], np.bincount(row, minlength=len(along)), reached[column]

        parts = imap_in_threads(task, range(len(self.patches)))
        values, counts, columns = (np.concatenate(part) for part in zip(*parts, strict=True))
        starts = np.concatenate([[0], np.cumsum(counts)])
        return csr_matrix((values, columns, starts), shape=(2 * self.points, self.basis.size))

    def hessian(self, tangent: torch.Tensor) -> BlockMatrix:
        """Second derivative by the output layer, N/mm^2, of a tangent at the points, (q, 2, 2, 2, 2), MPa."""
        count, functions = len(self.rows), self.basis.per_window
        blocks = tangent.new_zeros(2 * count, functions, 3, functions)
        weighted = self.weights[:, None, None, None, None] * tangent

        def task(number: int) -> tuple[torch.Tensor, torch.Tensor]:
            patch = self.patches[number]
            return patch.pairs, _blocks(self._along(number), weighted[patch.rows])

        for pairs, here in imap_in_threads(task, range(len(self.patches))):
            blocks.index_add_(0, pairs, here)
        upper, lower = blocks.split(count)
        diagonal = torch.from_numpy(self.rows == self.columns)
        lower[diagonal] = upper[diagonal]
        whole = tangent.new_empty(count, 2, functions, 2, functions)
        whole[:, 0, :, 0], whole[:, 0, :, 1], whole[:, 1, :, 1] = upper.unbind(2)
        whole[:, 1, :, 0] = lower[:, :, 1].mT
        # Windows that reach one patch need not overlap; one that reaches none keeps its empty diagonal.
        filled = (whole.abs().amax(dim=(1, 2, 3, 4)) > 0) | diagonal
        parts = (self.rows[filled], self.columns[filled], whole[filled].flatten(1, 2).flatten(2).numpy())
        return BlockMatrix(self.basis.windows.count, *parts)

    def _along(self, number: int) -> torch.Tensor:
        """Derivatives of the basis functions that reach a patch, at its points: (2, p, w, m + 1), 1/mm."""
        patch = self.patches[number]
        if self.kept is None:
            return self.basis.gradients(patch.points, patch.near)
        if number not in self.kept:
            self.kept[number] = self.basis.gradients(patch.points, patch.near)
        return self.kept[number]


def _blocks(along: torch.Tensor, tangent: torch.Tensor) -> torch.Tensor:
    """Blocks of all pairs of windows, (w w, m + 1, 3, m + 1), N/mm^2: of the components uu, uv and vv.

    NumPy's matrix product was measured to take 0.6 of the time of torch's on AMD's processors.

    Args:
        along: Derivatives of the basis functions, shape (2, p, w, m + 1), 1/mm.
        tangent: Weights times the tangent, shape (p, 2, 2, 2, 2), N.
    """
    _, points, windows, functions = along.shape
    right = along.new_empty(2, points, windows, 3, functions)
    for part, (i, k) in enumerate(((0, 0), (0, 1), (1, 1))):
        for j in range(2):
            torch.mul(tangent[:, i, j, k, 0, None, None], along[0], out=right[j, :, :, part])
            right[j, :, :, part].addcmul_(tangent[:, i, j, k, 1, None, None], along[1])
    left = along.flatten(2).flatten(0, 1).numpy().T
    product = torch.from_numpy(left @ right.flatten(0, 1).flatten(1).numpy())
    return product.view(windows, functions, windows, 3, functions).transpose(1, 2).flatten(0, 1)


def energy_density(gradient: torch.Tensor, lame: Lame, law: LawName) -> torch.Tensor:
    """ψ of a law at displacement gradients (n, 2, 2): (n,), MPa."""
    return torch.as_tensor(energy_density_of(law, gradient, lame, torch.log))


def piola_stress_and_tangent(
    gradient: torch.Tensor, lame: Lame, law: LawName
) -> tuple[torch.Tensor, torch.Tensor]:
    """P = dψ/dH and A = dP/dH of the laws of `solvers.elasticity`.

    With G = F^-T, the neo-Hookean law has P = μ (F - G) + λ ln(J) G and

        A_ijkl = μ δ_ik δ_jl + (μ - λ ln J) G_il G_kj + λ G_ij G_kl

    The St Venant-Kirchhoff law has P = F S with S = λ tr(E) I + 2 μ E and

        A_ijkl = δ_ik S_jl + λ F_ij F_kl + μ ((F F^T)_ik δ_jl + F_il F_kj)

    Hooke's law has their tangent at H = 0, whatever H.

    Args:
        gradient: H[n, i, j] = du_i/dx_j, shape (n, 2, 2).
        lame: Lamé constants of the plane law, MPa.
        law: The law.

    Returns:
        P, shape (n, 2, 2), MPa, not a number where a finite deformation turns the material inside out, and
        A, shape (n, 2, 2, 2, 2), MPa.
    """
    λ, μ = lame.λ, lame.μ
    one = torch.eye(2, dtype=gradient.dtype)
    if law == "linear":
        first, second = torch.einsum("ik,jl->ijkl", one, one), torch.einsum("il,kj->ijkl", one, one)
        tangent = λ * torch.einsum("ij,kl->ijkl", one, one) + μ * (first + second)
        return torch.einsum("ijkl,nkl->nij", tangent, gradient), tangent.expand(len(gradient), 2, 2, 2, 2)
    deformation, jacobian = one + gradient, deformation_jacobian(gradient)[:, None, None]
    if law == "st-venant-kirchhoff":
        strain = 0.5 * (deformation.mT @ deformation - one)
        trace = strain.diagonal(dim1=1, dim2=2).sum(dim=1)[:, None, None]
        second_piola = λ * trace * one + 2 * μ * strain
        tangent = (
            torch.einsum("ik,njl->nijkl", one, second_piola)
            + λ * torch.einsum("nij,nkl->nijkl", deformation, deformation)
            + μ * torch.einsum("nik,jl->nijkl", deformation @ deformation.mT, one)
            + μ * torch.einsum("nil,nkj->nijkl", deformation, deformation)
        )
        return (deformation @ second_piola).where(jacobian > 0, torch.nan), tangent
    pressure = λ * jacobian.log()
    inverse = deformation.flip(1, 2) * torch.tensor([[1.0, -1.0], [-1.0, 1.0]]).to(gradient) / jacobian
    tangent = (
        μ * torch.einsum("ik,jl->ijkl", one, one)
        + torch.einsum("nil,nkj->nijkl", (μ - pressure) * inverse, inverse)
        + λ * torch.einsum("nij,nkl->nijkl", inverse, inverse)
    )
    return μ * (deformation - inverse) + pressure * inverse, tangent
