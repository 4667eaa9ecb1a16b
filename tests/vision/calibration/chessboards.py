"""A camera by its formula, photographs of a board in many poses, and a board drawn analytically."""

import cv2
import numpy as np
from scipy.spatial.transform import Rotation

from pinnray.runtime.arrays import BoolArray, FloatArray
from pinnray.vision.calibration.camera import Camera, Pose
from pinnray.vision.calibration.charuco import DICTIONARIES, CharucoBoard
from pinnray.vision.calibration.chessboard import Board
from pinnray.vision.frames.frame import GreyImage

BOARD = Board(9, 6, 25.0)
CAMERA = Camera(1280, 720, 1100.0, 1095.0, 652.0, 349.0, distortion=(-0.25, 0.08, 1e-3, -5e-4, 0.0))


def projected(camera: Camera, points: FloatArray, pose: Pose) -> FloatArray:
    """Brown's model as its paper has it, without OpenCV; shapes (n, 3), mm, and (n, 2), pixels."""
    seen = Rotation.from_rotvec(pose.rotation).apply(points) + pose.translation
    x, y = seen[:, 0] / seen[:, 2], seen[:, 1] / seen[:, 2]
    k1, k2, p1, p2, k3 = camera.distortion
    r = np.hypot(x, y)
    radial = 1 + k1 * r**2 + k2 * r**4 + k3 * r**6
    u = x * radial + 2 * p1 * x * y + p2 * (r**2 + 2 * x**2)
    v = y * radial + p1 * (r**2 + 2 * y**2) + 2 * p2 * x * y
    return np.stack([camera.fx * u + camera.cx, camera.fy * v + camera.cy], axis=1)


def distorted(camera: Camera, pixels: FloatArray) -> FloatArray:
    """Pixels of a pinhole camera to pixels behind the lens; shapes (n, 2)."""
    plane = (pixels - (camera.cx, camera.cy)) / (camera.fx, camera.fy)
    return camera.project(np.column_stack([plane, np.ones(len(plane))]))


def poses(count: int, *, seed: int = 0) -> list[Pose]:
    """Tilts up to 35 degrees about either axis, all over the image."""
    rng = np.random.default_rng(seed)
    found = []
    while len(found) < count:
        rotation = Rotation.from_euler("xyz", rng.uniform(-35, 35, 3), degrees=True)
        centre = np.array([rng.uniform(-160, 160), rng.uniform(-70, 70), rng.uniform(350, 500)])
        pose = Pose(rotation.as_rotvec(), centre - rotation.apply(BOARD.corners.mean(axis=0)))
        pixels = projected(CAMERA, BOARD.corners, pose)
        if (pixels > 0).all() and (pixels < (CAMERA.width, CAMERA.height)).all():
            found.append(pose)
    return found


def views(count: int, *, noise: float, seed: int = 0) -> dict[str, FloatArray]:
    """Corners of `BOARD` seen by `CAMERA` with normal errors of standard deviation `noise`, pixels."""
    rng = np.random.default_rng(seed + 1000)
    return {
        f"view {number}": projected(CAMERA, BOARD.corners, pose) + rng.normal(0, noise, (54, 2))
        for number, pose in enumerate(poses(count, seed=seed))
    }


def drawn(board: Board, homography: FloatArray, size: tuple[int, int], *, samples: int = 5) -> GreyImage:
    """A photograph without a lens: every pixel is the mean of `samples`² points of the exact scene.

    `homography` takes pixels to the board's plane, mm; outside the board all is white.
    """
    width, height = size
    offsets = (np.arange(samples) + 0.5) / samples - 0.5
    x = (np.arange(width)[:, None] + offsets).ravel()
    y = (np.arange(height)[:, None] + offsets).ravel()
    pixels = np.stack([*np.broadcast_arrays(x[None, :], y[:, None]), np.ones((len(y), len(x)))])
    u, v, w = np.tensordot(homography, pixels, axes=1)
    column, row = np.floor(u / w / board.square), np.floor(v / w / board.square)
    inside = (column >= -1) & (column < board.columns) & (row >= -1) & (row < board.rows)
    black = inside & ((column + row) % 2 == 0)
    if isinstance(board, CharucoBoard):
        black |= _markers(board, u / w + board.square, v / w + board.square)
    bright = np.where(black, 30.0, 220.0)
    return np.rint(bright.reshape(height, samples, width, samples).mean(axis=(1, 3))).astype(np.uint8)


def photographed(
    board: Board, pose: Pose, *, focal: float = 600.0, blur: float = 0.7, noise: float = 2.0
) -> tuple[GreyImage, FloatArray]:
    """A blurred and noisy photograph of 640x480 pixels by a pinhole, and where the corners truly are."""
    matrix = np.array([[focal, 0, 319.5], [0, focal, 239.5], [0, 0, 1]])
    turn = Rotation.from_rotvec(pose.rotation).as_matrix()
    to_pixels = matrix @ np.column_stack([turn[:, :2], pose.translation])
    sharp = drawn(board, np.linalg.inv(to_pixels), (640, 480), samples=4)
    image = cv2.GaussianBlur(sharp.astype(float), (0, 0), blur)
    image += np.random.default_rng(4).normal(0, noise, image.shape)
    exact = np.column_stack([board.corners[:, :2], np.ones(len(board.corners))]) @ to_pixels.T
    return np.clip(np.rint(image), 0, 255).astype(np.uint8), exact[:, :2] / exact[:, 2:]


def _markers(board: CharucoBoard, x: FloatArray, y: FloatArray) -> BoolArray:
    """Where the markers are black; x and y from the corner of the board, mm.

    In every other square from the second one on, row by row; a marker has a black border of one bit.
    """
    dictionary = cv2.aruco.getPredefinedDictionary(DICTIONARIES[board.dictionary])
    bits = dictionary.markerSize + 2
    images = np.ones((board.rows + 1, board.columns + 1, bits, bits), dtype=bool)
    places = [place for place in np.ndindex(images.shape[:2]) if sum(place) % 2]
    for number, place in enumerate(places):
        images[place] = cv2.aruco.generateImageMarker(dictionary, number, bits) > 0
    (column, right), (row, down) = np.divmod(x, board.square), np.divmod(y, board.square)
    margin = 0.5 * (board.square - board.marker)
    j, i = ((inside - margin) / board.marker * bits for inside in (right, down))
    on = (np.minimum(i, j) >= 0) & (np.maximum(i, j) < bits)
    on &= (column >= 0) & (column <= board.columns) & (row >= 0) & (row <= board.rows)
    black = np.zeros(x.shape, dtype=bool)
    black[on] = ~images[tuple(index[on].astype(int) for index in (row, column, i, j))]
    return black
