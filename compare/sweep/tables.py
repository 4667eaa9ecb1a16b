"""The samples of a sweep as a table: Parquet and CSV, with units in the headings."""

from io import BytesIO
from pathlib import Path

import pandas as pd

from compare.sweep.quantities import QUANTITIES, heading
from compare.sweep.study import title
from compare.sweep.sweep import Sweep
from geometry.atomic import write_bytes, write_text


def table(sweep: Sweep) -> pd.DataFrame:
    """A row for every finished sample: number, varied parameters, state, quantities, time and message."""
    rows = []
    for each in sweep.measurements:
        row: dict[str, object] = {"sample": each.number}
        row |= {title(name): value for name, value in sweep.samples[each.number].items()}
        row |= {"state": each.state}
        row |= {heading(name): each.values.get(name, float("nan")) for name in QUANTITIES}
        rows.append(row | {"seconds": each.seconds, "message": each.message})
    return pd.DataFrame(rows)


def write_tables(sweep: Sweep, folder: Path) -> list[Path]:
    """Write `samples.parquet` and `samples.csv`, and return the paths."""
    frame = table(sweep)
    buffer = BytesIO()
    frame.to_parquet(buffer, engine="pyarrow", index=False)
    write_bytes(folder / "samples.parquet", buffer.getvalue())
    write_text(folder / "samples.csv", frame.to_csv(index=False, lineterminator="\n"))
    return [folder / "samples.parquet", folder / "samples.csv"]
