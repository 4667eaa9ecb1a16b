"""The pages of studies, and that of a sweep: sentences, tables and pictures in one HTML file."""

from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from typing import Any

from pinnray.runtime.figure import WIDTH, Figure
from pinnray.runtime.html import write_html
from pinnray.runtime.tables import TextTable
from pinnray.studies.sweep.pictures import SHOWN, draw_maps, draw_pairs
from pinnray.studies.sweep.sweep import Sweep
from pinnray.studies.sweep.tables import (
    correlation_grid,
    failure_grid,
    known_quantities,
    quantity_grid,
    sample_table,
    write_frame,
)

PAGE = "sweep.html"

FILES = (
    "samples.parquet and samples.csv (a row for each sample, units in the headings), sweep.json (the study, "
    "versions and hashes), journal.sqlite (from which the same command goes on)"
)

SAMPLED = {"grid": "on a grid", "sobol": "of a Sobol sequence"}


def write_page(
    path: Path,
    title: str,
    sentences: Sequence[str],
    tables: Sequence[TextTable],
    drawn: Mapping[str, tuple[Figure, str]],
    note: str,
    formats: Collection[str] = (),
) -> list[Path]:
    """Write the page of a study and its pictures beside it, and return the paths.

    Args:
        path: Of the page.
        title: Its heading.
        sentences: What was found, a paragraph each.
        tables: Those without rows are left out.
        drawn: Pictures with their captions, by the names of their files.
        note: Last line of the page.
        formats: Of the pictures besides PNG.
    """
    pictures = {
        each.save(path.with_name(f"{name}.png"), formats): text for name, (each, text) in drawn.items()
    }
    shown = [table for table in tables if table.rows]
    page = write_html(
        path,
        "designs.html.j2",
        title=title,
        sentences=sentences,
        tables=shown,
        pictures=pictures,
        note=f"Files beside this page: {note}",
    )
    return [page, *pictures]


def write_sweep(
    sweep: Sweep, folder: Path, record: Mapping[str, Any], formats: Collection[str] = (), page: float = WIDTH
) -> list[Path]:
    """Write the table, the page and the pictures of a sweep, and return the paths.

    Args:
        sweep: The sweep.
        folder: Where to write.
        record: Start, durations and machine, from `Stages.record`.
        formats: Of the pictures besides PNG.
        page: Width of the pictures, inches.
    """
    files = write_frame(sample_table(sweep), folder / "samples")
    drawn: dict[str, tuple[Figure, str]] = {}
    if sweep.study.sampling == "grid" and len(sweep.study.varied) == 2:
        trained = "rel_l2_displacement" in known_quantities(sweep)
        names = ("rel_l2_displacement", "boundary_violation") if trained else SHOWN[:2]
        drawn["map"] = (
            draw_maps(sweep, names, page),
            "Quantities over both parameters; framed: the least value.",
        )
    tables = [quantity_grid(sweep), failure_grid(sweep)]
    if len(sweep.good) > 1 and not sweep.study.settings_alone:
        drawn["pairs"] = (
            draw_pairs(sweep, page),
            "Quantities over the varied parameters, a dot for each finger.",
        )
        tables.append(correlation_grid(sweep, SHOWN))
    note = f"{FILES}. Started {record['started']}."
    title = f"Sweep {sweep.study.name}"
    return files + write_page(folder / PAGE, title, sweep_sentences(sweep), tables, drawn, note, formats)


def sweep_sentences(sweep: Sweep) -> list[str]:
    """The sweep in sentences."""
    study = sweep.study
    found, good = len(sweep.measurements), len(sweep.good)
    varied = ", ".join(f"{name} ({_range(values)})" for name, values in study.varied.items())
    fixed = ", ".join(f"{name} = {value}" for name, value in study.fixed.items())
    sentences = [
        f"{found} of {len(sweep.samples)} samples {SAMPLED[study.sampling]} were run; {good} have a "
        f"converged result by {study.solver} with elements of {study.mesh_size:g} mm.",
        f"Varied: {varied}. The rest is that of the design {study.design}"
        + (f", with {fixed}." if fixed else "."),
    ]
    if found > good:
        sentences.append(
            f"{found - good} have none, for the reasons in the table below. Statistics and pictures are "
            "of the converged ones."
        )
    return [*sentences, *(f"{remark}." for remark in sweep.remarks)]


def _range(values: Any) -> str:
    if values.values is not None:
        return " or ".join(map(str, values.values))
    return f"{values.low:g} to {values.high:g}"
