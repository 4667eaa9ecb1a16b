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
    """Content of a film besides the finger, and the method that measures it."""

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
