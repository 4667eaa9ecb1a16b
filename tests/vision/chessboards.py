"""A camera by its formula, photographs of a board in many poses, and a board drawn analytically."""

import numpy as np
from scipy.spatial.transform import Rotation

from geometry.arrays import FloatArray
from vision.board import Board, GreyImage
from vision.camera import Camera, Pose

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
    bright = np.where(inside & ((column + row) % 2 == 0), 30.0, 220.0)
    return np.rint(bright.reshape(height, samples, width, samples).mean(axis=(1, 3))).astype(np.uint8)
