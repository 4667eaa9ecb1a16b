"""Windows: smooth functions, each living in a part of the body, that sum to one everywhere in it."""

from dataclasses import dataclass
from typing import Protocol

import torch

from geometry.errors import UserError


class Windows(Protocol):
    """A partition of unity by c windows."""

    @property
    def count(self) -> int:
        """Number of windows, c."""
        ...

    def near(self, boxes: torch.Tensor) -> list[torch.Tensor]:
        """Numbers of the windows that reach each of some boxes, ascending, (w,) each.

        Args:
            boxes: Their lower left and upper right corners, shape (b, 2, 2), mm.
        """
        ...

    def shares(self, points: torch.Tensor, near: torch.Tensor) -> torch.Tensor:
        """The windows `near` (w,) at points (n, 2), mm: (n, w)."""
        ...

    def shares_with_slopes(
        self, points: torch.Tensor, near: torch.Tensor
    ) -> tuple[torch.Tensor, torch.Tensor]:
        """The same (n, w) and their derivatives along x and y, (2, n, w), 1/mm."""
        ...


@dataclass(frozen=True, eq=False)
class ShepardWindows:
    """Bumps (1 - |x - c|^2 / R^2)^3 around centres c, divided by their sum.

    After D. Shepard, A two-dimensional interpolation function for irregularly-spaced data, Proc. 23rd ACM
    National Conference (1968) 517-524.

    Attributes:
        centres: Shape (c, 2), mm.
        radii: Radii R, shape (c,), mm.
    """

    centres: torch.Tensor
    radii: torch.Tensor

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

    def shares(self, points: torch.Tensor, near: torch.Tensor) -> torch.Tensor:
        """The windows `near` (w,) at points (n, 2), mm: (n, w).

        Raises:
            UserError: If a point lies in no window.
        """
        bumps = self._rise(self._local(points, near)) ** 3
        return bumps / _total(bumps)

    def shares_with_slopes(
        self, points: torch.Tensor, near: torch.Tensor
    ) -> tuple[torch.Tensor, torch.Tensor]:
        """The same (n, w) and their derivatives along x and y, (2, n, w), 1/mm."""
        local = self._local(points, near)
        rise = self._rise(local)
        bumps = rise**3
        total = _total(bumps)
        share = bumps / total
        slopes = (-6 * rise.square() / self.radii[near])[:, :, None] * local
        along = slopes.permute(2, 0, 1)
        return share, (along - share * along.sum(dim=2, keepdim=True)) / total

    def _local(self, points: torch.Tensor, near: torch.Tensor) -> torch.Tensor:
        """Positions in the windows, in radii, (n, w, 2)."""
        return (points[:, None] - self.centres[near]) / self.radii[near, None]

    @staticmethod
    def _rise(local: torch.Tensor) -> torch.Tensor:
        return (1 - local.square().sum(dim=-1)).clamp_(min=0)


def _total(bumps: torch.Tensor) -> torch.Tensor:
    """Sum of the windows at each point, (n, 1)."""
    total = bumps.sum(dim=1, keepdim=True)
    missing = int((total <= 0).sum())
    if missing:
        raise UserError(f"{missing} points lie in no window of the network; take a smaller spacing")
    return total
