"""The samples of a sweep as a table: Parquet and CSV, with units in the headings."""

import re
from collections.abc import Sequence
from io import BytesIO
from pathlib import Path

import numpy as np
import pandas as pd

from pinnray.runtime.atomic import write_bytes, write_text
from pinnray.runtime.tables import NONE, TextTable
from pinnray.solvers.finger_figures import QUANTITIES, Quantity, heading
from pinnray.studies.sweep.quantities import TRAINING
from pinnray.studies.sweep.sampling import places_of
from pinnray.studies.sweep.study import title
from pinnray.studies.sweep.sweep import Sweep, first_of


def known_quantities(sweep: Sweep) -> dict[str, Quantity]:
    """The quantities of a sweep's samples by name, those of a training among them if it has trained."""
    trained = any("loss" in each.values for each in sweep.measurements)
    return {**QUANTITIES, **(TRAINING if trained else {})}


def sample_table(sweep: Sweep) -> pd.DataFrame:
    """A row for every finished sample: number, varied parameters, state, quantities, time and message."""
    headings = {name: heading(name, quantity) for name, quantity in known_quantities(sweep).items()}
    rows = [
        {
            "sample": each.number,
            **{title(name): value for name, value in sweep.samples[each.number].items()},
            "state": each.state,
            **{shown: each.values.get(name, float("nan")) for name, shown in headings.items()},
            "seconds": each.seconds,
            "message": each.message,
        }
        for each in sweep.measurements
    ]
    return pd.DataFrame(rows)


def write_frame(frame: pd.DataFrame, path: Path) -> list[Path]:
    """Write a table as Parquet and CSV under a path without ending, and return both paths."""
    buffer = BytesIO()
    frame.to_parquet(buffer, engine="pyarrow", index=False)
    files = [path.with_suffix(".parquet"), path.with_suffix(".csv")]
    write_bytes(files[0], buffer.getvalue())
    write_text(files[1], frame.to_csv(index=False, lineterminator="\n"))
    return files


def quantity_grid(sweep: Sweep) -> TextTable:
    """Least, median and largest value of each quantity over the converged samples."""
    rows = []
    for name, quantity in known_quantities(sweep).items():
        values = np.array([each.values[name] for each in sweep.good])
        known = values[np.isfinite(values)]
        ends = np.quantile(known, [0, 0.5, 1]) if len(known) else []
        numbers = [f"{end:.4g}" for end in ends] or ["–"] * 3
        rows.append((name, quantity.unit, *numbers, quantity.meaning))
    headings = ("quantity", "unit", "least", "median", "largest", "meaning")
    title = f"Quantities of {len(sweep.good)} fingers"
    return TextTable(title, headings, rows, left=("quantity", "unit", "meaning"))


def correlation_grid(sweep: Sweep, names: Sequence[str]) -> TextTable:
    """Rank correlation of quantities with the varied parameters over the converged samples."""
    parameters = list(sweep.study.varied)
    rows = [places_of(sweep.study, sweep.samples[each.number]) for each in sweep.good]
    values = pd.DataFrame([each.values for each in sweep.good], columns=list(names), dtype=float)
    found = pd.concat([pd.DataFrame(rows, columns=parameters), values], axis=1).corr("spearman")
    shown = found.loc[list(names), parameters].dropna(how="all")
    texts = shown.map(lambda share: f"{share:+.2f}" if np.isfinite(share) else NONE)
    caption = (
        "Spearman's rank correlation: +1 where the quantity always grows with the parameter, −1 where it "
        "always falls; near 0 where it does not follow the parameter, or goes both ways (see the picture)."
    )
    rows, title = texts.reset_index().values.tolist(), "Which parameter matters"
    return TextTable(title, ["quantity", *parameters], rows, caption)


def failure_grid(sweep: Sweep) -> TextTable:
    """Samples without a result, and those that did not converge: counts of each reason."""
    reasons: dict[tuple[str, str], list[int]] = {}
    for each in sweep.measurements:
        if each.state != "done":
            # up to the first number or colon, so that like reasons are counted together
            kind = re.split(r":| -?\d", each.message, maxsplit=1)[0]
            reasons.setdefault((each.state, kind), []).append(each.number)
    often = sorted(reasons.items(), key=lambda entry: -len(entry[1]))
    rows = [(state, str(len(own)), reason, first_of(own)) for (state, reason), own in often]
    headings = ("state", "samples", "reason", "numbers")
    return TextTable("Samples without a result", headings, rows, left=("state", "reason", "numbers"))
