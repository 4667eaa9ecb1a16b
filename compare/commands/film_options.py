"""Options of the commands that track a film."""

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from cyclopts import Group, Parameter

from compare.camera.film import Film
from compare.commands.options import existing

FILM = Group("Camera", sort_key=4)


@Parameter(name="*", group=FILM)
@dataclass(frozen=True, kw_only=True)
class FilmOptions:
    """Camera, fiducials, marker colour and tracking method of a film.

    Attributes:
        camera: Camera file of `pinnray calibrate`.
        workspace: JSON file of the fiducials; default: those around the design.
        colour: Colour of the markers, as printed by `pinnray pick`.
        method: Disc detector; hough is the paper's pipeline.
    """

    camera: Path | None = None
    workspace: Path | None = None
    colour: str = "dark"
    method: Literal["precise", "hough"] = "precise"

    def film(self, source: str) -> Film:
        """The film from `source`.

        Raises:
            UserError: If the camera's or the workspace's file does not exist.
        """
        return Film(
            source,
            camera=existing(self.camera),
            workspace=existing(self.workspace),
            colour=self.colour,
            method=self.method,
        )
