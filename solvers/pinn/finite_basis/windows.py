"""Windows that sum to one everywhere in the body: a tree of gates, and Shepard's round bumps.

A gated layer of Wang, Teng and Perdikaris (SIAM J. Sci. Comput. 43 (2021) A3055-A3081) mixes two encoders by
a gate Z of the input X: (1 - Z) A + Z B. In the tree A and B are in turn the results of two gates below, down
to encoders that serve a small part of the body each:

    H_g = (1 - Z_g) H_closed(g) + Z_g H_open(g)        Z_g = σ(t_g)

The share of an encoder e in the result is then the product of 1 - Z or Z over the gates above it,

    share_e = exp(sum_g P_ge t_g - |P|_ge softplus(t_g))

with P_ge = 1 and |P|_ge = 1 where the gate's open side leads to e, 0 and 1 where the closed side does, and
0 and 0 elsewhere. The shares are smooth and sum to one everywhere, whatever the weights: a hierarchical
mixture of experts (M. I. Jordan and R. A. Jacobs, Neural Comput. 6 (1994) 181-214).

In a gated layer the logit t is the linear l = X w_g + b_g. Its σ ends nowhere, so that a dozen encoders reach
every point with shares of 1e-4 to 1e-8, which cost as much as the others. Here t = l / (1 - (l / 12)²), which
is as l in the middle, and closes or opens the gate wholly at |l| = 12: half the time at the same error. Gates
that end, there cubic, are those of H. Hazimeh et al., The tree ensemble layer, ICML (2020).
"""

from dataclasses import dataclass

import numpy as np
import torch
from torch.nn.functional import softplus

from pinnray.runtime.arrays import BoolArray, FloatArray, IntArray
from pinnray.runtime.errors import UserError

NEGLIGIBLE = 1e-8
"""Share below which an encoder is left out in a box of points."""
CLOSED = 12.0
"""Magnitude of the linear logit from which on a gate is closed or open."""
DIRECTIONS = 6
"""Directions of the cuts that are tried for a gate."""
CUTS = 5
"""Cuts that are tried in each direction."""
MIDDLE = (0.3, 0.7)
"""Quantiles of the centres between which they lie."""


@dataclass(frozen=True, eq=False)
class GateTree:
    """Gates over c encoders."""

    gates: torch.Tensor  # Weights of x and y, 1/mm, and the bias of every gate, shape (c - 1, 3)
    # Number of the gate below that a closed and an open gate pass on, shape (c - 1, 2); below zero it is the
    # complement ~e of the number of an encoder
    children: torch.Tensor
    paths: torch.Tensor  # For every encoder the gates above it, padded with -1, shape (c, d)
    opened: torch.Tensor  # Whether the encoder is on their open sides, shape (c, d)

    @classmethod
    def over(
        cls, centres: FloatArray, spacing: FloatArray, *, width: float, rng: np.random.Generator
    ) -> "GateTree":
        """Gates that lead to an encoder for every centre.

        Each gate halves a set of centres, along the line that leaves most room for a wide gate: away from
        places where the spacing is fine.

        Args:
            centres: Shape (c, 2), mm.
            spacing: Distance between neighbouring centres there, shape (c,), mm.
            width: Distance over which Z goes from 0.27 to 0.73, in spacings at the line.
            rng: Draws the directions of the lines.
        """
        gates: list[FloatArray] = []
        children: list[list[int]] = []
        paths: dict[int, list[tuple[int, bool]]] = {}
        todo: list[tuple[IntArray, list[tuple[int, bool]]]] = [(np.arange(len(centres)), [])]
        while todo:
            inside, above = todo.pop()
            number = len(gates) if len(inside) > 1 else ~int(inside[0])
            if above:
                gate, opened = above[-1]
                children[gate][int(opened)] = number
            if number < 0:
                paths[~number] = above
                continue
            normal, offset, room, beyond = _roomiest_cut(centres[inside], spacing[inside], rng)
            gates.append(np.append(normal, -offset) * 2 / (width * room))
            children.append([0, 0])
            todo += [(inside[beyond == side], [*above, (number, side)]) for side in (False, True)]
        depth = max(map(len, paths.values()))
        padded = [paths[e] + [(-1, False)] * (depth - len(paths[e])) for e in range(len(centres))]
        steps = torch.tensor(padded, dtype=torch.int64).reshape(len(centres), depth, 2)
        weights = torch.from_numpy(np.array(gates).reshape(-1, 3))
        below = torch.tensor(children, dtype=torch.int64).reshape(-1, 2)
        return cls(weights, below, steps[..., 0], steps[..., 1] == 1)

    @property
    def count(self) -> int:
        """Number of encoders, c."""
        return len(self.paths)

    def near(self, boxes: torch.Tensor) -> list[torch.Tensor]:
        """Numbers of the encoders that reach each of some boxes (b, 2, 2), mm, ascending, (w,) each.

        The linear logit has its extremes in a box at corners, and the gate grows with it; the product of the
        extremes over the gates above an encoder bounds its share from above.
        """
        middle, half = boxes.mean(dim=1), 0.5 * (boxes[:, 1] - boxes[:, 0])
        box = torch.arange(len(boxes))
        node = torch.full_like(box, 0 if self.count > 1 else ~0)
        bound = boxes.new_ones(len(boxes))
        found = []
        while len(box):
            done = node < 0
            found.append(torch.stack([box[done], ~node[done]]))
            box, node, bound = box[~done], node[~done], bound[~done]
            weights, bias = self.gates[node].split([2, 1], dim=1)
            logit = (weights * middle[box]).sum(dim=1) + bias[:, 0]
            spread = (weights.abs() * half[box]).sum(dim=1)
            sides = [_logits(side)[0].sigmoid_() for side in (spread - logit, spread + logit)]
            bound = (bound * torch.stack(sides)).flatten()
            reached = bound > NEGLIGIBLE
            node = self.children[node].T.flatten()[reached]
            box, bound = box.repeat(2)[reached], bound[reached]
        pairs = torch.cat(found, dim=1)
        pairs = pairs[:, (pairs[0] * self.count + pairs[1]).argsort()]
        return list(pairs[1].split(pairs[0].bincount(minlength=len(boxes)).tolist()))

    def values(self, points: torch.Tensor, near: torch.Tensor) -> torch.Tensor:
        """Shares of the encoders `near` (w,) at points (n, 2), mm: (n, w)."""
        return self._shares(points, *self._above(near))[0]

    def values_and_gradients(
        self, points: torch.Tensor, near: torch.Tensor
    ) -> tuple[torch.Tensor, torch.Tensor]:
        """Shares (n, w) and their derivatives with respect to x and y, (2, n, w), 1/mm."""
        gates, above, opened = self._above(near)
        share, logits, slopes = self._shares(points, gates, above, opened)
        closing = logits.sigmoid_().mul_(slopes)
        by = gates[:, :2].T[:, :, None]
        along = torch.cat([slopes, closing], dim=1) @ torch.cat([by * opened, -by * above], dim=1)
        return share, along.mul_(share)

    def _shares(
        self, points: torch.Tensor, gates: torch.Tensor, above: torch.Tensor, opened: torch.Tensor
    ) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor]:
        """Shares (n, w), the gates' logits and their derivatives by the linear ones, (n, k) each."""
        logits, slopes = _logits(torch.addmm(gates[:, 2], points, gates[:, :2].T))
        closed = softplus(logits, threshold=40)
        return (logits @ opened).addmm_(closed, above, alpha=-1).exp_(), logits, slopes

    def _above(self, near: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor]:
        """Gates above encoders (w,), (k, 3), and the matrices |P| and P of the module's formula, (k, w)."""
        # NumPy's operations on arrays as small as these take a fifth of torch's time.
        paths = self.paths.numpy()[near.numpy()]
        column, depth = (paths >= 0).nonzero()
        on_path = paths[column, depth]
        reached = np.zeros(len(self.gates), dtype=np.bool_)
        reached[on_path] = True
        gates = reached.nonzero()[0]
        row = gates.searchsorted(on_path)
        above, opened = np.zeros((2, len(gates), len(near)))
        above[row, column] = 1.0
        opened[row, column] = self.opened.numpy()[near.numpy()][column, depth]
        return self.gates[torch.from_numpy(gates)], torch.from_numpy(above), torch.from_numpy(opened)


