"""The plane that is photographed: fiducials around the finger, whose places in its frame are known.

The fiducials are dark discs, printed or drilled, that do not move with the finger. Their layout looks like no
turned or mirrored copy of itself, so that each is known by its place even where some are hidden. Units: mm.
"""

from itertools import product
from typing import Self

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from geometry.arrays import FloatArray
from geometry.errors import UserError
from geometry.finger.parameters import Parameters

MARGIN = 12.0
"""Between the finger's bounding box, before loading, and the lines of the fiducials."""

Point = tuple[float, float]


class Workspace(BaseModel):
    """What surrounds the finger in the image, in the finger's frame: x to the tip, y out of the front face.

    Attributes:
        fiducials: Centres of the fiducials, in the plane z = 0.
        fiducial_diameter: Of every fiducial.
        marker_plane: z of the markers' plane, positive toward the camera; 0 if the fiducials lie in it.

    Raises:
        UserError: If there are fewer than four fiducials or they nearly lie on one line.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    fiducials: tuple[Point, ...]
    fiducial_diameter: float = Field(default=4.0, gt=0)
    marker_plane: float = 0.0

    def __init__(self, **values: object) -> None:
        try:
            super().__init__(**values)
        except ValidationError as error:
            first = error.errors()[0]
            place = ".".join(map(str, first["loc"]))
            said = first["msg"].removeprefix("Value error, ")
            raise UserError(f"workspace: {f'{place}: ' if place else ''}{said}") from None

    @model_validator(mode="after")
    def _determine_the_plane(self) -> Self:
        if len(self.fiducials) < 4:
            raise ValueError(f"{len(self.fiducials)} fiducials; at least 4 are needed")
        spread = np.linalg.svd(self.points - self.points.mean(axis=0), compute_uv=False)
        if spread[1] < 0.05 * spread[0]:
            raise ValueError("the fiducials lie on a line; spread them around the finger")
        return self

    @property
    def points(self) -> FloatArray:
        """The fiducials' centres, shape (n, 2), mm."""
        return np.array(self.fiducials, dtype=np.float64)


def default_workspace(parameters: Parameters) -> Workspace:
    """Seven fiducials around a finger: four in front of it, which leave the indenter room, three behind."""
    p = parameters
    left, right = -MARGIN, p.height + MARGIN
    front = product((left, 0.15 * p.height, 0.7 * p.height, right), (MARGIN,))
    back = product((left, 0.45 * p.height, right), (-p.base_width - MARGIN,))
    return Workspace(fiducials=(*front, *back))
