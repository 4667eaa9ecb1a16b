"""Camera files: JSON or YAML with the keys of OpenCV's calibration sample, readable by `cv2.FileStorage`."""

import re
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np

from pinnray.runtime.arrays import FloatArray
from pinnray.runtime.atomic import write_text
from pinnray.runtime.errors import UserError
from pinnray.vision.calibration.camera import Camera
from pinnray.vision.calibration.camera_calibration import Calibration

Entry = int | float | str | list[str] | FloatArray
FORMATS = (".json", ".yml", ".yaml")
DEEPEST = 100
"""Depth of nested brackets in a camera file; its own have three."""
MARKS = re.compile(r"^(?:---|\.\.\.|%).*$", re.MULTILINE)
"""Lines of YAML between documents."""
ONE_DOCUMENT: tuple[list[str], ...] = ([], ["---"], ["---", "..."])
"""Those of a camera file after its first line. Where there are others, OpenCV's reader may never end."""


def save_camera(path: Path, camera: Camera) -> None:
    """Write a camera atomically, as JSON or YAML by the suffix; `load_camera` restores it.

    Raises:
        UserError: If the suffix is none of `FORMATS`.
    """
    _write(path, _content(camera))


def save_calibration(path: Path, calibration: Calibration, versions: Mapping[str, str] | None = None) -> None:
    """Write a camera with its errors, coverage, board and the versions of the programs that made it.

    Raises:
        UserError: If the suffix is none of `FORMATS`.
    """
    board, errors = calibration.board, calibration.view_errors
    _write(
        path,
        _content(calibration.camera)
        | {
            "avg_reprojection_error": calibration.rms,
            "held_out_reprojection_error": calibration.held_out_rms,
            "coverage": calibration.coverage,
            "nframes": len(errors),
            "image_names": list(errors),
            "per_view_reprojection_errors": np.array([list(errors.values())]).T,
            "board": type(board).__name__,
            "board_width": board.columns,
            "board_height": board.rows,
            "square_size": board.square,
            "versions": [f"{name} {version}" for name, version in (versions or {}).items()],
        },
    )


def load_camera(path: Path) -> Camera:
    """Read a camera file of this program or of OpenCV's calibration sample.

    Raises:
        UserError: If the file cannot be read, a key is missing or its value is of another kind.
    """
    try:
        text = path.read_text(encoding="utf-8-sig")
        if _depth(text) > DEEPEST:  # OpenCV's reader ends the process
            raise UserError(f"cannot read the camera {path}: it is nested too deeply")
        marks = [mark.rstrip() for mark in MARKS.findall(text)]
        if text.startswith("%") and marks[1:] not in ONE_DOCUMENT:
            raise UserError(f"cannot read the camera {path}: it is not one YAML document as OpenCV writes it")
        storage = cv2.FileStorage(text, cv2.FileStorage_READ | cv2.FileStorage_MEMORY)
        return _camera(storage, path)  # OpenCV finds some faults only where it looks for a key
    except OSError as error:
        raise UserError(f"cannot read the camera {path}: {error.strerror}") from None
    except (UnicodeDecodeError, cv2.error, SystemError):
        raise UserError(
            f"cannot read the camera {path}: it is not JSON or YAML as OpenCV writes it"
        ) from None


def check_format(path: Path) -> None:
    """Raise `UserError` unless the suffix is one of `FORMATS`."""
    if path.suffix.lower() not in FORMATS:
        raise UserError(f"{path}: a camera is written as {', '.join(FORMATS)}; give a name that ends so")


def _camera(storage: cv2.FileStorage, path: Path) -> Camera:
    width, height = (_number(storage, name, path) for name in ("image_width", "image_height"))
    matrix = _matrix(storage, "camera_matrix", path, sizes=(9,)).reshape(3, 3)
    model = "fisheye" if storage.getNode("fisheye_model").real() else "brown"
    sizes = (4,) if model == "fisheye" else (4, 5)
    distortion = _matrix(storage, "distortion_coefficients", path, sizes=sizes)
    coefficients = tuple(np.resize([*distortion, 0.0], max(sizes)).tolist())
    fx, fy, cx, cy = matrix[[0, 1, 0, 1], [0, 1, 2, 2]].tolist()
    try:
        camera = Camera(width, height, fx, fy, cx, cy, coefficients, model)
        return replace(camera, covariance=_covariance(storage, len(camera.intrinsic_names), path))
    except UserError as error:
        raise UserError(f"{path}: {str(error).removeprefix(f'{path}: ')}") from None


def _content(camera: Camera) -> dict[str, Entry]:
    content: dict[str, Entry] = {
        "image_width": camera.width,
        "image_height": camera.height,
        "fisheye_model": int(camera.model == "fisheye"),
        "camera_matrix": camera.matrix,
        "distortion_coefficients": np.array([camera.distortion]),
    }
    if camera.covariance is not None:
        content["intrinsics"] = list(camera.intrinsic_names)
        content["intrinsics_standard_deviations"] = np.array([camera.standard_deviations])
        content["intrinsics_covariance"] = np.array(camera.covariance)
    return content


def _write(path: Path, content: Mapping[str, Entry]) -> None:
    check_format(path)
    storage = cv2.FileStorage(path.suffix.lower(), cv2.FileStorage_WRITE | cv2.FileStorage_MEMORY)
    for name, value in content.items():
        storage.write(name, value)
    write_text(path, storage.releaseAndGetString())


def _depth(text: str) -> int:
    """Number of brackets that are open at once, outside quoted texts."""
    steps = [
        1 if bracket in "[{" else -1 for bracket in re.findall(r"[\[\]{}]", re.sub(r'"[^"]*"', "", text))
    ]
    return int(np.cumsum([0, *steps]).max())


def _covariance(storage: cv2.FileStorage, size: int, path: Path) -> tuple[tuple[float, ...], ...] | None:
    """The covariance in the file, or a diagonal one from standard deviations, or None."""
    if not storage.getNode("intrinsics_covariance").empty():
        covariance = _matrix(storage, "intrinsics_covariance", path, sizes=(size**2,)).reshape(size, size)
    elif not storage.getNode("intrinsics_standard_deviations").empty():
        deviations = _matrix(storage, "intrinsics_standard_deviations", path, sizes=(size,))
        if (deviations < 0).any():
            raise UserError("a standard deviation is below zero")
        covariance = np.diag(deviations**2)
    else:
        return None
    return tuple(map(tuple, covariance.tolist()))


def _number(storage: cv2.FileStorage, name: str, path: Path) -> int:
    node = storage.getNode(name)
    if not node.isInt():
        raise UserError(f"{path}: {name} is {'missing' if node.empty() else 'no whole number'}; give pixels")
    return int(node.real())


def _matrix(storage: cv2.FileStorage, name: str, path: Path, *, sizes: tuple[int, ...]) -> FloatArray:
    """The entries of a matrix, whose number must be one of `sizes`."""
    node = storage.getNode(name)
    what = f"a matrix of {' or '.join(map(str, sizes))} numbers"
    if node.empty():
        raise UserError(f"{path}: {name} is missing; it must be {what}")
    try:
        values = np.asarray(node.mat(), dtype=np.float64).ravel()
    except (cv2.error, SystemError, TypeError):
        values = np.empty(0)
    if len(values) not in sizes:
        raise UserError(f"{path}: {name} is not {what}")
    return values
