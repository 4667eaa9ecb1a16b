"""A finite-basis network: hidden units that live in overlapping windows which sum to one.

Every centre c has a window w = (1 - |x - c|^2 / R^2)^3 and m + 1 units in it: a constant and m ridges
tanh(s . (x - c) / R + b). Dividing the windows by their sum (Shepard) makes them a partition of unity, so
that the network can be any constant, and any smooth function that the ridges follow within a window. After
Moseley, Markham and Nissen-Meyer, Finite basis physics-informed neural networks, Adv. Comput. Math. 49
(2023), and Shepard, A two-dimensional interpolation function for irregularly-spaced data, Proc. 23rd ACM
National Conference (1968).
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import torch

from geometry.arrays import FloatArray
from geometry.errors import UserError
from geometry.locate import Location
from solvers.pinn.patches import cut_into_patches, over_patches
from solvers.pinn.trial_space import BaseFactor


@dataclass(frozen=True, eq=False)
class LocalUnits:
    """Weights of the units in c windows.

    Attributes:
        centres: Shape (c, 2), mm.
        radii: Radii of the windows, shape (c,), mm.
        slopes: Slopes of the ridges per radius, shape (c, m, 2).
        biases: Biases of the ridges, shape (c, m).
        factor: The hard condition on the base.
    """

    centres: torch.Tensor
    radii: torch.Tensor
    slopes: torch.Tensor
    biases: torch.Tensor
    factor: BaseFactor

    @property
    def windows(self) -> int:
        """Number of windows, c."""
        return len(self.centres)

    @property
    def per_window(self) -> int:
        """Number of units in a window, m + 1."""
        return self.slopes.shape[1] + 1

    @classmethod
    def around(
        cls,
        centres: FloatArray,
        radii: FloatArray,
        *,
        ridges: int,
        slope: float,
        factor: BaseFactor,
        rng: np.random.Generator,
    ) -> "LocalUnits":
        """Units with ridges in directions spread over the half circle, turned and shifted at random."""
        count = len(centres)
        turn = rng.uniform(0, np.pi, (count, 1)) + np.pi * np.arange(ridges) / ridges
        angle = turn + rng.uniform(-0.2, 0.2, (count, ridges))
        slopes = slope * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
        return cls(
            centres=torch.from_numpy(centres),
            radii=torch.from_numpy(radii),
            slopes=torch.from_numpy(slopes),
            biases=torch.from_numpy(rng.uniform(-1, 1, (count, ridges))),
            factor=factor,
        )

    def near(self, points: torch.Tensor) -> torch.Tensor:
        """Numbers of the windows that reach the box around points (n, 2), mm, in ascending order."""
        nearest = self.centres.clamp(points.amin(dim=0), points.amax(dim=0))
        return ((nearest - self.centres).square().sum(dim=1) < self.radii.square()).nonzero()[:, 0]

    def values(self, points: torch.Tensor, near: torch.Tensor) -> torch.Tensor:
        """The units of the windows `near` (w,), times the hard condition's factor, at points (n, 2), mm.

        Returns:
            Shape (n, w, m + 1).

        Raises:
            UserError: If a point lies in no window.
        """
        local = self._local(points, near)
        share = _share((1 - local.square().sum(dim=-1)).clamp_(min=0) ** 3)
        return (self.factor.at(points)[0] * share)[:, :, None] * self._units(local, near)

    def derivatives(self, points: torch.Tensor, near: torch.Tensor) -> torch.Tensor:
        """Derivatives of `values` along x and y, 1/mm: (2, n, w, m + 1)."""
        local, radii = self._local(points, near), self.radii[near]
        rise = (1 - local.square().sum(dim=-1)).clamp_(min=0)
        window = rise**3
        share, total = _share(window), window.sum(dim=1, keepdim=True)
        unit = self._units(local, near)
        rate = (1 - unit[:, :, 1:].square()) / radii[:, None]
        factor, factor_slope = self.factor.at(points)
        found = local.new_zeros(2, *unit.shape)
        for axis, along in enumerate(found):
            slope = -6 * rise.square() * local[:, :, axis] / radii
            change = factor * (slope - share * slope.sum(dim=1, keepdim=True)) / total
            if axis == 0:
                change += factor_slope * share
            torch.mul(rate, self.slopes[near, :, axis], out=along[:, :, 1:])
            along.mul_((factor * share)[:, :, None]).addcmul_(change[:, :, None], unit)
        return found

    def functionals(self, points: FloatArray, weights: FloatArray) -> FloatArray:
        """Sums of weights (k, n) times the units at points (n, 2), mm: (k, c, m + 1)."""
        found = self.centres.new_zeros(len(weights), self.windows, self.per_window)
        for patch in cut_into_patches(points):
            places, shares = torch.from_numpy(points[patch]), torch.from_numpy(weights[:, patch])
            near = self.near(places)
            found.index_add_(1, near, torch.einsum("kn,nwu->kwu", shares, self.values(places, near)))
        return np.asarray(found)

    def _local(self, points: torch.Tensor, near: torch.Tensor) -> torch.Tensor:
        """Positions in the windows, in radii, (n, w, 2)."""
        return (points[:, None] - self.centres[near]) / self.radii[near, None]

    def _units(self, local: torch.Tensor, near: torch.Tensor) -> torch.Tensor:
        """One and the ridges, (n, w, m + 1)."""
        slopes = self.slopes[near]
        unit = local.new_ones(*local.shape[:2], self.per_window)
        ridge = unit[:, :, 1:]
        torch.addcmul(self.biases[near], local[:, :, :1], slopes[:, :, 0], out=ridge)
        ridge.addcmul_(local[:, :, 1:], slopes[:, :, 1]).tanh_()
        return unit


def _share(windows: torch.Tensor) -> torch.Tensor:
    """Windows (n, w) over their sum at each point."""
    total = windows.sum(dim=1, keepdim=True)
    missing = int((total <= 0).sum())
    if missing:
        raise UserError(f"{missing} points lie in no window of the network; take a smaller spacing")
    return windows / total


@dataclass(frozen=True, eq=False)
class LocalField:
    """A trained finite-basis network as a displacement field.

    Attributes:
        units: The hidden units.
        output: Output layer, shape (c, 2, m + 1): for every window, component and unit, mm.
    """

    units: LocalUnits
    output: torch.Tensor

    def displacement(self, location: Location) -> FloatArray:
        """Displacement, shape (n, 2), mm."""
        return self._sample(location.points, self.displacement_of_patch)

    def gradient(self, location: Location) -> FloatArray:
        """Displacement gradient du_i/dx_j, shape (n, 2, 2)."""
        return self._sample(location.points, self.gradient_of_patch)

    def displacement_of_patch(self, points: torch.Tensor) -> torch.Tensor:
        """`displacement` for a few points, in the calling thread."""
        near = self.units.near(points)
        return torch.einsum("nwu,wiu->ni", self.units.values(points, near), self.output[near])

    def gradient_of_patch(self, points: torch.Tensor) -> torch.Tensor:
        """`gradient` for a few points, in the calling thread."""
        near = self.units.near(points)
        return torch.einsum("xnwu,wiu->nix", self.units.derivatives(points, near), self.output[near])

    def _sample(self, points: FloatArray, field: Callable[[torch.Tensor], torch.Tensor]) -> FloatArray:
        patches = cut_into_patches(points)
        parts = over_patches(lambda patch: field(torch.from_numpy(points[patch])).numpy(), patches)
        order = np.argsort(np.concatenate(patches))
        return np.asarray(np.concatenate(list(parts))[order])
