"""CSV files, written atomically, with a header of names and units."""

import csv
from collections.abc import Sequence
from pathlib import Path

from geometry.atomic import atomic_path

Cell = str | int | float | bool


def write_csv(path: Path, rows: Sequence[dict[str, Cell]]) -> None:
    """Write rows with equal keys under a header, atomically; numbers keep all their digits."""
    with atomic_path(path) as partial, partial.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, fieldnames=list(rows[0]), lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)
