"""Marker displacements as a CSV file: one row a marker, ordered from base to tip, units in the header."""

import csv
from pathlib import Path

import numpy as np

from geometry.errors import UserError
from geometry.observations import Observations

REQUIRED = ("x_mm", "y_mm", "u_mm", "v_mm")
OPTIONAL = {"std_u_mm": 0.0, "std_v_mm": 0.0, "visible": 1.0}
SOURCE_MARK = "# source: "
SIMULATED_MARK = "# simulated"


def write_measurements(path: Path, observations: Observations) -> None:
    """Write observations; `read_measurements` gives the same back."""
    with path.open("w", newline="", encoding="utf-8") as file:
        if observations.simulated:
            file.write(f"{SIMULATED_MARK}\n")
        file.write(f"{SOURCE_MARK}{observations.source}\n")
        writer = csv.writer(file)
        writer.writerow(["marker", *REQUIRED, *OPTIONAL])
        columns = zip(
            observations.points,
            observations.displacements,
            observations.standard_deviations,
            observations.visible,
            strict=True,
        )
        for number, (point, displacement, deviation, visible) in enumerate(columns, start=1):
            numbers = (repr(float(value)) for value in (*point, *displacement, *deviation))
            writer.writerow([number, *numbers, int(visible)])


def read_measurements(path: Path) -> Observations:
    """Read observations.

    The columns `x_mm, y_mm` (initial position in the finger's frame) and `u_mm, v_mm` (displacement, final minus initial) are
    needed; `std_u_mm, std_v_mm` (standard deviations) and `visible` (1 or 0) may be left out. Comment lines start with `#`;
    `# source: TEXT` says where the numbers come from and `# simulated` that no camera was involved.

    Raises:
        UserError: If the file cannot be read, a column is missing or a value is no number; it names the line.
    """
    try:
        lines = path.read_text(encoding="utf-8").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        reason = error.strerror if isinstance(error, OSError) else "it is not a UTF-8 text"
        raise UserError(f"cannot read the measurements {path}: {reason}") from None
    table = [(number, line) for number, line in enumerate(lines, start=1) if line.strip() and line[0] != "#"]
    header = [name.strip() for name in table[0][1].split(",")] if table else []
    missing = [name for name in REQUIRED if name not in header]
    if missing:
        raise UserError(
            f"{path} has no column {missing[0]}; the header must name {', '.join(REQUIRED)} "
            f"and may name {', '.join(OPTIONAL)}"
        )
    if len(table) == 1:
        raise UserError(f"{path} has a header but no marker")
    rows = {name: np.empty(len(table) - 1) for name in (*REQUIRED, *OPTIONAL)}
    for index, (number, line) in enumerate(table[1:]):
        cells = dict(zip(header, next(csv.reader([line])), strict=False))
        for name, column in rows.items():
            column[index] = _number(cells.get(name, str(OPTIONAL.get(name, ""))), name, path, number)
    comments = [line for line in lines if line.startswith("#")]
    sources = [line.removeprefix(SOURCE_MARK) for line in comments if line.startswith(SOURCE_MARK)]
    return Observations(
        points=np.column_stack([rows["x_mm"], rows["y_mm"]]),
        displacements=np.column_stack([rows["u_mm"], rows["v_mm"]]),
        standard_deviations=np.column_stack([rows["std_u_mm"], rows["std_v_mm"]]),
        visible=rows["visible"] != 0,
        source=sources[0] if sources else f"measurements from {path.name}",
        simulated=SIMULATED_MARK in (line.strip() for line in comments),
    )


def _number(text: str, name: str, path: Path, line: int) -> float:
    try:
        value = float(text)
    except ValueError:
        value = float("nan")
    if not np.isfinite(value):
        raise UserError(f"{path}, line {line}: {name} is {text.strip()!r}, which is not a number")
    return value
