"""Camera files: JSON with the keys of OpenCV's calibration sample, readable by `cv2.FileStorage`."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

from pinnray.runtime.arrays import FloatArray
from pinnray.runtime.atomic import write_json
from pinnray.runtime.errors import UserError
from pinnray.runtime.machine import package_version
from pinnray.runtime.text_files import read_json
from pinnray.vision.calibration.camera import INTRINSICS, Camera
from pinnray.vision.calibration.camera_calibration import Calibration

PACKAGES = ("pinn-ray", "numpy", "scipy", "opencv-python-headless")
"""Those that make a calibration."""


def save_camera(path: Path, camera: Camera, more: Mapping[str, object] = MappingProxyType({})) -> None:
    """Write a camera, and `more` entries after its own, atomically; `load_camera` restores it.

    Raises:
        UserError: If the suffix is not .json.
    """
    check_format(path)
    content: dict[str, object] = {
        "image_width": camera.width,
        "image_height": camera.height,
        "fisheye_model": 0,
        "camera_matrix": _entry(camera.matrix.tolist()),
        "distortion_coefficients": _entry([camera.distortion]),
    }
    if camera.covariance is not None:
        content["intrinsics"] = list(INTRINSICS)
        content["intrinsics_standard_deviations"] = _entry([camera.standard_deviations or ()])
        content["intrinsics_covariance"] = _entry(camera.covariance)
    write_json(path, content | dict(more))


def save_calibration(path: Path, calibration: Calibration) -> None:
    """Write a camera with its errors, coverage, board and the versions of the programs that made it.

    Raises:
        UserError: If the suffix is not .json.
    """
    board, errors = calibration.board, calibration.view_errors
    made = {
        "avg_reprojection_error": calibration.rms,
        "held_out_reprojection_error": calibration.held_out_rms,
        "coverage": calibration.coverage,
        "nframes": len(errors),
        "image_names": list(errors),
        "per_view_reprojection_errors": _entry([[error] for error in errors.values()]),
        "board": type(board).__name__,
        "board_width": board.columns,
        "board_height": board.rows,
        "square_size": board.square,
        "versions": [f"{name} {package_version(name)}" for name in PACKAGES],
    }
    save_camera(path, calibration.camera, made)


def load_camera(path: Path) -> Camera:
    """Read a camera file.

    Raises:
        UserError: If the file cannot be read, a key is missing or its value is of another kind.
    """
    content = read_json(path, "camera")
    if not isinstance(content, dict):
        raise UserError(f"{path}: a camera has image_width, image_height, camera_matrix and more")
    width, height = (_number(content, name, path) for name in ("image_width", "image_height"))
    matrix = _matrix(content, "camera_matrix", path, sizes=(9,)).reshape(3, 3)
    if content.get("fisheye_model"):
        raise UserError(f"{path}: its lens is a fisheye, which is not read; calibrate with pinnray calibrate")
    distortion = _matrix(content, "distortion_coefficients", path, sizes=(4, 5))
    coefficients = tuple(np.resize([*distortion, 0.0], 5).tolist())
    fx, fy, cx, cy = matrix[[0, 1, 0, 1], [0, 1, 2, 2]].tolist()
    size, covariance = len(INTRINSICS), None
    if "intrinsics_covariance" in content:
        rows = _matrix(content, "intrinsics_covariance", path, sizes=(size**2,)).reshape(size, size)
        covariance = tuple(map(tuple, rows.tolist()))
    try:
        return Camera(width, height, fx, fy, cx, cy, coefficients, covariance)
    except UserError as error:
        raise UserError(f"{path}: {error}") from None


def check_format(path: Path) -> None:
    """Raise `UserError` unless the suffix is .json."""
    if path.suffix.lower() != ".json":
        raise UserError(f"{path}: a camera is written as JSON; give a name that ends in .json")


def _entry(rows: Sequence[Sequence[float]]) -> dict[str, object]:
    """A matrix as `cv2.FileStorage` has it."""
    data = [float(value) for row in rows for value in row]
    return {"type_id": "opencv-matrix", "rows": len(rows), "cols": len(rows[0]), "dt": "d", "data": data}


def _number(content: Mapping[str, Any], name: str, path: Path) -> int:
    if not isinstance(value := content.get(name), int):
        fault = "no whole number" if name in content else "missing"
        raise UserError(f"{path}: {name} is {fault}; give pixels")
    return value


def _matrix(content: Mapping[str, Any], name: str, path: Path, *, sizes: tuple[int, ...]) -> FloatArray:
    """The entries of a matrix, whose number must be one of `sizes`."""
    what = f"a matrix of {' or '.join(map(str, sizes))} numbers"
    if name not in content:
        raise UserError(f"{path}: {name} is missing; it must be {what}")
    data = content[name].get("data") if isinstance(content[name], dict) else None
    numbers = data if isinstance(data, list) else []
    if len(numbers) not in sizes or not all(isinstance(value, int | float) for value in numbers):
        raise UserError(f"{path}: {name} is not {what}")
    return np.asarray(numbers, dtype=np.float64)
