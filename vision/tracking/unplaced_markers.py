"""Says why the markers of a first frame are not where the design has them, such as another plane."""

from contextlib import suppress

import cv2
import numpy as np

from pinnray.runtime.arrays import FloatArray
from pinnray.runtime.errors import UserError
from pinnray.vision.discs.disc_detector import DiscDetections
from pinnray.vision.tracking.layout_matching import match_layout
from pinnray.vision.tracking.marker_plane import MarkerPlane
from pinnray.vision.tracking.scene import FilmedScene

MOST_ZOOM = 3.0
"""Largest ratio of two focal lengths that is told as a cause."""
NOTABLE = 0.01
"""Relative difference of scale that a plane beside that of the fiducials explains."""


def why_unplaced(scene: FilmedScene, plane: MarkerPlane, discs: DiscDetections) -> str:
    """A clause on the likely cause and its remedy.

    Args:
        scene: The filmed scene.
        plane: In which the markers were expected.
        discs: Discs of about their size in the first frame.
    """
    height = scene.workspace.marker_plane
    if height and scene.camera is None:
        return (
            f"the workspace has them {height:g} mm nearer to the camera than the fiducials, which only a "
            f"calibrated camera accounts for: give its file, or lay the fiducials at the markers' height and "
            "set marker_plane to 0"
        )
    scale = _scale(scene, plane, discs)
    if scale is None:
        return (
            "show the finger before it is pressed, and give its design, workspace and markers' colour; if "
            "markers are nearer to the camera than the fiducials, give the camera and a workspace with their "
            "marker_plane"
        )
    if abs(scale - 1) < NOTABLE:
        return (
            "discs lie as the markers do, but beside them: see where the fiducials lie around the finger, "
            "and give the workspace"
        )
    far = None if scene.camera is None or scene.method == "hough" else camera_height(plane)
    about = "" if far is None else f" by about {height + (far - height) * (1 - 1 / scale):.0f} mm"
    side = "nearer to the camera" if scale > 1 else "farther from the camera"
    assumed = f"{height:g} mm above" if height else "in the plane of"
    camera = "" if scene.camera else "the camera's file and "
    return (
        f"discs lie as the markers do, but {scale:.2f} times as far apart: they seem to be {side} than the "
        f"fiducials{about}, not {assumed} them; give {camera}a workspace with that marker_plane, which "
        "pinnray fiducials makes, or see at what scale the fiducials are printed"
        + zoom_clause(scene, plane, scale - 1)
    )


def _scale(scene: FilmedScene, plane: MarkerPlane, discs: DiscDetections) -> float | None:
    """Extent of discs that lie as the markers do over that of the markers; None if there are none."""
    design = scene.design
    with suppress(UserError):
        numbers = match_layout(discs.centres, discs.radii, design.markers, design.marker_diameter)
        seen = numbers >= 0
        return _extent(plane.points(discs.centres[numbers[seen]])) / _extent(design.markers[seen])
    return None


def _extent(places: FloatArray) -> float:
    return float(np.sqrt(((places - places.mean(axis=0)) ** 2).sum()))


def camera_height(plane: MarkerPlane) -> float:
    """Distance of a calibrated camera from the plane of the fiducials, mm."""
    rotation = np.asarray(cv2.Rodrigues(plane.parameters[:3])[0], np.float64)
    return abs(float((rotation.T @ plane.parameters[3:6])[2]))


def zoom_clause(scene: FilmedScene, plane: MarkerPlane, larger: float) -> str:
    """A clause on another focal length that makes lengths between the markers larger by a share, or nothing.

    With another focal length f the fiducials seem to be at another distance d ~ f, from which the markers'
    height h above them makes them larger by d / (d - h).
    """
    height = scene.workspace.marker_plane
    if scene.camera is None or scene.method == "hough" or not height:
        return ""
    seeming = camera_height(plane)
    ratio = height / (1 - (1 - height / seeming) / (1 + larger)) / seeming
    if not 1 / MOST_ZOOM < ratio < MOST_ZOOM:
        return ""
    size = "longer" if ratio > 1 else "shorter"
    return (
        ", and whether zoom and focus are those of the calibration: a focal length "
        f"{abs(ratio - 1):.0%} {size} than calibrated would explain it"
    )
