"""Elastic energy of a finite-basis network, with its gradient and Hessian in the output layer."""

from dataclasses import dataclass
from functools import cached_property
from itertools import product
from typing import NamedTuple

import numpy as np
import torch
from numpy.typing import NDArray
from scipy.sparse import csr_matrix

from pinnray.runtime.arrays import FloatArray, IntArray
from pinnray.solvers.elasticity import Lame, LawName, energy_density_of, piola_stress_and_tangent
from pinnray.solvers.pinn.finite_basis.network import FiniteBasis, FiniteBasisField
from pinnray.solvers.pinn.threading import boxes_around, imap_in_threads
from pinnray.solvers.problem import Material
from pinnray.solvers.symmetric_factors import BlockMatrix, Factors

REGULARISATION = 1e-12
"""Added to the unit diagonal of the scaled Hessian, against nearly dependent basis functions."""

LAWS: tuple[LawName, ...] = ("linear", "neo-hookean", "st-venant-kirchhoff")
"""Those of `pinnray.solvers.elasticity` that have a tangent here."""

TOGETHER = 12
"""Windows whose products are one product of matrices."""

CHUNK = 1024
"""Blocks that are turned into a tangent's at a time, which stay in a cache."""


class QuadraturePatch(NamedTuple):
    """A few neighbouring quadrature points."""

    points: torch.Tensor  # Shape (p, 2), mm
    near: torch.Tensor  # Numbers of the windows that reach them, ascending, (w,)
    pairs: torch.Tensor  # Numbers of the blocks of the pairs (a, b) of these windows with a <= b, row by row
    rows: slice  # Of the points among those of all patches


