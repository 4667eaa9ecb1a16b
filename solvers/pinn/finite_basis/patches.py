"""Patches of neighbouring points, small enough for arrays over a patch to stay in a core's cache.

The basis functions that reach one patch are a small dense block, for which dense matrix kernels are faster
than a sparse matrix of all points and basis functions.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
import torch
from scipy.spatial import cKDTree

from geometry.arrays import FloatArray, IntArray

PATCH = 96
"""Points in a patch: with fewer, a window is in more patches; with more, it is far from some points."""

MANY, MOST = 1000, 1024
"""Number of patches above which they grow, and the most points in one."""


def cut_into_patches(points: FloatArray) -> list[IntArray]:
    """Numbers of the points (n, 2) in each patch; every point is in one patch.

    Very many points are so dense that larger patches, which cost less a point, are still small.
    """
    if not len(points):
        return []
    size = min(max(PATCH, len(points) // MANY), MOST)
    found, todo = [], [cKDTree(points, leafsize=size, balanced_tree=False, compact_nodes=False).tree]
    while todo:
        node: Any = todo.pop()
        if node.lesser is None:
            found.append(node.indices.copy())
        else:
            todo += [node.greater, node.lesser]
    return found


def boxes_around(patches: Sequence[torch.Tensor]) -> torch.Tensor:
    """Lower left and upper right corners of the boxes around patches of points (n, 2), shape (b, 2, 2)."""
    starts = np.cumsum([0, *(len(patch) for patch in patches[:-1])])
    points = np.concatenate([patch.numpy() for patch in patches])
    ends = [extreme.reduceat(points, starts) for extreme in (np.minimum, np.maximum)]
    return torch.from_numpy(np.stack(ends, axis=1))
