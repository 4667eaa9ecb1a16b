"""Corners of a board in photographs, and the share of the image that they cover. Units: pixels.

A view is the corners in one photograph, in the order of the board, shape (n, 2), NaN where one is not seen.
"""

from collections.abc import Iterable, Sequence

import cv2
import numpy as np

from pinnray.runtime.arrays import FloatArray
from pinnray.runtime.errors import UserError
from pinnray.vision.calibration.chessboard import Board
from pinnray.vision.frames.frame import GreyImage

FEWEST_VIEWS = 4


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
    size, first = (0, 0), ""
    for name, image in images:
        width, height = image.shape[::-1]
        size, first = (size, first) if first else ((width, height), name)
        if size != (width, height):
            raise UserError(
                f"photographs for one calibration must have one size: {first} has {size[0]}x{size[1]} "
                f"pixels, {name} {width}x{height}; leave out those of the other size"
            )
        if (corners := board.find(image)) is None:
            left_out[name] = f"no board of {board} was found"
        else:
            views[name] = corners
    return views, size, left_out


def unusable(corners: FloatArray) -> str:
    """Why corners, shape (n, 2), NaN where one is not seen, do not determine the board's pose."""
    count = int(np.isfinite(corners[:, 0]).sum())
    return f"the {count} corners that are seen are too few or lie on a line"


def coverage(views: Sequence[FloatArray], size: tuple[int, int]) -> float:
    """Share of the pixels within the convex hull of the corners of at least one view."""
    covered = np.zeros(size[::-1], dtype=np.uint8)
    for view in views:
        seen = view[np.isfinite(view).all(axis=1)]
        cv2.fillConvexPoly(covered, cv2.convexHull(np.rint(seen).astype(np.int32)), [1])
    return float(covered.mean())