def _logits(linear: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
    """Logits of gates from the linear ones, and their derivatives by these; see the module's formula."""
    share = (linear / CLOSED).clamp(-0.98, 0.98)  # beyond, the gate is closed or open to the last digit
    square = share.square()
    rest = 1 - square
    return CLOSED * share / rest, (1 + square) / rest.square()


def _roomiest_cut(
    centres: FloatArray, spacing: FloatArray, rng: np.random.Generator
) -> tuple[FloatArray, float, float, BoolArray]:
    """The cut through the middle of centres (n, 2) that leaves most room for a gate.

    The room of a line is the smallest spacing near it; a centre farther from the line than its spacing
    limits it only by that distance. The more centres lie near the line, the more are mixed there, which
    counts against it.

    Returns:
        Normal of the line, shape (2,), its offset along the normal, the room, mm, and which centres lie
        beyond it.
    """
    angles = rng.uniform(0, np.pi) + np.pi * np.arange(DIRECTIONS) / DIRECTIONS
    normals = np.stack([np.cos(angles), np.sin(angles)])
    along = centres @ normals
    first, last = (int(np.clip(share * len(centres), 1, len(centres) - 1)) for share in MIDDLE)
    ranks = np.unique(np.linspace(first, last, CUTS).astype(int))
    ordered = np.sort(along, axis=0)
    offsets = 0.5 * (ordered[ranks - 1] + ordered[ranks])
    distance = np.abs(along[:, None] - offsets)
    room = np.maximum(distance, spacing[:, None, None]).min(axis=0)
    crowd = (distance < spacing[:, None, None]).sum(axis=0) / np.sqrt(len(centres))
    cut, direction = np.unravel_index(np.argmax(np.log(room) - 0.3 * crowd), room.shape)
    offset = float(offsets[cut, direction])
    return normals[:, direction], offset, float(room[cut, direction]), along[:, direction] > offset


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
        along = (base.square().mul_(-6) / self.radii[near]) * local
        return value, (along - value * along.sum(dim=2, keepdim=True)) / total

    def _local(self, points: torch.Tensor, near: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
        """Positions in the windows, in radii, (2, n, w), and 1 - |x - c|^2 / R^2 or zero outside, (n, w)."""
        local = (points.T[:, :, None] - self.centres[near].T[:, None]).div_(self.radii[near])
        x, y = local
        return local, torch.addcmul(1 - x * x, y, y, value=-1).clamp_(min=0)


def _total(bumps: torch.Tensor) -> torch.Tensor:
    """Sum of the windows at each point, (n, 1)."""
    total = bumps.sum(dim=1, keepdim=True)
    missing = int((total <= 0).sum())
    if missing:
        raise UserError(f"{missing} points lie in no window of the network; take a smaller spacing")
    return total
