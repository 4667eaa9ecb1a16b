"""Several finished runs side by side: their differences and numbers in one page and table."""

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import hypot, isfinite
from pathlib import Path
from typing import Any

from pinnray.comparison.evaluation.metrics import MEANS
from pinnray.comparison.report.output_files import SCHEMA, solver_numbers
from pinnray.comparison.report.summary import RunAnswer, answers
from pinnray.runtime.errors import UserError
from pinnray.runtime.html import picture_urls, write_html
from pinnray.runtime.output_folder import RUN_FILE, check_links
from pinnray.runtime.tables import NONE, Cell, TextTable, number, percent, write_csv

TABLE = "runs.csv"
SHOWN_PICTURES = {"overlay.png": "Deformed finger", "von_mises.png": "Von Mises stress"}
"""Pictures of a run that stand side by side."""


@dataclass(frozen=True)
class Run:
    """A finished run."""

    name: str  # on the page
    folder: Path
    metrics: Mapping[str, Any]  # content of `metrics.json`, with NaN for a number that is null there
    record: Mapping[str, Any]  # content of `run.json`

    @property
    def answers(self) -> list[RunAnswer]:
        """The answers that its report opens with."""
        unsupported, failed = (self.record.get(key) or {} for key in ("left_out", "failed"))
        return answers(self.metrics, unsupported=unsupported, failed=failed)

    @property
    def settings(self) -> dict[str, str]:
        """All that the numbers depend on, by name."""
        metrics, record = self.metrics, self.record
        groups = {key: metrics.get(key) for key in ("design", "material", "load")}
        groups |= {key: record.get(key) for key in ("mesh", "seed")}
        found = dict(_flat(groups))
        return found | {
            "markers": str(metrics["measurements"]["description"]),
            "solvers": ", ".join(metrics["solvers"]),
            "program": str((record.get("versions") or {}).get("pinn-ray")),
        }


def read_runs(folders: Sequence[Path]) -> list[Run]:
    """The runs in folders, each under the name of its folder, or its path where two have one name.

    Raises:
        UserError: If a folder is given twice or holds no finished run.
    """
    if len({folder.resolve() for folder in folders}) < len(folders):
        raise UserError(f"a run is given twice: {', '.join(map(str, folders))}")
    names = [folder.resolve().name for folder in folders]
    names = [
        str(folder) if names.count(name) > 1 else name for name, folder in zip(names, folders, strict=True)
    ]
    return [_read(name, folder) for name, folder in zip(names, folders, strict=True)]


def _read(name: str, folder: Path) -> Run:
    if not folder.is_dir():
        raise UserError(f"there is no folder {folder}; give output folders of `compare`")
    check_links(folder)
    found = []
    for file in ("metrics.json", RUN_FILE):
        try:
            found.append(json.loads((folder / file).read_text(encoding="utf-8")))
        except FileNotFoundError:
            raise UserError(f"{folder} has no {file}, so it is no finished run of `compare`") from None
        except ValueError:
            raise UserError(f"{folder / file} is damaged: it is no JSON; make the run again") from None
    metrics, record = found
    if (
        not isinstance(record, dict)
        or not isinstance(metrics, dict)
        or metrics.get("schema") != SCHEMA
        or "solvers" not in metrics
    ):
        raise UserError(
            f"{folder / 'metrics.json'} is not of `compare`, or of another version; make the run again"
        )
    try:  # what is asked of it later
        run = Run(name, folder, metrics | {"solvers": solver_numbers(metrics)}, record)
        _ = run.answers, run.settings, run_rows([run])
    except (AttributeError, LookupError, TypeError, ValueError):
        raise UserError(
            f"{folder / 'metrics.json'} is damaged: a number is missing; make the run again"
        ) from None
    return run


def _flat(value: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, str]]:
    for key, inner in value.items():
        if isinstance(inner, Mapping):
            yield from _flat(inner, f"{prefix}{key} ")
        else:
            yield f"{prefix}{key}", NONE if inner is None else str(inner)


def differing_settings(runs: Sequence[Run]) -> TextTable:
    """The settings in which runs differ, with their values in every run."""
    settings = [run.settings for run in runs]
    names = dict.fromkeys(name for own in settings for name in own)
    rows = [[name, *(own.get(name, NONE) for own in settings)] for name in names]
    headings = ["Setting", *(run.name for run in runs)]
    return TextTable(
        "Settings that are not the same in all runs",
        headings,
        [row for row in rows if len(set(row[1:])) > 1],
        left=headings,
    )


def ranges(runs: Sequence[Run]) -> TextTable:
    """Least and largest numbers of each solver that several runs have."""
    rows = []
    for solver in dict.fromkeys(name for run in runs for name in run.metrics["solvers"]):
        own = [row for row in run_rows(runs) if row["solver"] == solver]
        if len(own) < 2:
            continue
        columns = ("held_out_mae_sum_mm", "to_truth_displacement_rel_l2", "to_truth_von_mises_rel_l2")
        held_out, *shares = [[float(row[column]) for row in own if row[column] != ""] for column in columns]
        texts = [f"{min(held_out):.3f} to {max(held_out):.3f}" if held_out else NONE]
        texts += [f"{percent(min(each), 2)} to {percent(max(each), 2)}" if each else NONE for each in shares]
        rows.append([solver, str(len(own)), *texts])
    return TextTable(
        "Least and largest over the runs: mean |Δu| + |Δv| at held-out markers, mm; relative L² distance "
        "from the simulated finger",
        ["Solver", "runs", "held out, mm", "displacement", "von Mises stress"],
        rows,
    )


