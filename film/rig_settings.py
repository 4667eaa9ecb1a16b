"""Settings of the virtual rig besides finger, load, exposure and motion: camera, markers, boards."""

import re
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from pydantic import Field

from pinnray.geometry.finger.parameters import CheckedModel, bounded
from pinnray.runtime.errors import UserError

if TYPE_CHECKING:  # options are of this class, and `--help` has to be quick
    from pinnray.geometry.finger.finger import Finger
    from pinnray.vision.calibration.camera import Camera, Pose
    from pinnray.vision.calibration.chessboard import Board
    from pinnray.vision.tracking.workspace import Workspace

MOST_PIXELS = 4_000_000
"""Largest frame: its cells, up to 16 per pixel, have to fit into the memory."""


class RigSettings(CheckedModel):
    """Camera, markers and calibration boards of the virtual rig."""

    frame: str = Field(default="1280x720", description="Width and height of the frames, pixels")
    camera: Path | None = Field(default=None, description="Camera file; none: a camera of that size")
    tilt: float = bounded(0.0, -30, 30, "Angle between the optical axis and the finger's z axis", "deg")
    tilt_direction: float = bounded(
        60.0, -360, 360, "Direction of the tilt axis in the image, from right to down", "deg"
    )
    turn: float = bounded(0.0, -360, 360, "Rotation of the camera about its optical axis", "deg")
    paint: Literal["dark", "red", "green", "blue"] = Field(
        default="dark", description="Colour of the markers"
    )
    irregular: float = bounded(
        0.0, 0, 0.1, "Deviation of the markers' outlines from circles, rms over the radius"
    )
    marker_plane: float = bounded(0.0, -1000, 1000, "Height of the markers above the fiducials", "mm")
    boards: int = bounded(0, 0, 1000, "Number of photographs of a calibration board")
    board: str = Field(default="9x6", description="Board as for `pinnray calibrate`: 9x6, charuco:8x6")
    square: float = Field(default=8.0, description="Side of a square of the board [mm]")
    marker: float | None = Field(default=None, description="Side of a marker of a ChArUco board [mm]")

    def sheet(self) -> "Board":
        """The calibration board.

        Raises:
            UserError: If it cannot be read.
        """
        from pinnray.vision.calibration.charuco import parse_board

        return parse_board(self.board, self.square, marker=self.marker)

    def view(self, finger: "Finger") -> "tuple[Workspace, Camera, Pose]":
        """The fiducials around a finger, the camera and its pose.

        Raises:
            UserError: If the frame or the camera's file cannot be read, or the frames are too large.
        """
        from pinnray.vision.calibration.camera_file import load_camera
        from pinnray.vision.rig.virtual_camera import default_camera, viewing_pose
        from pinnray.vision.tracking.workspace import default_workspace

        if not (found := re.fullmatch(r"(\d{2,4})x(\d{2,4})", self.frame.strip())):
            raise UserError(f"frame {self.frame}: give width and height in pixels, such as 1280x720")
        camera = load_camera(self.camera) if self.camera else default_camera(int(found[1]), int(found[2]))
        if camera.width * camera.height > MOST_PIXELS:
            raise UserError(
                f"frames of {camera.width}x{camera.height} pixels; the rig makes up to "
                f"{MOST_PIXELS // 1_000_000} million"
            )
        workspace = default_workspace(finger).model_copy(update={"marker_plane": self.marker_plane})
        pose = viewing_pose(camera, workspace, tilt=self.tilt, direction=self.tilt_direction, turn=self.turn)
        return workspace, camera, pose