@dataclass(frozen=True, eq=False)
class NetworkEnergy:
    """Integral of the energy density over the body, by patches of quadrature points.

    Every patch adds a small dense Hessian of the output weights that reach it. With the derivatives Z_x and
    Z_y of the basis functions and the tangent A, the block of the components i and k is the sum over j and l
    of Z_j^T w A_ijkl Z_l. Where A is the same everywhere it follows from the sums of Z_j^T w Z_l, which take
    half of the products. Of windows (b, a), whose block is the transpose of that of (a, b), there is one.
    """

    basis: FiniteBasis  # The basis functions
    material: Material  # The elastic law
    patches: list[QuadraturePatch]  # The quadrature points; all arrays by points have the patches' order
    weights: torch.Tensor  # Of the points, shape (q,), mm^2
    rows: IntArray  # First window of every pair that a patch has, shape (b,)
    columns: IntArray  # Second window, not before the first, shape (b,)

    @classmethod
    def of(
        cls, basis: FiniteBasis, material: Material, points: FloatArray, weights: FloatArray
    ) -> "NetworkEnergy":
        """The energy by a quadrature rule: points (q, 2), mm, and weights (q,), mm^2."""
        cuts, keys, count = basis.patches(points), [], basis.windows.count
        for _, _, near in cuts:
            row, column = torch.triu_indices(len(near), len(near))
            keys.append(near[row] * count + near[column])
        diagonal = torch.arange(count) * (count + 1)
        known, number = torch.unique(torch.cat([*keys, diagonal]), return_inverse=True)
        patches, start = [], 0
        uppers = number[:-count].split([len(key) for key in keys])
        for (_, places, near), upper in zip(cuts, uppers, strict=True):
            rows = slice(start, start + len(places))
            patches.append(QuadraturePatch(places, near, upper, rows))
            start = rows.stop
        order = np.concatenate([numbers for numbers, *_ in cuts])
        first, second = known.numpy() // count, known.numpy() % count
        return cls(basis, material, patches, torch.from_numpy(weights[order]), first, second)

    @property
    def places(self) -> FloatArray:
        """The quadrature points, shape (q, 2), mm."""
        return torch.cat([patch.points for patch in self.patches]).numpy()

    def total(self, output: torch.Tensor) -> float:
        """The energy per depth of an output layer (c, 2, m + 1), N mm / mm."""
        return self._total(self.gradients(output[None])[0])

    def derivatives(self, output: torch.Tensor) -> tuple[torch.Tensor, BlockMatrix]:
        """Gradient and Hessian of the energy at an output layer (c, 2, m + 1).

        Returns:
            The gradient, of the shape of `output`, N/mm, and the Hessian, N/mm^2.
        """
        gradient = self.gradients(output[None])[0]
        stress, tangent = self._stress_and_tangent(gradient)
        return self.forces(stress[None])[0], self.hessian(tangent[:1] if self.quadratic else tangent)

    def gradient(self, output: torch.Tensor) -> torch.Tensor:
        """The gradient alone, N/mm: a twentieth of the time."""
        gradient = self.gradients(output[None])[0]
        stress, _ = self._stress_and_tangent(gradient)
        return self.forces(stress[None])[0]

    def _total(self, gradient: torch.Tensor) -> float:
        return float(self.weights @ energy_density(gradient, self.material.lame, self.material.law))

    def _stress_and_tangent(self, gradient: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
        return piola_stress_and_tangent(self.material.law, gradient, self.material.lame, torch)

    @property
    def quadratic(self) -> bool:
        """Whether the energy is a quadratic form of the output layer."""
        return self.material.law == "linear"

    @cached_property
    def factors_at_rest(self) -> Factors:
        """Factors of the Hessian of a quadratic energy, kept for every load and set of markers."""
        rest = torch.zeros(1, 2, 2, dtype=torch.float64)
        _, tangent = self._stress_and_tangent(rest)
        return self.hessian(tangent).factorised(REGULARISATION)

    def gradients(self, outputs: torch.Tensor) -> torch.Tensor:
        """Displacement gradients at the points, (s, q, 2, 2), of output layers (s, c, 2, m + 1)."""
        columns = outputs.permute(1, 3, 0, 2).reshape(-1, 2 * len(outputs)).numpy()
        found = torch.from_numpy(self.gradient_operator @ columns)
        return found.view(-1, 2, len(outputs), 2).permute(2, 0, 3, 1)

    def nearest(self, field: FiniteBasisField) -> tuple[torch.Tensor, Factors] | None:
        """The output layer nearest to another network by the tangent at its displacement, and that's factors.

        None if a point is turned inside out.
        """
        gradient = self._gradients_of(field)
        _, tangent = self._stress_and_tangent(gradient)
        if not torch.isfinite(tangent).all():
            return None
        forces = self.forces(torch.einsum("nijkl,nkl->nij", tangent, gradient)[None])[0]
        factors = self.hessian(tangent).factorised(REGULARISATION, definite=False)
        return torch.from_numpy(factors.solve(forces.numpy().reshape(1, -1))).view_as(forces), factors

    def _gradients_of(self, field: FiniteBasisField) -> torch.Tensor:
        """Displacement gradients of another network at the points, shape (q, 2, 2)."""
        basis, output = field.basis, field.output

        def task(patch: QuadraturePatch) -> torch.Tensor:
            (near,) = basis.windows.near(boxes_around([patch.points]))
            return torch.einsum("xnwu,wiu->nix", basis.gradients(patch.points, near), output[near])

        return torch.cat(list(imap_in_threads(task, self.patches)))

    def forces(self, stresses: torch.Tensor) -> torch.Tensor:
        """Forces (s, c, 2, m + 1), N/mm, of Piola-Kirchhoff stresses P at the points, (s, q, 2, 2), MPa."""
        weighted = (self.weights[:, None, None] * stresses).permute(1, 3, 0, 2)
        columns = weighted.reshape(2 * len(self.weights), -1).numpy()
        found = torch.from_numpy(self.gradient_operator.T @ columns)
        return found.view(-1, self.basis.per_window, len(stresses), 2).permute(2, 0, 3, 1).contiguous()

    def with_neuron_slopes(self, output: torch.Tensor) -> tuple[float, torch.Tensor]:
        """The energy of an output layer (c, 2, m + 1), and its derivatives by the neurons, (3, m, c)."""
        gradient = self.gradients(output[None])[0]
        stress, _ = self._stress_and_tangent(gradient)
        weighted = self.weights[:, None, None] * stress

        def task(patch: QuadraturePatch) -> tuple[torch.Tensor, torch.Tensor]:
            return patch.near, self.basis.slopes_of_gradients(
                patch.points, patch.near, weighted[patch.rows], output[patch.near]
            )

        found = torch.zeros_like(self.basis.neurons)
        for near, here in imap_in_threads(task, self.patches):
            found.index_add_(2, near, here)
        return self._total(gradient), found

    @cached_property
    def gradient_operator(self) -> csr_matrix:
        """The matrix from coefficients of the functions to gradients at the points, (2 q, c (m + 1)), 1/mm.

        Rows 2 n and 2 n + 1 are the derivatives by x and y at point n. Products with it were measured to be
        two to five times as fast as sums over the patches.
        """
        functions = np.arange(self.basis.per_window)

        def task(number: int) -> tuple[FloatArray, IntArray, NDArray[np.int32]]:
            patch = self.patches[number]
            along = self._along(number).flatten(2).transpose(0, 1).flatten(0, 1).numpy()
            row, column = np.nonzero(along)
            reached = patch.near.numpy()[:, None] * self.basis.per_window + functions
            columns = reached.ravel().astype(np.int32)[column]
            return along[row, column], np.bincount(row, minlength=len(along)), columns

        parts = imap_in_threads(task, range(len(self.patches)))
        values, counts, columns = (np.concatenate(part) for part in zip(*parts, strict=True))
        starts = np.concatenate([[0], np.cumsum(counts)]).astype(np.int32)
        return csr_matrix((values, columns, starts), shape=(2 * len(self.weights), self.basis.size))

    def hessian(self, tangent: torch.Tensor) -> BlockMatrix:
        """Second derivative by the output layer, N/mm^2.

        Args:
            tangent: At the quadrature points, shape (q, 2, 2, 2, 2), or of all of them, (1, 2, 2, 2, 2), MPa.
        """
        count, functions, constant = len(self.rows), self.basis.per_window, len(tangent) == 1
        sums = tangent.new_zeros(count, 4 * functions**2)
        weighted = self.weights[:, None, None, None, None] * (1 if constant else tangent)

        def task(number: int) -> tuple[torch.Tensor, torch.Tensor]:
            patch, along = self.patches[number], self._along(number)
            factors = (_products if constant else _tangent_products)(along, weighted[patch.rows])
            return patch.pairs, _blocks(*factors)

        for pairs, here in imap_in_threads(task, range(len(self.patches))):
            sums.index_add_(0, pairs, here)
        # Windows that reach one patch need not overlap; one that reaches none keeps its empty diagonal.
        filled = np.einsum("bn,bn->b", sums.numpy(), sums.numpy()) > 0
        filled |= self.rows == self.columns
        if not filled.all():
            sums = sums[torch.from_numpy(filled)]
        if constant:
            whole = _with_constant_tangent(tangent[0], sums.view(-1, 2, functions, 2, functions))
        else:
            whole = sums.view(-1, functions, 2, 2, functions).permute(0, 3, 4, 2, 1)
        blocks = whole.reshape(len(sums), 2 * functions, 2 * functions).numpy()
        return BlockMatrix(self.basis.windows.count, self.rows[filled], self.columns[filled], blocks)

    def _along(self, number: int) -> torch.Tensor:
        """Derivatives of the basis functions that reach a patch, at its points: (2, p, w, m + 1), 1/mm."""
        patch = self.patches[number]
        return self.basis.gradients(patch.points, patch.near)


def _products(along: torch.Tensor, weights: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
    """Factors (p, w, 2 (m + 1)) of which the windows' products have the sums of Z_j^T w Z_l, by j and l.

    Args:
        along: Derivatives of the basis functions, shape (2, p, w, m + 1), 1/mm.
        weights: Of the points, shape (p, 1, 1, 1, 1), mm^2.
    """
    factor = (along.permute(1, 2, 0, 3) * weights[..., 0].sqrt()).contiguous().flatten(2)
    return factor, factor


def _tangent_products(along: torch.Tensor, tangent: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
    """Factors (2 p, w, m + 1) and (2 p, w, 4 (m + 1)) with products Z_j^T w A_ijkl Z_l, by i and k.

    Args:
        along: Derivatives of the basis functions, shape (2, p, w, m + 1), 1/mm.
        tangent: Weights times the tangent, shape (p, 2, 2, 2, 2), N.
    """
    _, points, windows, functions = along.shape
    right = along.new_empty(2, points, windows, 4, functions)
    for j, i, k in product(range(2), repeat=3):
        part = right[j, :, :, 2 * i + k]
        torch.mul(tangent[:, i, j, k, 0, None, None], along[0], out=part)
        part.addcmul_(tangent[:, i, j, k, 1, None, None], along[1])
    return along.flatten(0, 1), right.flatten(0, 1).flatten(2)


def _blocks(left: torch.Tensor, right: torch.Tensor) -> torch.Tensor:
    """Products of the factors of windows (b, a) with a <= b, row by row: (w (w + 1) / 2, x y).

    NumPy's matrix product was measured to take 0.6 of the time of torch's on AMD's processors, and that of
    `TOGETHER` windows a 0.6 to 0.8 of the time of as many products of one.

    Args:
        left: Factors of the windows b, shape (n, w, x).
        right: Factors of the windows a, shape (n, w, y).
    """
    (_, windows, x), (_, _, y) = left.shape, right.shape
    rows, columns = left.flatten(1).numpy(), right.flatten(1).numpy()
    found: FloatArray = np.empty((windows * (windows + 1) // 2, x, y))
    start = 0
    for first in range(0, windows, TOGETHER):
        part = rows[:, x * first :].T @ columns[:, y * first : y * (first + TOGETHER)]
        part = part.reshape(windows - first, x, -1, y)
        for a in range(part.shape[2]):
            end = start + len(part) - a
            found[start:end] = part[a:, :, a]
            start = end
    return torch.from_numpy(found).flatten(1)


def _with_constant_tangent(tangent: torch.Tensor, sums: torch.Tensor) -> torch.Tensor:
    """Blocks of the components i and k, (b, i, f, k, g), from sums of Z_m^T w Z_j, (b, m, g, j, f)."""
    found = torch.zeros_like(sums)
    for here, part in zip(found.split(CHUNK), sums.split(CHUNK), strict=True):
        for i, j, k, m in tangent.nonzero().tolist():
            here[:, i, :, k].add_(part[:, m, :, j].mT, alpha=float(tangent[i, j, k, m]))
    return found


def energy_density(gradient: torch.Tensor, lame: Lame, law: LawName) -> torch.Tensor:
    """ψ of a law at displacement gradients (n, 2, 2): (n,), MPa."""
    return torch.as_tensor(energy_density_of(law, gradient, lame, torch.log))
