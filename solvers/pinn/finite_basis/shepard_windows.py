"""Shepard's windows: round bumps of local support, normalised to sum to one everywhere in the body."""

from dataclasses import dataclass

import torch

from geometry.errors import UserError


@dataclass(frozen=True, eq=False)
class ShepardWindows:
    """Bumps (1 - |x - c|^2 / R^2)^3 around centres c, divided by their sum.

    After D. Shepard, A two-dimensional interpolation function for irregularly-spaced data, Proc. 23rd ACM
    National Conference (1968) 517-524.
    """

    centres: torch.Tensor  # Shape (c, 2), mm
    radii: torch.Tensor  # Radii R, shape (c,), mm

    @property
    def count(self) -> int:
        """Number of windows, c."""
        return len(self.centres)

    def near(self, boxes: torch.Tensor) -> list[torch.Tensor]:
        """Numbers of the windows that reach each of some boxes (b, 2, 2), mm, ascending, (w,) each."""
        found = []
        for low, high in boxes:
            distance = self.centres.clamp(low, high).sub_(self.centres)
            found.append((distance.square_().sum(dim=1) < self.radii.square()).nonzero()[:, 0])
        return found

    def values(self, points: torch.Tensor, near: torch.Tensor) -> torch.Tensor:
        """The windows `near` (w,) at points (n, 2), mm: (n, w).

        Raises:
            UserError: If a point lies in no window.
        """
        _, base = self._local(points, near)
        bumps = base**3
        return bumps / _total(bumps)

    def values_and_gradients(
        self, points: torch.Tensor, near: torch.Tensor
    ) -> tuple[torch.Tensor, torch.Tensor]:
        """The same (n, w) and their derivatives with respect to x and y, (2, n, w), 1/mm."""
        local, base = self._local(points, near)
        bumps = base**3
        total = _total(bumps)
        value = bumps / total
        gradient = (-6 * base.square() / self.radii[near])[:, :, None] * local
        along = gradient.permute(2, 0, 1)
        return value, (along - value * along.sum(dim=2, keepdim=True)) / total

    def _local(self, points: torch.Tensor, near: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
        """Positions in the windows, in radii, (n, w, 2), and 1 - |x - c|^2 / R^2 or zero outside, (n, w)."""
        local = (points[:, None] - self.centres[near]) / self.radii[near, None]
        return local, (1 - local.square().sum(dim=-1)).clamp_(min=0)


def _total(bumps: torch.Tensor) -> torch.Tensor:
    """Sum of the windows at each point, (n, 1)."""
    total = bumps.sum(dim=1, keepdim=True)
    missing = int((total <= 0).sum())
    if missing:
        raise UserError(f"{missing} points lie in no window of the network; take a smaller spacing")
    return total
