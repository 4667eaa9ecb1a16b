"""Corners of a board in photographs, and the share of the image that they cover. Units: pixels.

A view is the corners in one photograph, in the order of the board, shape (n, 2), NaN where one is not seen.
"""

from collections.abc import Iterable, Mapping, Sequence

import cv2
import numpy as np

from pinnray.runtime.arrays import FloatArray
from pinnray.runtime.errors import UserError
from pinnray.vision.calibration.chessboard import Board
from pinnray.vision.frames.frame import GreyImage

FEWEST_VIEWS = 4
MAX_NAMED = 5
"""Photographs of other sizes whose sizes a message names."""


def find_views(
    images: Iterable[tuple[str, GreyImage]], board: Board
) -> tuple[dict[str, FloatArray], tuple[int, int], dict[str, str]]:
    """Find a board in photographs; only one is in memory at a time.

    Returns:
        The views by the name of the photograph, (width, height) of all, and why others show none, by name.

    Raises:
        UserError: If the sizes differ.
    """
    views: dict[str, FloatArray] = {}
    left_out: dict[str, str] = {}
    sizes: dict[tuple[int, int], list[str]] = {}
    for name, image in images:
        width, height = image.shape[::-1]
        sizes.setdefault((width, height), []).append(name)
        if len(sizes) > 1:
            continue  # the rest only tells which size is the usual one
        if (corners := board.find(image)) is None:
            left_out[name] = f"no board of {board} was found"
        else:
            views[name] = corners
    if len(sizes) > 1:
        raise UserError(_other_sizes(sizes))
    return views, next(iter(sizes), (0, 0)), left_out


def unusable(corners: FloatArray) -> str:
    """Why corners, shape (n, 2), NaN where one is not seen, do not determine the board's pose."""
    count = int(np.isfinite(corners[:, 0]).sum())
    return f"the {count} corners that are seen are too few or lie on a line"


def _other_sizes(sizes: Mapping[tuple[int, int], Sequence[str]]) -> str:
    """One line on photographs of other sizes than most have."""
    usual = max(sizes, key=lambda size: len(sizes[size]))
    others = [(name, size) for size, names in sizes.items() if size != usual for name in names]
    named = ", ".join(f"{name} {width}x{height}" for name, (width, height) in others[:MAX_NAMED])
    rest = f" and {len(others) - MAX_NAMED} more" if len(others) > MAX_NAMED else ""
    return (
        f"photographs for one calibration must have one size: {len(sizes[usual])} have "
        f"{usual[0]}x{usual[1]} pixels, {named}{rest}; leave out {', '.join(name for name, _ in others)}"
    )


def coverage(views: Sequence[FloatArray], size: tuple[int, int]) -> float:
    """Share of the pixels within the convex hull of the corners of at least one view."""
    covered = np.zeros(size[::-1], dtype=np.uint8)
    for view in views:
        seen = view[np.isfinite(view).all(axis=1)]
        cv2.fillConvexPoly(covered, cv2.convexHull(np.rint(seen).astype(np.int32)), [1])
    return float(covered.mean())
