"""A film to track: its source, its camera, its fiducials and the colour of the markers."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from pinnray.geometry.finger.finger import Finger
from pinnray.runtime.content_hash import file_digest

if TYPE_CHECKING:  # it imports OpenCV
    from pinnray.vision.tracking.scene import FilmedScene


@dataclass(frozen=True)
class Film:
    """A film.

    Attributes:
        source: Video, folder or glob of pictures, number of a camera, or "-".
        camera: Camera file, as `pinnray calibrate` writes it; None if the camera is not calibrated.
        workspace: JSON file of the fiducials; those around the design if None.
        colour: Colour of the markers, as printed by `pinnray pick`.
        method: Detector of the discs; "hough" is the paper's pipeline.
        fps: Frames a second of pictures or a pipe, which do not say it.
    """

    source: str
    camera: Path | None = None
    workspace: Path | None = None
    colour: str = "dark"
    method: Literal["precise", "hough"] = "precise"
    fps: float | None = None

    def scene(self, design: Finger) -> "FilmedScene":
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
        settings = {"colour": self.colour, "method": self.method, "fps": self.fps}
        return {"source": self.source, **settings, **hashes}
