"""Measured displacements with their usual defaults, and from tables."""

from dataclasses import fields
from pathlib import Path
from typing import TYPE_CHECKING, Self

import numpy as np
from numpy.typing import ArrayLike

from pinnray.geometry import observations
from pinnray.geometry.finger.parameters import MARKER
from pinnray.geometry.registration import FIXED, Registration
from pinnray.runtime.errors import UserError
from pinnray.runtime.text_files import as_path

if TYPE_CHECKING:
    import pandas as pd


class Observations(observations.Observations):
    """Marker displacements, final minus initial position: `Observations(points, displacements)` is enough.

    Args:
        points: Initial positions, shape (m, 2), mm.
        displacements: Shape (m, 2), mm.
        standard_deviations: Of the displacements, one for all or shape (m, 2), mm; 0 where unknown.
        visible: Which markers were seen, shape (m,); all if None.
        source: One sentence on the origin of the numbers.
        simulated: True if no camera was involved.
        marker_radius: Radius of the markers' discs, mm; the default design's, `design.marker_radius` is that
            of another one.
        pressed: Registration of the pressed picture with that at rest.
        drawn: Registration of the picture at rest with the drawing.

    Raises:
        UserError: If the arrays do not fit together, or a value is impossible.
    """

    def __init__(
        self,
        points: ArrayLike,
        displacements: ArrayLike,
        standard_deviations: ArrayLike = 0.0,
        visible: ArrayLike | None = None,
        source: str = "measurements given as arrays",
        simulated: bool = False,
        marker_radius: float = MARKER / 2,
        pressed: Registration = FIXED,
        drawn: Registration = FIXED,
    ) -> None:
        count = np.shape(np.asarray(points, dtype=object))[:1] or (1,)
        if np.ndim(np.asarray(standard_deviations, dtype=object)) == 0:
            standard_deviations = np.full((*count, 2), standard_deviations)
        super().__init__(
            points,  # type: ignore[arg-type] # the class checks and converts them
            displacements,  # type: ignore[arg-type]
            standard_deviations,  # type: ignore[arg-type]
            np.ones(count, bool) if visible is None else visible,  # type: ignore[arg-type]
            source,
            simulated,
            marker_radius,
            pressed,
            drawn,
        )

    @classmethod
    def of(cls, found: observations.Observations) -> Self:
        """The same observations with the constructors of this class."""
        return cls(**{each.name: getattr(found, each.name) for each in fields(found)})

    @classmethod
    def from_csv(cls, path: str | Path, *, marker_radius: float = MARKER / 2) -> Self:
        """Read a CSV file with the columns x_mm, y_mm, u_mm, v_mm; see `pinnray.vision.measurements`.

        Raises:
            UserError: If the file cannot be read; the message names the line.
        """
        from pinnray.vision.measurements import read_measurements

        return cls.of(read_measurements(as_path(path, "the measurements"), marker_radius=marker_radius))

    @classmethod
    def from_dataframe(cls, frame: "pd.DataFrame", *, marker_radius: float = MARKER / 2) -> Self:
        """Take a pandas data frame with the columns of `from_csv`.

        Raises:
            UserError: If a column is missing or a value is no number; the message names the row.
        """
        from pinnray.vision.measurements import measurements_of

        if not hasattr(frame, "itertuples"):
            kind = type(frame).__name__
            raise UserError(f"measurements that are a {kind}; give a data frame, Observations, or a file")
        table = frame.itertuples(index=True, name=None)
        rows = [(f"row {label}", list(map(_cell, cells))) for label, *cells in table]
        found = measurements_of(
            list(map(str, frame.columns)),
            rows,
            marker_radius=marker_radius,
            table="the data frame",
            source="measurements from a data frame",
        )
        return cls.of(found)


def _cell(value: object) -> str:
    """A value as a file would have it: a missing one is empty, a truth value 1 or 0."""
    if value is None or value != value or str(value) in ("<NA>", "NaT"):  # only NaN differs from itself
        return ""
    return str(int(value)) if isinstance(value, bool | np.bool_) else str(value).strip()
