"""Where the corners of a board are in photographs, and how much of the image they reach. Units: pixels.

Of every photograph there are as many corners as the board has, shape (n, 2), NaN where one is not seen.
"""

from collections import Counter
from collections.abc import Iterable, Sequence
from typing import NamedTuple

import cv2
import numpy as np

from geometry.arrays import FloatArray
from geometry.errors import UserError
from vision.calibration.bundle_adjustment import CornerObservations
from vision.calibration.chessboard import Board
from vision.frames.frame import GreyImage

FEWEST_VIEWS = 4
GUESSES = 8
"""Photographs that are asked what board they show if it is not the expected one."""


class BoardViews(NamedTuple):
    """What was found in photographs.

    Attributes:
        views: Corners by the name of the photograph.
        size: (width, height) of all photographs.
        boardless: Names of those in which no board was found.
    """

    views: dict[str, FloatArray]
    size: tuple[int, int]
    boardless: tuple[str, ...]


def find_views(images: Iterable[tuple[str, GreyImage]], board: Board) -> BoardViews:
    """Find a board in photographs, of which only one is held at a time.

    Raises:
        UserError: If the sizes differ, or most photographs show a board of another size.
    """
    views: dict[str, FloatArray] = {}
    boardless: list[str] = []
    guesses = Counter[str]()
    first, size = "", (0, 0)
    for name, image in images:
        width, height = image.shape[::-1]
        if not first:
            first, size = name, (width, height)
        if (width, height) != size:
            raise UserError(
                f"{first} has {size[0]}x{size[1]} pixels and {name} {width}x{height}; "
                "photographs for one calibration must have one size"
            )
        corners = board.find(image)
        if corners is not None:
            views[name] = corners
            continue
        boardless.append(name)
        if len(views) < FEWEST_VIEWS and len(boardless) <= GUESSES and (guess := board.suggest(image)):
            guesses[guess] += 1
    guess, votes = guesses.most_common(1)[0] if guesses else ("", 0)
    if len(views) < FEWEST_VIEWS and votes > max(1, len(views)):
        raise UserError(
            f"{len(views)} of {len(views) + len(boardless)} photographs show the board of {board}; "
            f"{votes} seem to show {guess}"
        )
    return BoardViews(views, size, tuple(boardless))


def corner_observations(views: Sequence[FloatArray] | FloatArray, board: Board) -> CornerObservations:
    """The corners that were seen."""
    seen = np.isfinite(views).all(axis=2)
    view, corner = np.nonzero(seen)
    return CornerObservations(board.corners[corner], np.asarray(views)[seen], view)


def residuals_by_view(values: FloatArray, views: Sequence[FloatArray]) -> FloatArray:
    """What belongs to the corners that were seen, shape (m, 2), in the shape of the views, (views, n, 2)."""
    spread = np.full(np.shape(views), np.nan)
    spread[np.isfinite(views).all(axis=2)] = values
    return spread


def coverage(views: Sequence[FloatArray], size: tuple[int, int]) -> float:
    """Share of the pixels that lie between the corners of some view."""
    covered = np.zeros(size[::-1], dtype=np.uint8)
    for view in views:
        seen = view[np.isfinite(view).all(axis=1)]
        cv2.fillConvexPoly(covered, cv2.convexHull(np.rint(seen).astype(np.int32)), [1])
    return float(covered.mean())
