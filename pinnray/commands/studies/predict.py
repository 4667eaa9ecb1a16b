"""Predict fingers from a sweep."""

from csv import DictReader
from csv import Error as CsvError
from pathlib import Path
from typing import TYPE_CHECKING

from rich.console import Console

from pinnray.options.shared import OptionalOutputPath, Repeated, existing
from pinnray.runtime.errors import UserError

if TYPE_CHECKING:
    from pinnray.studies.emulator.emulator import Emulator, Predictions


def command(
    sweep: Path,
    *,
    set: Repeated = (),
    csv: Path | None = None,
    out: OptionalOutputPath = None,
) -> int:
    """Predict the quantities of fingers that a sweep did not solve, each with a 95 % interval.

    An emulator is fitted to the sweep's converged samples the first time, and again when there are more. It
    takes numbers within their ranges and choices among those of the sweep; a sweep of drawings is refused.

    Args:
        sweep: Folder of `pinnray sweep`.
        set: A parameter that the sweep varies, such as rib_count=6 or N=6; give every one.
        csv: CSV file of many fingers: a column for every varied parameter, a row for every finger.
        out: CSV file of the predictions for --csv; default: beside it, NAME-predicted.csv.
    """
    from pinnray.runtime.atomic import write_text
    from pinnray.runtime.stages import Stages
    from pinnray.studies.emulator.emulator import prediction_table
    from pinnray.studies.emulator.store import emulator_of

    if bool(set) == (csv is not None):
        raise UserError(
            "give one finger by --set PARAMETER=VALUE for every varied parameter, or many by --csv"
        )
    if out is not None and csv is None:
        raise UserError("--out is for the predictions of --csv")
    existing(csv)
    rows = read_rows(csv) if csv else [finger_given(set)]
    with Stages() as stages:
        emulator = emulator_of(sweep, stages)
    fingers = [emulator.inputs.finger(row, f"{csv}, row {place}: " if csv else "") for place, row in rows]
    found = emulator.predict(fingers)
    if csv is None:
        print_table(emulator, found)
        return 0
    path = out or csv.with_name(f"{csv.stem}-predicted.csv")
    write_text(path, prediction_table(emulator, fingers, found).to_csv(index=False, lineterminator="\n"))
    print(path)
    return 0


def finger_given(settings: tuple[str, ...]) -> tuple[int, dict[str, str]]:
    """The finger of the option --set."""
    from pinnray.geometry.finger.parameters import SYMBOLS

    found: dict[str, str] = {}
    for setting in settings:
        key, equals, value = (part.strip() for part in setting.partition("="))
        if not (equals and key and value):
            raise UserError(f"cannot read {setting!r}; write parameter=value, such as rib_count=6")
        if (name := SYMBOLS.get(key, key)) in found:
            raise UserError(f"{name} is set twice; set it once")
        found[name] = value
    return 1, found


def read_rows(file: Path) -> list[tuple[int, dict[str, str]]]:
    """Numbers of the rows of a CSV file, and their cells by the headings, with or without units."""
    from pinnray.geometry.finger.parameters import Parameters
    from pinnray.studies.sweep.study import PHYSICS, title

    names = {title(name): name for name in (*Parameters.model_fields, *PHYSICS)}
    try:
        with file.open(encoding="utf-8-sig", newline="") as content:
            rows = list(DictReader(content))
    except (OSError, UnicodeDecodeError, CsvError) as error:
        raise UserError(f"cannot read {file}: {error}") from None
    if not rows:
        raise UserError(f"{file} has no fingers: it needs a line of headings and a row for every finger")
    return [
        (
            place,
            {
                names.get(key or "", key or "(more cells than headings)"): cell or ""
                for key, cell in row.items()
            },
        )
        for place, row in enumerate(rows, start=1)
    ]


def print_table(emulator: "Emulator", found: "Predictions") -> None:
    """Print the quantities of one finger."""
    from pinnray.runtime.tables import terminal_table
    from pinnray.solvers.finger_figures import QUANTITIES

    headings = ["quantity", "unit", "value", "95 % interval", "meaning"]
    rows = []
    for name, value, low, high in zip(found.names, found.values[0], found.low[0], found.high[0], strict=True):
        ends = "exact" if low == high else f"{low:.4g} to {high:.4g}"
        rows.append([name, QUANTITIES[name].unit, f"{value:.4g}", ends, QUANTITIES[name].meaning])
    title = f"{emulator.study.name}: predicted from {emulator.count:,} samples"
    shown = terminal_table(title, headings, rows, left=["quantity", "unit", "meaning"])
    for column in shown.columns:
        column.no_wrap, column.overflow = column.header != "meaning", "fold"
    Console().print(shown)
