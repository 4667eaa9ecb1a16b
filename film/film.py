"""A film to track: its source, its camera, its fiducials and the colour of the markers."""

from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from pydantic import Field, field_validator

from pinnray.geometry.finger.parameters import CheckedModel
from pinnray.runtime.content_hash import file_digest

if TYPE_CHECKING:  # options are of this class, and `--help` has to be quick
    from pinnray.geometry.finger.finger import Finger
    from pinnray.vision.tracking.scene import FilmedScene


class FilmSettings(CheckedModel):
    """Camera, fiducials, marker colour and tracking method of a film."""

    camera: Path | None = Field(
        default=None, description="Camera file of `pinnray calibrate`; none: the camera is not calibrated"
    )
    workspace: Path | None = Field(
        default=None, description="JSON file of the fiducials; none: those around the design"
    )
    colour: str = Field(default="dark", description="Colour of the markers, as printed by `pinnray pick`")
    method: Literal["precise", "hough"] = Field(
        default="precise", description="Disc detector; hough is the paper's pipeline"
    )
    fps: float | None = Field(
        default=None,
        description="Frames a second of pictures or a pipe, which do not say it; none: 30, with a warning",
    )

    def of(self, source: str) -> "Film":
        """The film from a source, with these settings."""
        return Film(source=source, **self.model_dump())


class Film(FilmSettings):
    """A film.

    Raises:
        UserError: If the camera's or the workspace's file does not exist.
    """

    source: str = Field(
        description='Video, folder or glob of pictures, number of a camera, or "-" for a pipe'
    )

    @field_validator("camera", "workspace")
    @classmethod
    def _there(cls, file: Path | None) -> Path | None:
        if file is not None and not file.is_file():
            raise ValueError("there is no such file")
        return file

    @property
    def live(self) -> bool:
        """Whether the source is a camera or a pipe, which shows something else each time."""
        camera = self.source.removeprefix("/dev/video").isdecimal() and not Path(self.source).is_dir()
        return camera or self.source == "-"

    @property
    def simulated(self) -> bool:
        """Whether the workspace, or a file, is of a film of `pinnray rig`."""
        from pinnray.vision.frames.sources import open_frames
        from pinnray.vision.tracking.workspace import load_workspace

        if self.workspace and load_workspace(self.workspace).simulated:
            return True
        if self.live:
            return False
        with open_frames(self.source, rate=self.fps) as frames:
            return frames.simulated

    def scene(self, design: "Finger") -> "FilmedScene":
        """The filmed scene of a finger.

        Raises:
            UserError: If a file cannot be read.
        """
        from pinnray.vision.calibration.camera_file import load_camera
        from pinnray.vision.discs.colour import read_colour
        from pinnray.vision.tracking.scene import FilmedScene
        from pinnray.vision.tracking.workspace import default_workspace, load_workspace

        return FilmedScene(
            design=design,
            workspace=load_workspace(self.workspace) if self.workspace else default_workspace(design),
            camera=load_camera(self.camera) if self.camera else None,
            colour=read_colour(self.colour),
            method=self.method,
            markers_only=self.workspace is None,
        )

    def provenance(self) -> dict[str, Any]:
        """Source and settings, with the SHA-256 of every file."""
        files = {"video": Path(self.source), "camera": self.camera, "workspace": self.workspace}
        hashes = {
            f"{name}_sha256": file_digest(path) for name, path in files.items() if path and path.is_file()
        }
        return self.model_dump(include={"source", "colour", "method", "fps"}) | hashes
