"""A finite-basis network: basis functions in overlapping windows that sum to one.

Every window has m + 1 basis functions: a constant, and m neurons tanh(X w + b) of the input X = (x, y). Since
the windows are a partition of unity, the network reproduces constants, and approximates smooth functions as
its neurons do within a window. After B. Moseley, A. Markham and T. Nissen-Meyer, Finite basis
physics-informed neural networks, Adv. Comput. Math. 49 (2023).
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import torch

from geometry.arrays import FloatArray
from geometry.mesh.point_location import LocatedPoints
from solvers.pinn.finite_basis.hard_constraint import BaseFactor
from solvers.pinn.finite_basis.patches import boxes_around, cut_into_patches
from solvers.pinn.finite_basis.windows import Windows
from solvers.pinn.threading import one_by_one


@dataclass(frozen=True, eq=False)
class LocalUnits:
    """Weights of the units in c windows.

    Attributes:
        windows: The windows.
        neurons: Slopes along x and y, 1/mm, and bias of the neurons, shape (3, m, c).
        factor: The hard condition on the base.
    """

    windows: Windows
    neurons: torch.Tensor
    factor: BaseFactor

    @property
    def per_window(self) -> int:
        """Number of units in a window, m + 1."""
        return self.neurons.shape[1] + 1

    @classmethod
    def around(
        cls,
        windows: Windows,
        centres: FloatArray,
        slopes: FloatArray,
        *,
        neurons: int,
        factor: BaseFactor,
        rng: np.random.Generator,
    ) -> "LocalUnits":
        """Neurons near every centre, in directions spread over the half circle, turned and shifted at random.

        Args:
            windows: The windows.
            centres: Of the windows, shape (c, 2), mm.
            slopes: Slope of their neurons, shape (c,), 1/mm.
            neurons: Neurons in a window, m.
            factor: The hard condition.
            rng: Draws turns and shifts.
        """
        shape = (neurons, len(centres))
        angle = rng.uniform(0, np.pi, shape[1]) + np.pi * np.arange(neurons)[:, None] / neurons
        angle += rng.uniform(-0.2, 0.2, shape)
        along = slopes * np.stack([np.cos(angle), np.sin(angle)])
        bias = rng.uniform(-1, 1, shape) - np.einsum("xmc,cx->mc", along, centres)
        return cls(windows, torch.from_numpy(np.concatenate([along, bias[None]])), factor)

    def values(self, points: torch.Tensor, near: torch.Tensor) -> torch.Tensor:
        """The units of windows `near` (w,) times the hard condition at points (n, 2), mm: (n, m + 1, w)."""
        share = self.windows.shares(points, near).mul_(self.factor.at(points)[0])
        return self._units(points, near).mul_(share[:, None])

    def derivatives(self, points: torch.Tensor, near: torch.Tensor) -> torch.Tensor:
        """Derivatives of `values` along x and y, 1/mm, by windows: (2, n, w, m + 1)."""
        share, slopes = self.windows.shares_with_slopes(points, near)
        factor, factor_slope = self.factor.at(points)
        slopes = slopes.mul_(factor)
        slopes[0].addcmul_(factor_slope, share)
        share = share.mul_(factor)
        unit = self._units(points, near)
        rate = (1 - unit[:, 1:].square()).mul_(share[:, None])
        found = unit * slopes[:, :, None]
        for axis in range(2):
            found[axis, :, 1:].addcmul_(rate, self.neurons[axis, :, near])
        return found.transpose(2, 3).contiguous()

    def functionals(self, points: FloatArray, weights: FloatArray) -> FloatArray:
        """Sums of weights (k, n) times the units at points (n, 2), mm: (k, c, m + 1)."""
        found = torch.zeros(len(weights), self.windows.count, self.per_window, dtype=torch.float64)
        patches = cut_into_patches(points)
        places = [torch.from_numpy(points[patch]) for patch in patches]
        for patch, place, near in zip(patches, places, self.windows.near(boxes_around(places)), strict=True):
            shares = torch.from_numpy(weights[:, patch])
            found.index_add_(1, near, torch.einsum("kn,nuw->kwu", shares, self.values(place, near)))
        return np.asarray(found)

    def _units(self, points: torch.Tensor, near: torch.Tensor) -> torch.Tensor:
        """One and the neurons, (n, m + 1, w)."""
        unit = points.new_ones(len(points), self.per_window, len(near))
        slope_x, slope_y, bias = self.neurons[:, :, near]
        hidden = torch.addcmul(bias, points[:, :1, None], slope_x, out=unit[:, 1:])
        hidden.addcmul_(points[:, 1:, None], slope_y)
        # tanh(t) = 2 σ(2 t) - 1: torch's logistic function was measured to be ten times as fast as its tanh.
        hidden.mul_(2).sigmoid_().mul_(2).sub_(1)
        return unit


@dataclass(frozen=True, eq=False)
class LocalField:
    """A trained finite-basis network as a displacement field.

    Attributes:
        units: The hidden units.
        output: Output layer, shape (c, 2, m + 1): for every window, component and unit, mm.
    """

    units: LocalUnits
    output: torch.Tensor

    def displacement(self, location: LocatedPoints) -> FloatArray:
        """Displacement, shape (n, 2), mm."""
        return self._sample(location.points, self.displacement_of_patch)

    def gradient(self, location: LocatedPoints) -> FloatArray:
        """Displacement gradient du_i/dx_j, shape (n, 2, 2)."""
        return self._sample(location.points, self.gradient_of_patch)

    def displacement_of_patch(self, points: torch.Tensor, near: torch.Tensor) -> torch.Tensor:
        """Displacement at a few points (n, 2), mm, that only the windows `near` (w,) reach: (n, 2), mm."""
        share = self.units.windows.shares(points, near).mul_(self.units.factor.at(points)[0])
        constant, neurons = self.output[near].split([1, self.output.shape[2] - 1], dim=2)
        slopes, bias = self.units.neurons[:, :, near].flatten(1).split([2, 1])
        # c tanh(t) = 2 c σ(2 t) - c, see `LocalUnits`; the constant takes the -c.
        logistic = torch.addmm(2 * bias, points, 2 * slopes).sigmoid_().view(len(points), -1, len(near))
        found: torch.Tensor = share @ (constant[:, :, 0] - neurons.sum(dim=2))
        weights = neurons.permute(2, 0, 1).flatten(0, 1)
        found.addmm_(logistic.mul_(share[:, None]).flatten(1), weights, alpha=2)
        return found

    def gradient_of_patch(self, points: torch.Tensor, near: torch.Tensor) -> torch.Tensor:
        """Its gradient at a few points (n, 2), mm, that only the windows `near` (w,) reach: (n, 2, 2)."""
        return torch.einsum("xnwu,wiu->nix", self.units.derivatives(points, near), self.output[near])

    def _sample(
        self, points: FloatArray, field: Callable[[torch.Tensor, torch.Tensor], torch.Tensor]
    ) -> FloatArray:
        patches = cut_into_patches(points)
        places = [torch.from_numpy(points[patch]) for patch in patches]
        near = self.units.windows.near(boxes_around(places))
        parts = one_by_one(lambda work: field(*work).numpy(), list(zip(places, near, strict=True)))
        found: FloatArray = np.concatenate(list(parts))
        result: FloatArray = np.empty_like(found)
        result[np.concatenate(patches)] = found
        return result
