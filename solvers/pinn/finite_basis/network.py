"""A finite-basis network: basis functions in overlapping windows that sum to one.

Every window has m + 1 basis functions: a constant, and m neurons tanh(X w + b) of the input X = (x, y). Since
the windows are a partition of unity, the network reproduces constants, and approximates smooth functions as
its neurons do within a window. After B. Moseley, A. Markham and T. Nissen-Meyer, Finite basis
physics-informed neural networks, Adv. Comput. Math. 49 (2023).
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar, Literal

import numpy as np
import torch

from pinnray.geometry.mesh.point_location import LocatedPoints
from pinnray.runtime.arrays import FloatArray, IntArray
from pinnray.solvers.pinn.finite_basis.hard_constraint import HardConstraint
from pinnray.solvers.pinn.finite_basis.windows import GateTree, ShepardWindows
from pinnray.solvers.pinn.threading import PATCH, SUMMED, boxes_around, cut_into_patches, imap_in_threads

Windows = ShepardWindows | GateTree
Functions = Callable[[torch.Tensor, torch.Tensor], torch.Tensor]
"""Of points, shape (n, 2), mm, and numbers of windows."""
"""A partition of unity by windows."""


@dataclass(frozen=True, eq=False)
class FiniteBasis:
    """Basis functions of c windows."""

    windows: Windows  # The windows
    neurons: torch.Tensor  # Weights of x and y, 1/mm, and bias of the neurons, shape (3, m, c)
    constraint: HardConstraint  # The hard constraint on the base

    @property
    def per_window(self) -> int:
        """Number of basis functions in a window, m + 1."""
        return self.neurons.shape[1] + 1

    @property
    def size(self) -> int:
        """Number of basis functions, c (m + 1)."""
        return self.windows.count * self.per_window

    @classmethod
    def around(
        cls,
        windows: Windows,
        centres: FloatArray,
        steepness: FloatArray,
        *,
        neurons: int,
        constraint: HardConstraint,
        rng: np.random.Generator,
    ) -> "FiniteBasis":
        """Neurons near every centre, in directions spread over the half circle, turned and shifted at random.

        Args:
            windows: The windows.
            centres: Of the windows, shape (c, 2), mm.
            steepness: Of their neurons, shape (c,), 1/mm.
            neurons: Neurons in a window, m.
            constraint: The hard constraint.
            rng: Draws turns and shifts.
        """
        shape = (neurons, len(centres))
        angle = rng.uniform(0, np.pi, shape[1]) + np.pi * np.arange(neurons)[:, None] / neurons
        angle += rng.uniform(-0.2, 0.2, shape)
        weights = steepness * np.stack([np.cos(angle), np.sin(angle)])
        bias = rng.uniform(-1, 1, shape) - np.einsum("xmc,cx->mc", weights, centres)
        return cls(windows, torch.from_numpy(np.concatenate([weights, bias[None]])), constraint)

    def patches(
        self, points: FloatArray, most: int = PATCH
    ) -> list[tuple[IntArray, torch.Tensor, torch.Tensor]]:
        """Patches of points (n, 2), mm: their numbers, their places and the windows that reach them."""
        numbers = cut_into_patches(points, most)
        places = [torch.from_numpy(points[patch]) for patch in numbers]
        return list(zip(numbers, places, self.windows.near(boxes_around(places)), strict=True))

    def values(self, points: torch.Tensor, near: torch.Tensor) -> torch.Tensor:
        """Basis functions of windows `near` (w,) at points (n, 2), mm: (n, m + 1, w)."""
        window = self.windows.values(points, near).mul_(self.constraint.at(points)[0])
        return self._unwindowed(points, near).mul_(window[:, None])

    def gradients(self, points: torch.Tensor, near: torch.Tensor) -> torch.Tensor:
        """Derivatives of `values` with respect to x and y, 1/mm, by windows: (2, n, w, m + 1)."""
        window, window_gradient = self.constrained_windows(points, near)
        function = self._unwindowed(points, near)
        rate = (1 - function[:, 1:].square()).mul_(window[:, None])
        found = function * window_gradient[:, :, None]
        for axis in range(2):
            found[axis, :, 1:].addcmul_(rate, self.neurons[axis, :, near])
        return found.transpose(2, 3).contiguous()

    def constrained_windows(
        self, points: torch.Tensor, near: torch.Tensor
    ) -> tuple[torch.Tensor, torch.Tensor]:
        """Windows times the constraint's factor, (n, w), and their derivatives, (2, n, w), 1/mm."""
        window, along = self.windows.values_and_gradients(points, near)
        factor, *slopes = self.constraint.at(points)
        along = along.mul_(factor)
        for part, slope in zip(along, slopes, strict=True):
            part.addcmul_(slope, window)
        return window.mul_(factor), along

    def functionals(self, points: FloatArray, weights: FloatArray) -> FloatArray:
        """Sums of weights (k, n) times the basis functions at points (n, 2), mm: (k, c, m + 1)."""
        return self._weighted(self.values, "kn,nuw->kwu", points, weights)

    def gradient_functionals(self, points: FloatArray, weights: FloatArray) -> FloatArray:
        """Sums of weights (k, n, 2) times the functions' derivatives at points (n, 2), mm: (k, c, m + 1)."""
        return self._weighted(self.gradients, "knx,xnwu->kwu", points, weights)

    def _weighted(
        self, functions: Functions, sums: str, points: FloatArray, weights: FloatArray
    ) -> FloatArray:
        found = torch.zeros(len(weights), self.windows.count, self.per_window, dtype=torch.float64)
        for patch, place, near in self.patches(points):
            of_patch = torch.from_numpy(weights[:, patch])
            found.index_add_(1, near, torch.einsum(sums, of_patch, functions(place, near)))
        return np.asarray(found)

    def slopes_of_values(self, points: FloatArray, weights: FloatArray, output: torch.Tensor) -> torch.Tensor:
        """Derivatives by the neurons, (3, m, c), of the sum of weights (n, 2) times the displacement.

        Args:
            points: Shape (n, 2), mm.
            weights: Of the displacement's components there.
            output: The output layer, shape (c, 2, m + 1), mm.
        """
        found = torch.zeros_like(self.neurons)
        for patch, place, near in self.patches(points):
            window = self.windows.values(place, near).mul_(self.constraint.at(place)[0])
            neuron = self._unwindowed(place, near)[:, 1:]
            here = torch.einsum("ni,wim->nmw", torch.from_numpy(weights[patch]), output[near, :, 1:])
            here.mul_(1 - neuron.square()).mul_(window[:, None])
            found.index_add_(2, near, torch.einsum("nmw,nx->xmw", here, with_one(place)))
        return found

    def slopes_of_gradients(
        self, points: torch.Tensor, near: torch.Tensor, weights: torch.Tensor, output: torch.Tensor
    ) -> torch.Tensor:
        """Derivatives by the neurons `near` of the sum of weights times the displacement gradient.

        With t = w·x + b, N = tanh t and the window g, a neuron adds c_i (N ∂g/∂x_j + g (1 - N²) w_j) to
        ∂u_i/∂x_j.

        Args:
            points: Shape (n, 2), mm.
            near: Numbers of the windows that reach them, shape (w,).
            weights: Of the components of the gradient, shape (n, 2, 2).
            output: The output layer of these windows, shape (w, 2, m + 1), mm.

        Returns:
            Shape (3, m, w).
        """
        window, along = self.constrained_windows(points, near)
        neuron = self._unwindowed(points, near)[:, 1:]
        rate = 1 - neuron.square()
        pulled = torch.einsum("nij,wim->jnmw", weights, output[:, :, 1:])
        steep = (pulled * self.neurons[:2, None, :, near]).sum(dim=0)
        rate_in_window = rate * window[:, None]
        by_argument = rate * (pulled * along[:, :, None]).sum(dim=0) - 2 * neuron * rate_in_window * steep
        found = torch.einsum("nmw,nx->xmw", by_argument, with_one(points))
        found[:2] += (pulled * rate_in_window).sum(dim=1)
        return found

    def summed(
        self, functions: Functions, sums: str, outputs: torch.Tensor, points: FloatArray
    ) -> FloatArray:
        """Sums of basis functions times output layers at points (n, 2), mm: shape (n, ...).

        Args:
            functions: `values` or `gradients`, taken at a few points and the windows near them at a time.
            sums: Of both, as for `einsum`; the windows are the third axis from the last of the outputs.
            outputs: Output layers, shape (..., c, 2, m + 1), mm.
            points: Shape (n, 2), mm.
        """

        def task(patch: tuple[IntArray, torch.Tensor, torch.Tensor]) -> FloatArray:
            _, places, near = patch
            return torch.einsum(sums, functions(places, near), outputs[..., near, :, :]).numpy()

        patches = self.patches(points, SUMMED)
        found: FloatArray = np.concatenate(list(imap_in_threads(task, patches)))
        result: FloatArray = np.empty_like(found)
        result[np.concatenate([patch for patch, *_ in patches])] = found
        return result

    def _unwindowed(self, points: torch.Tensor, near: torch.Tensor) -> torch.Tensor:
        """One and the neurons without window and constraint, (n, m + 1, w)."""
        function = points.new_ones(len(points), self.per_window, len(near))
        weight_x, weight_y, bias = self.neurons[:, :, near]
        hidden = torch.addcmul(bias, points[:, :1, None], weight_x, out=function[:, 1:])
        hidden.addcmul_(points[:, 1:, None], weight_y)
        # tanh(t) = 2 σ(2 t) - 1: torch's logistic function was measured to be ten times as fast as its tanh.
        hidden.mul_(2).sigmoid_().mul_(2).sub_(1)
        return function


def with_one(points: torch.Tensor) -> torch.Tensor:
    """Points (n, 2) and one, by which a bias is multiplied, (n, 3)."""
    return torch.cat([points, torch.ones_like(points[:, :1])], dim=1)


@dataclass(frozen=True, eq=False)
class FiniteBasisField:
    """Displacement field of a finite-basis network."""

    basis: FiniteBasis  # The basis functions
    # Output layer, shape (c, 2, m + 1): for every window, component and basis function, mm
    output: torch.Tensor
    smooth: ClassVar[Literal[True]] = True

    def displacement(self, location: LocatedPoints) -> FloatArray:
        """Displacement, shape (n, 2), mm."""
        return self.basis.summed(self.basis.values, "nuw,wiu->ni", self.output, location.points)

    def gradient(self, location: LocatedPoints) -> FloatArray:
        """Displacement gradient du_i/dx_j, shape (n, 2, 2)."""
        return self.basis.summed(self.basis.gradients, "xnwu,wiu->nix", self.output, location.points)