def run_rows(runs: Sequence[Run]) -> list[dict[str, Cell]]:
    """A row for each solver of each run; an empty cell is a number that does not exist.

    `given` are errors at markers that the solver was given, `held_out` at markers that it was not.
    """
    return [_row(run, solver, own) for run in runs for solver, own in run.metrics["solvers"].items()]


def _row(run: Run, solver: str, own: Mapping[str, Any]) -> dict[str, Cell]:
    row: dict[str, Cell] = {"run": run.name, "design": run.metrics["design"]["name"], "solver": solver}
    row |= {"law": own["law"], "converged": int(own["status"] == "converged")}
    row |= {"observations": run.metrics["measurements"]["source"]}
    given = own["markers"] if own["markers"]["in_sample"] else {}
    for kind, errors in (("given", given), ("held_out", own["held_out"] or {})):
        row |= {f"{kind}_{name}_mm": _cell(errors.get(name)) for name in MEANS}
    true, to = own["to_truth"] or {}, own["to_reference"]
    row |= {
        f"to_truth_{name}_rel_l2": _cell((true.get(name) or {}).get("rel_l2"))
        for name in ("displacement", "von_mises")
    }
    row["to_truth_force_rel"] = _cell(own["force_to_truth_rel"])
    row["reference"] = run.metrics["reference"]
    row |= {
        f"to_reference_{name}_rel_l2": _cell(to[f"rel_l2_{name}"]) for name in ("displacement", "von_mises")
    }
    row["energy_N_mm_per_mm"] = _cell(own["energy"])
    row["force_N_per_mm"] = _cell(hypot(*own["reaction"]))
    return row | {"seconds_s": _cell(own["seconds"])}


def _cell(value: float | None) -> Cell:
    """An empty cell for a number that is not finite, or does not exist."""
    return "" if value is None or not isfinite(value) else value


def _text(value: Cell, share: bool) -> str:
    if value == "":
        return NONE
    return percent(float(value), 3, sign=False) if share else number(float(value), 4)


def _mean_columns(kind: str) -> dict[str, str]:
    return {name.removeprefix("mae_"): f"{kind}_{name}_mm" for name in MEANS}


GROUPS = {
    "Errors at markers that the solver was not given (held out), mm": _mean_columns("held_out"),
    "Errors at markers that the solver was given (training errors), mm": _mean_columns("given"),
    "Distance from the simulated finger over the whole body, relative L², and error of the force, %": {
        "displacement": "to_truth_displacement_rel_l2",
        "von Mises": "to_truth_von_mises_rel_l2",
        "force": "to_truth_force_rel",
    },
    "Distance from the run’s reference over the whole body, relative L², %": {
        "displacement": "to_reference_displacement_rel_l2",
        "von Mises": "to_reference_von_mises_rel_l2",
    },
    "Energy, force of the indenter, time": {
        "energy, N mm/mm": "energy_N_mm_per_mm",
        "force, N/mm": "force_N_per_mm",
        "time, s": "seconds_s",
    },
}
"""Tables of the page: title, and the columns of `run_rows` under their headings."""


def number_tables(runs: Sequence[Run]) -> list[TextTable]:
    """The tables of the page; rows without a number are left out."""
    found = []
    for title, columns in GROUPS.items():
        headings = ["Run", "solver", "markers", *columns]
        rows = [
            [
                str(row["run"]),
                f"{row['solver']}{'' if row['converged'] else ' (not converged)'}",
                str(row["observations"]),
                *(_text(row[column], column.startswith("to_")) for column in columns.values()),
            ]
            for row in run_rows(runs)
        ]
        if rows := [row for row in rows if set(row[3:]) != {NONE}]:
            found.append(TextTable(title, headings, rows, left=headings[:3]))
    return found


def write_side_by_side(folder: Path, runs: Sequence[Run]) -> tuple[Path, Path]:
    """Write the page and the table of runs into a folder, atomically, and return their paths."""
    pictures = {
        title: {
            run.name: run.folder / "figures" / file
            for run in runs
            if (run.folder / "figures" / file).is_file()
        }
        for file, title in SHOWN_PICTURES.items()
        if len(runs) <= 12  # so that the page stays small
    }
    page = write_html(
        folder / "runs.html",
        "runs.html.j2",
        room="pinnray.comparison",
        runs=runs,
        differences=differing_settings(runs),
        ranges=ranges(runs),
        tables=number_tables(runs),
        pictures=pictures,
        urls=picture_urls([path for paths in pictures.values() for path in paths.values()]),
        sources={run.metrics["measurements"]["source"] for run in runs},
        file=TABLE,
    )
    write_csv(folder / TABLE, run_rows(runs))
    return page, folder / TABLE
