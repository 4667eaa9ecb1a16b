"""Options of a film to track and of the virtual rig, and the objects that they describe."""

import re
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from cyclopts import Group, Parameter

from pinnray.options.shared import Flag, Repeated, existing
from pinnray.runtime.errors import UserError

if TYPE_CHECKING:  # `--help` has to be quick: what options describe is imported when they are read
    from pinnray.film.film import Film
    from pinnray.geometry.finger.finger import Finger
    from pinnray.geometry.mesh.triangle_mesh import TriangleMesh
    from pinnray.solvers.physics import Material
    from pinnray.vision.calibration.camera import Camera, Pose
    from pinnray.vision.calibration.chessboard import Board
    from pinnray.vision.rig.bench import Bench
    from pinnray.vision.tracking.workspace import Workspace

CAMERA = Group("Camera", sort_key=4)
FORCE = Group("Force", sort_key=5)
EXPOSURE = Group("Exposure", sort_key=5)
MOTION = Group("Motion", sort_key=6)
SCENE = Group("Scene", sort_key=7)
BOARDS = Group("Calibration", sort_key=8)

MOST_PIXELS = 4_000_000
"""Largest frame: its cells, up to 16 per pixel, have to fit into the memory."""


@Parameter(name="*", group=CAMERA)
@dataclass(frozen=True, kw_only=True)
class FilmOptions:
    """Camera, fiducials, marker colour and tracking method of a film.

    Attributes:
        camera: Camera file of `pinnray calibrate`.
        workspace: JSON file of the fiducials; default: those around the design.
        colour: Colour of the markers, as printed by `pinnray pick`.
        method: Disc detector; hough is the paper's pipeline.
        fps: Frames a second of pictures or a pipe, which do not say it; default: 30, with a warning.
    """

    camera: Path | None = None
    workspace: Path | None = None
    colour: str = "dark"
    method: Literal["precise", "hough"] = "precise"
    fps: float | None = None

    def film(self, source: str) -> "Film":
        """The film from `source`.

        Raises:
            UserError: If the camera's or the workspace's file does not exist.
        """
        from pinnray.film.film import Film

        return Film(
            source,
            camera=existing(self.camera),
            workspace=existing(self.workspace),
            colour=self.colour,
            method=self.method,
            fps=self.fps,
        )


@Parameter(name="*", group=FORCE)
@dataclass(frozen=True, kw_only=True)
class ForceOptions:
    """The force from the markers.

    Attributes:
        force: Estimate the indenter's force and its place in every frame; with --live in the newest one.
        young: Young's modulus for --force, MPa, default 11.4; the force is in proportion to it.
        poisson: Poisson's ratio for --force, default 0.45; the markers correct it.
        law: Material law for --force; default: the more probable one by the markers.
    """

    force: Flag = False
    young: float | None = None
    poisson: float | None = None
    law: Literal["neo-hookean", "st-venant-kirchhoff"] | None = None

    def read(self) -> "Material | None":
        """The material; None without --force.

        Raises:
            UserError: If a constant is out of its range or given without --force.
        """
        from pinnray.solvers.physics import Material

        given: dict[str, Any] = {
            name: value for name in ("young", "poisson", "law") if (value := getattr(self, name)) is not None
        }
        if given and not self.force:
            raise UserError(f"--{next(iter(given))} is for --force")
        return Material(**given) if self.force else None


@Parameter(name="*", group=CAMERA)
@dataclass(frozen=True, kw_only=True)
class CameraOptions:
    """The camera and its pose.

    Attributes:
        size: Size of the frames, pixels.
        camera: Camera file; default: a camera of that size.
        tilt: Angle between the optical axis and the finger's z axis, degrees, up to 30.
        tilt_direction: Direction of the tilt axis in the image, from right to down, degrees.
        turn: Rotation of the camera about its optical axis, degrees.
    """

    size: str = "1280x720"
    camera: Path | None = None
    tilt: float = 0.0
    tilt_direction: float = 60.0
    turn: float = 0.0

    def read(self, workspace: "Workspace") -> "tuple[Camera, Pose]":
        """The camera and its pose."""
        from pinnray.vision.calibration.camera_file import load_camera
        from pinnray.vision.rig.virtual_camera import default_camera, viewing_pose

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
    """Paint, print and occlusion of the markers.

    Attributes:
        paint: Colour of the markers.
        irregular: Deviation of the markers' outlines from circles, rms over the radius, up to 0.1.
        marker_plane: Height of the markers above the fiducials, mm.
        cover: Cover a share of a marker's diameter with a cable, such as 5=0.4; may be repeated.
        cover_paint: Colour of the cables.
        cover_during: Part of the film that shows the cables.
    """

    paint: Literal["dark", "red", "green", "blue"] = "dark"
    irregular: float = 0.0
    marker_plane: float = 0.0
    cover: Repeated = ()
    cover_paint: Literal["dark", "light"] = "dark"
    cover_during: Literal["all", "rest", "moving", "held"] = "all"

    def bench(self, mesh: "TriangleMesh", finger: "Finger", workspace: "Workspace") -> "Bench":
        """The finger on the bench, with markers as they are printed.

        Raises:
            UserError: If a share is out of its range.
        """
        from pinnray.vision.rig.bench import Bench

        if not 0 <= self.irregular <= 0.1:
            raise UserError(f"--irregular {self.irregular:g}: give a share from 0 to 0.1")
        return Bench(mesh, finger, workspace, self.paint, self.irregular)

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
    """Photographs of a calibration board.

    Attributes:
        boards: Number of photographs.
        board: Board as for `pinnray calibrate`: 9x6, charuco:8x6.
        square: Side of a square, mm.
        marker: Side of a marker of a ChArUco board, mm.
    """

    boards: int = 0
    board: str = "9x6"
    square: float = 8.0
    marker: float | None = None

    def read(self) -> "Board":
        """The board."""
        from pinnray.vision.calibration.charuco import parse_board

        if not 0 <= self.boards <= 1000:
            raise UserError(f"--boards {self.boards}: give 0 to 1000 photographs")
        return parse_board(self.board, self.square, marker=self.marker)
