"""Measured displacements from files, tables and films."""

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from pinnray.geometry.finger.parameters import MARKER
from pinnray.geometry.observations import Observations
from pinnray.runtime.errors import UserError

if TYPE_CHECKING:
    import pandas as pd


def load_measurements(
    source: "str | Path | pd.DataFrame", *, marker_radius: float = MARKER / 2
) -> Observations:
    """Measured displacements from a CSV file or a data frame with the columns x_mm, y_mm, u_mm, v_mm.

    Args:
        source: The file or the data frame; see `pinnray.vision.measurements` for further columns.
        marker_radius: Radius of the markers' discs, mm; the default design's, `design.marker_radius` is that
            of another one.

    Raises:
        UserError: If the table cannot be read; the message names the line or row.
    """
    from pinnray.runtime.tables import columns_of
    from pinnray.vision.measurements import TITLES, measurements_of, read_measurements

    if isinstance(source, str | Path):
        return read_measurements(Path(source), marker_radius=marker_radius)
    if not hasattr(source, "itertuples"):
        kind = type(source).__name__
        raise UserError(f"measurements that are a {kind}; give a data frame, Observations, or a file")
    name = "the data frame"
    places = columns_of(list(map(str, source.columns)), *TITLES, name)
    rows = [
        (f"row {label}", {column: _cell(cells[place]) for column, place in places.items()})
        for label, *cells in source.itertuples(index=True, name=None)
    ]
    return measurements_of(
        rows, marker_radius=marker_radius, table=name, source="measurements from a data frame"
    )


def _cell(value: object) -> str:
    """A value as a file would have it: a missing one is empty, a truth value 1 or 0."""
    if value is None or value != value or str(value) in ("<NA>", "NaT"):  # only NaN differs from itself
        return ""
    return str(int(value)) if isinstance(value, bool | np.bool_) else str(value).strip()
