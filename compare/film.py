"""A film to be tracked: where it comes from, and the options that say what it shows."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from cyclopts import Group, Parameter

from compare.options import existing
from compare.provenance import file_digest
from geometry.parameters import Parameters

if TYPE_CHECKING:  # OpenCV comes with it, and `--help` has to be quick
    from vision.setup import Setup

FILM = Group("Camera", sort_key=4)


@Parameter(name="*", group=FILM)
@dataclass(frozen=True, kw_only=True)
class FilmOptions:
    """What a film shows besides the finger, and how it is measured."""

    camera: Annotated[
        Path | None, Parameter(show_default=False, help="Its file, as `pinnray calibrate` writes it.")
    ] = None
    workspace: Annotated[
        Path | None,
        Parameter(
            show_default=False, help="JSON file of the fiducials; those around the design if not given."
        ),
    ] = None
    colour: Annotated[str, Parameter(help="Of the markers, as `pinnray pick` prints it.")] = "dark"
    method: Annotated[
        Literal["precise", "hough"], Parameter(help="How markers are found; hough is the paper's pipeline.")
    ] = "precise"


@dataclass(frozen=True)
class Film:
    """A film.

    Attributes:
        source: Video, folder or glob of pictures, number of a camera, or "-".
        options: What it shows.
    """

    source: str
    options: FilmOptions = FilmOptions()

    def setup(self, design: Parameters) -> "Setup":
        """What it shows of a finger.

        Raises:
            UserError: If a file cannot be read.
        """
        from vision.camera_file import load_camera
        from vision.colour import read_colour
        from vision.setup import Setup
        from vision.workspace import default_workspace
        from vision.workspace_file import load_workspace

        camera, workspace = existing(self.options.camera), existing(self.options.workspace)
        return Setup(
            design=design,
            workspace=load_workspace(workspace) if workspace else default_workspace(design),
            camera=load_camera(camera) if camera else None,
            colour=read_colour(self.options.colour),
            method=self.options.method,
            alone=workspace is None,
        )

    def provenance(self) -> dict[str, Any]:
        """Where the numbers come from, with the hash of every file."""
        files = {
            "video": Path(self.source),
            "camera": self.options.camera,
            "workspace": self.options.workspace,
        }
        hashes = {
            f"{name}_sha256": file_digest(path) for name, path in files.items() if path and path.is_file()
        }
        return {"source": self.source, "colour": self.options.colour, "method": self.options.method, **hashes}
