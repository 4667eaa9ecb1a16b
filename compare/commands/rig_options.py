"""Options of the virtual rig, and the objects that they describe."""

import re
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from cyclopts import Group, Parameter

from geometry.errors import UserError
from vision.tracking.workspace import Workspace

if TYPE_CHECKING:  # OpenCV comes with them, and `--help` has to be quick
    from vision.calibration.camera import Camera, Pose
    from vision.calibration.chessboard import Board

CAMERA = Group("Camera", sort_key=4)
EXPOSURE = Group("Exposure", sort_key=5)
MOTION = Group("Motion", sort_key=6)
SCENE = Group("Scene", sort_key=7)
BOARDS = Group("Calibration", sort_key=8)

MOST_PIXELS = 4_000_000
"""Largest frame: its cells, up to 16 per pixel, have to fit into the memory."""


@Parameter(name="*", group=CAMERA)
@dataclass(frozen=True, kw_only=True)
class CameraOptions:
    """The camera and its pose."""

    size: Annotated[str, Parameter(help="Size of the frames, pixels.")] = "1280x720"
    camera: Annotated[
        Path | None, Parameter(show_default=False, help="Camera file; default: a camera of that size.")
    ] = None
    tilt: Annotated[
        float, Parameter(help="Angle between the optical axis and the finger's z axis, degrees, up to 30.")
    ] = 0.0
    tilt_direction: Annotated[
        float, Parameter(help="Direction of the tilt axis in the image, from right to down, degrees.")
    ] = 60.0
    turn: Annotated[float, Parameter(help="Rotation of the camera about its optical axis, degrees.")] = 0.0

    def read(self, workspace: Workspace) -> "tuple[Camera, Pose]":
        """The camera and its pose."""
        from vision.calibration.camera_file import load_camera
        from vision.rig.virtual_camera import default_camera, viewing_pose

        if not (found := re.fullmatch(r"(\d{2,4})x(\d{2,4})", self.size.strip())):
            raise UserError(f"--size {self.size}: give width and height in pixels, such as 1280x720")
        if not abs(self.tilt) <= 30:
            raise UserError(f"--tilt {self.tilt:g}: the camera looks down on the finger; give -30 to 30")
        camera = load_camera(self.camera) if self.camera else default_camera(int(found[1]), int(found[2]))
        if camera.width * camera.height > MOST_PIXELS:
            raise UserError(
                f"frames of {camera.width}x{camera.height} pixels; the rig makes up to "
                f"{MOST_PIXELS // 1_000_000} million"
            )
        pose = viewing_pose(camera, workspace, tilt=self.tilt, direction=self.tilt_direction, turn=self.turn)
        return camera, pose


@Parameter(name="*", group=SCENE)
@dataclass(frozen=True, kw_only=True)
class SceneOptions:
    """Paint and occlusion of the markers."""

    paint: Annotated[Literal["dark", "red", "green", "blue"], Parameter(help="Colour of the markers.")] = (
        "dark"
    )
    marker_plane: Annotated[float, Parameter(help="Height of the markers above the fiducials, mm.")] = 0.0
    cover: Annotated[
        tuple[str, ...],
        Parameter(
            negative="",
            show_default=False,
            help="Cover a share of a marker's diameter with a cable, such as 5=0.4; may be repeated.",
        ),
    ] = ()
    cover_paint: Annotated[Literal["dark", "light"], Parameter(help="Colour of the cables.")] = "dark"
    cover_during: Annotated[
        Literal["all", "rest", "moving", "held"], Parameter(help="Part of the film that shows the cables.")
    ] = "all"

    def covered(self) -> dict[int, float]:
        """The shares of --cover by the numbers of the markers."""
        shares = {}
        for text in self.cover:
            if not (found := re.fullmatch(r"(\d+)=(\d*\.?\d+)", text.strip())):
                raise UserError(f"--cover {text}: write marker=share, such as 5=0.4")
            shares[int(found[1])] = float(found[2])
        return shares


@Parameter(name="*", group=BOARDS)
@dataclass(frozen=True, kw_only=True)
class BoardOptions:
    """Photographs of a calibration board."""

    boards: Annotated[int, Parameter(help="Number of photographs of a calibration board.")] = 0
    board: Annotated[str, Parameter(help="Board as for `pinnray calibrate`: 9x6, charuco:8x6.")] = "9x6"
    square: Annotated[float, Parameter(help="Side of a square, mm.")] = 8.0
    marker: Annotated[
        float | None, Parameter(show_default=False, help="Side of a marker of a ChArUco board, mm.")
    ] = None

    def read(self) -> "Board":
        """The board."""
        from vision.calibration.board_parser import parse_board

        if not 0 <= self.boards <= 1000:
            raise UserError(f"--boards {self.boards}: give 0 to 1000 photographs")
        return parse_board(self.board, self.square, marker=self.marker)
