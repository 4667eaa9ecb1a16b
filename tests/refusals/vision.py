"""Names of the refused expressions of `vision`."""

# ruff: noqa: F401 (the expressions use the names)

import json
import zlib
from dataclasses import replace
from math import inf, nan
from pathlib import Path

import cv2
import numpy as np
from PIL import Image

from pinnray.geometry.observations import Observations
from pinnray.runtime.arrays import FloatArray
from pinnray.vision.calibration.camera import Camera
from pinnray.vision.calibration.camera_calibration import calibrate_camera, calibrate_views
from pinnray.vision.calibration.camera_file import load_camera, save_camera
from pinnray.vision.calibration.charuco import parse_board
from pinnray.vision.calibration.chessboard import Board
from pinnray.vision.clicked_points import Clicks, clicked_points, read_clicks
from pinnray.vision.discs.colour import read_colour
from pinnray.vision.discs.colour_picker import pick_colour
from pinnray.vision.discs.disc_fit import fit_discs
from pinnray.vision.frames.decoder import PNG_HEADER
from pinnray.vision.frames.formats import PNG
from pinnray.vision.frames.sources import open_frames, photographs
from pinnray.vision.frames.video import video_writer
from pinnray.vision.measurements import read_measurements
from pinnray.vision.rig.boards import board_poses
from pinnray.vision.rig.exposure import Exposure
from pinnray.vision.rig.motion import Motion
from pinnray.vision.rig.virtual_camera import default_camera
from pinnray.vision.tracking.camera_motion import find_camera_motion
from pinnray.vision.tracking.fiducial_matching import identify_fiducials
from pinnray.vision.tracking.layout_matching import match_layout
from pinnray.vision.tracking.marker_plane import SIMILARITY
from pinnray.vision.tracking.plane_fit import homography_plane
from pinnray.vision.tracking.rest_detection import find_rest_intervals
from pinnray.vision.tracking.workspace import Workspace, load_workspace
from tests.vision.calibration.chessboards import BOARD, CAMERA, drawn, views
from tests.vision.films import tracked
from tests.vision.fingers import MARKERS, PRESSED
from tests.vision.plane.test_plane_fit import NOISE, POINTS, fitted, seen
from tests.vision.test_clicked_points import found, picture
from tests.vision.tracking.listed_discs import discs_at
from tests.vision.tracking.test_camera_motion import SCENE, START
from tests.vision.tracking.test_trajectories import discs, tracking

GREY = np.full((36, 64), 128, np.uint8)
SQUARE = ((0.0, 0.0), (10.0, 0.0), (10.0, 10.0), (0.0, 10.0))
HEADER = "x_mm,y_mm,u_mm,v_mm"
FRONT = MARKERS["front"]
ROW = BOARD.corners[:, 1] == 0
"""Corners of the first row."""
CORNER = BOARD.corners[:, :2].max(axis=1) <= BOARD.square
"""The four nearest to the first one."""
SIZE = (CAMERA.width, CAMERA.height)
BLANK = np.full((360, 640), 128, np.uint8)
LINE = np.column_stack([np.arange(10.0, 60, 10), np.full(5, -1.0)])
POLYGON = np.array([(28 * np.cos(angle), 28 * np.sin(angle)) for angle in 2 * np.pi * np.arange(7) / 7])
TO_PIXELS = np.array([[4.2, 0.7, 90.0], [-0.5, 3.9, 75.0], [1e-3, -6e-4, 1.0]])
PHOTOGRAPH = drawn(Board(5, 4, 10.0), np.linalg.inv(TO_PIXELS), (360, 260), samples=2)


def encoded(level: int = 1, suffix: str = ".png", dtype: type = np.uint8, side: int = 8) -> bytes:
    """A picture of 8 x `side` pixels of one grey level."""
    return cv2.imencode(suffix, np.full((side, 8), level, dtype))[1].tobytes()


def enlarged(content: bytes, side: int) -> bytes:
    """A PNG whose header says that it is a square of so many pixels."""
    header = content[12:16] + 2 * side.to_bytes(4, "big") + content[24:29]
    return content[:12] + header + zlib.crc32(header).to_bytes(4, "big") + content[PNG_HEADER:]


FILES = {
    "board.png": cv2.imencode(".png", PHOTOGRAPH)[1].tobytes(),
    "boards/dark.png": cv2.imencode(".png", 0 * PHOTOGRAPH)[1].tobytes(),
    "boards/board.png": cv2.imencode(".png", PHOTOGRAPH)[1].tobytes(),
}


def file(name: str, content: str | bytes = b"") -> Path:
    """A file in the current folder."""
    path = Path(name)
    path.parent.mkdir(exist_ok=True)
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return path


def measured(*lines: str) -> Observations:
    """Measurements of these lines."""
    return read_measurements(file("markers.csv", "\n".join(lines)), marker_radius=1)


def clicked(*lines: str) -> Clicks:
    """Clicks of these lines."""
    return read_clicks(file("clicks.csv", "\n".join(lines)))


def film(source: Path | str) -> list[object]:
    """All frames of a source."""
    with open_frames(source) as frames:
        return list(frames)


def stack(name: str, *levels: int, sizes: tuple[int, ...] = (16,), **options: object) -> Path:
    """A picture of a page for every grey level, as wide as `sizes`, in turn."""
    pages = [
        Image.fromarray(np.full((12, sizes[number % len(sizes)]), level, np.uint8))
        for number, level in enumerate(levels)
    ]
    pages[0].save(name, save_all=True, append_images=pages[1:], **options)
    return Path(name)


def media(brand: bytes, *others: bytes) -> bytes:
    """The start of a file of ISO's base media format."""
    body = b"ftyp" + brand + bytes(4) + b"".join(others)
    return (len(body) + 4).to_bytes(4, "big") + body + bytes(200)


def recorded(*given: object) -> None:
    """A video of no frame."""
    with video_writer(*given):
        pass


def camera_of(**changes: object) -> Camera:
    """The camera of a file, of which some keys are changed, or left out if None."""
    save_camera(Path("camera.json"), CAMERA)
    content = json.loads(Path("camera.json").read_text(encoding="utf-8")) | changes
    kept = {key: value for key, value in content.items() if value is not None}
    return load_camera(file("camera.json", json.dumps(kept)))


def matrix(count: int, value: float = 0.0) -> dict[str, object]:
    """A matrix as OpenCV writes it."""
    return {"type_id": "opencv-matrix", "rows": 1, "cols": count, "dt": "d", "data": [value] * count}


def partly(kept: FloatArray, names: tuple[str, ...], count: int) -> dict[str, FloatArray]:
    """Views of the board, in some of which only those corners are seen that are kept."""
    return {
        name: np.where(kept[:, None], pixels, np.nan) if name in names else pixels
        for name, pixels in views(count, noise=0.05).items()
    }


def flat() -> dict[str, FloatArray]:
    """Views of a board that is never tilted."""
    rng = np.random.default_rng(6)
    return {
        str(number): rng.uniform(2, 4) * BOARD.corners[:, :2] + rng.uniform((0, 0), (400, 200))
        for number in range(8)
    }


def pressed(*shares: float, noise: float = 0.0) -> object:
    """When the finger rests that is pressed by these shares of the stroke."""
    still = FRONT + np.asarray(shares)[:, None, None] * np.array(PRESSED["front"])[0]
    return find_rest_intervals(still + np.random.default_rng(0).normal(0, noise, still.shape))
