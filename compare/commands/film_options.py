"""Options of the commands that track a film."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

from cyclopts import Group, Parameter

from compare.camera.film import Film
from compare.commands.options import existing

FILM = Group("Camera", sort_key=4)


@Parameter(name="*", group=FILM)
@dataclass(frozen=True, kw_only=True)
class FilmOptions:
    """Camera, fiducials, marker colour and tracking method of a film."""

    camera: Annotated[
        Path | None, Parameter(show_default=False, help="Camera file of `pinnray calibrate`.")
    ] = None
    workspace: Annotated[
        Path | None,
        Parameter(show_default=False, help="JSON file of the fiducials; default: those around the design."),
    ] = None
    colour: Annotated[str, Parameter(help="Colour of the markers, as printed by `pinnray pick`.")] = "dark"
    method: Annotated[
        Literal["precise", "hough"],
        Parameter(help="Disc detector; hough is the paper's pipeline."),
    ] = "precise"

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
