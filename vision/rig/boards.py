"""Scenes and poses for photographs of a calibration board."""

from collections.abc import Iterator

import numpy as np
import shapely
from scipy.spatial.transform import Rotation

from pinnray.runtime.arrays import FloatArray
from pinnray.runtime.errors import UserError
from pinnray.vision.calibration.camera import Camera, Pose
from pinnray.vision.calibration.charuco import CharucoBoard
from pinnray.vision.calibration.chessboard import Board
from pinnray.vision.rig.shapes import Scene, Shape, rectangle

PAPER, INK, WALL = (0.90, 0.91, 0.90), (0.06, 0.06, 0.06), (0.35, 0.38, 0.40)
MARGIN = 0.7
"""White rim of the board, sides of a square."""
TILT = (12.0, 38.0)
"""Between the board and the image, degrees."""
SIZE = (0.35, 0.65)
"""Length of the board's longer side over the image's."""
RIM = 4.0
"""Between the board and the border of the image, pixels."""
TRIES = 150


def board_scene(board: Board) -> Scene:
    """A board on a wall, in the frame of its corners."""
    low = -(1 + MARGIN) * np.full(2, board.square)
    high = (np.array([board.columns, board.rows]) + MARGIN) * board.square
    places = np.indices((board.columns + 1, board.rows + 1)).reshape(2, -1).T - 1
    black = places[places.sum(axis=1) % 2 == 0]
    squares = [rectangle(place * board.square, (place + 1) * board.square) for place in black]
    cells = _cells(board) if isinstance(board, CharucoBoard) else []
    # One shape, so that cells that touch leave no seam.
    ink = Shape(np.concatenate([*squares, *cells]), INK)
    return Scene(WALL, [Shape(rectangle(low, high), PAPER), ink])


def board_svg(board: Board) -> str:
    """SVG of a board in true scale, with its white rim; one user unit is 1 mm, y down as in a photograph."""
    low, high = -(1 + MARGIN) * board.square, (np.array([board.columns, board.rows]) + MARGIN) * board.square
    width, height = high - low
    ink = board_scene(board).shapes[-1].edges.reshape(-1, 4, 2, 2)[:, :, 0]
    path = " ".join(f"M {' L '.join(f'{x:.6g},{y:.6g}' for x, y in corners)} Z" for corners in ink.tolist())
    return f"""<?xml version="1.0" encoding="UTF-8"?>
<svg xmlns="http://www.w3.org/2000/svg" width="{width:.6g}mm" height="{height:.6g}mm"
     viewBox="{low:.6g} {low:.6g} {width:.6g} {height:.6g}">
  <title>board of {board}, squares of {board.square:g} mm</title>
  <path id="ink" fill="black" d="{path}"/>
  <text x="{low + width / 2:.6g}" y="{high[1] - 0.2 * board.square:.6g}" font-size="{0.15 * board.square:.6g}"
        text-anchor="middle" fill="#606060">print at 100 %: a square is {board.square:g} mm</text>
</svg>
"""


def board_poses(board: Board, camera: Camera, count: int, *, seed: int = 0) -> list[Pose]:
    """Random poses that show the whole board, tilted in all directions; together they cover the image.

    Each is the one of several candidates that covers most of the part of the image that is not covered yet.

    Raises:
        UserError: If the board never fits into the image.
    """
    rng = np.random.default_rng(seed)
    grid = np.stack(np.meshgrid(np.arange(0, camera.width, 16), np.arange(0, camera.height, 16)), axis=-1)
    pixels = grid.reshape(-1, 2).astype(np.float64)
    fresh = np.ones(len(pixels), dtype=np.bool_)
    poses: list[Pose] = []
    for _ in range(count):
        drawn = [pose for pose in (_drawn(board, camera, rng) for _ in range(TRIES)) if pose is not None]
        if not drawn:
            raise UserError(f"a board of {board} does not fit into the image in any pose tried")
        rims = [shapely.Polygon(camera.project(_rim(board, 0.0), pose)) for pose in drawn]
        shown = [shapely.contains_xy(rim, pixels) for rim in rims]
        best = int(np.argmax([(fresh & inside).sum() for inside in shown]))
        poses.append(drawn[best])
        fresh &= ~shown[best]
        if not (fresh.sum() > 0.05 * len(fresh)):
            fresh[:] = True
    return poses


def _drawn(board: Board, camera: Camera, rng: np.random.Generator) -> Pose | None:
    """A random pose; None if part of the board is outside the image."""
    axis, tilt, turn = rng.uniform(0, 2 * np.pi), np.deg2rad(rng.uniform(*TILT)), rng.uniform(-0.3, 0.3)
    tilted = Rotation.from_rotvec([tilt * np.cos(axis), tilt * np.sin(axis), 0.0])
    rotation = tilted * Rotation.from_rotvec([0.0, 0.0, turn])
    rim = _rim(board, MARGIN)
    longer = np.ptp(rim, axis=0).max()
    distance = camera.fx * longer / (rng.uniform(*SIZE) * camera.width)
    aim = rng.uniform((0, 0), (camera.width, camera.height))
    ray = np.append((aim - (camera.cx, camera.cy)) / (camera.fx, camera.fy), 1.0)
    pose = Pose(rotation.as_rotvec(), distance * ray - rotation.apply(rim.mean(axis=0)))
    seen = camera.project(rim, pose)
    size = np.array([camera.width, camera.height])
    return pose if ((seen > RIM) & (seen < size - 1 - RIM)).all() else None


def _rim(board: Board, margin: float) -> FloatArray:
    """Corners of the squares' rectangle, enlarged by a margin in squares, shape (4, 3), mm."""
    low, high = -(1 + margin), np.array([board.columns, board.rows]) + margin
    x, y = np.array([low, high[0], high[0], low]), np.array([low, low, high[1], high[1]])
    return np.asarray(board.square * np.stack([x, y, np.zeros(4)], axis=1))


def _cells(board: CharucoBoard) -> Iterator[FloatArray]:
    """The edges of the black cells of the board's markers, as OpenCV lays them out."""
    layout = board.opencv(legacy=False)
    dictionary = layout.getDictionary()
    side = dictionary.markerSize + 2
    cell = board.marker / side
    for number, corners in zip(np.ravel(layout.getIds()), layout.getObjPoints(), strict=True):
        rows, columns = np.nonzero(dictionary.generateImageMarker(int(number), side) == 0)
        for place in np.stack([columns, rows], axis=1):
            low = np.asarray(corners)[0, :2] - board.square + cell * place
            yield rectangle(low, low + cell)
