"""The output files of a cross-validation: tables, pictures and the page."""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any

import pandas as pd
from matplotlib.axes import Axes

from pinnray.comparison.figures.style import (
    SOLVER_COLOURS,
    axes_at,
    legend_above,
    legend_height,
    solver_colour,
    write_heading,
)
from pinnray.runtime.atomic import write_json
from pinnray.runtime.content_hash import file_digest
from pinnray.runtime.figure import WIDTH, Figure, figure
from pinnray.runtime.html import write_html
from pinnray.studies.crossval.result import CrossvalResult
from pinnray.studies.crossval.scores import CASE
from pinnray.studies.crossval.tables import all_tables, verdict_sentences
from pinnray.studies.sweep.tables import write_frame

FIELD_NAMES = {"displacement": "displacement", "strain": "strain", "von_mises": "von Mises stress"}


def write_results(result: CrossvalResult, provenance: Mapping[str, Any]) -> None:
    """Write all files; `crossval.json` last, with the SHA-256 of the others."""
    out, formats = result.study.out, result.study.picture_formats
    files = [
        *write_frame(result.samples, out / "samples"),
        *write_frame(result.scores.reset_index(), out / "scores"),
    ]
    drawn = {
        "held_out": (draw_held_out(result), "Error of each marker when it is held out, mean over seeds."),
        **(
            {"fields": (draw_fields(result), "Distance from the truth by scheme.")} if result.contacts else {}
        ),
    }
    pictures = {each.save(out / f"{name}.png", formats): text for name, (each, text) in drawn.items()}
    name = result.study.design.name
    page = write_html(
        out / "report.html",
        "designs.html.j2",
        title=f"Cross-validation of {name}",
        sentences=[
            "Errors of the solvers at markers, loads and fields that they were not given. The markers' "
            f"displacements are {'; '.join(dict.fromkeys(result.sources.values()))}. Seeds: "
            f"{result.study.seeds}.",
            *verdict_sentences(result),
            *(f"{name} has no score: {message}" for name, message in result.failed.items()),
            *(f"Warning: {remark}" for remark in result.remarks),
        ],
        tables=all_tables(result),
        pictures=pictures,
        note=f"Files beside this page: {', '.join(path.name for path in files)}.",
    )
    content = {
        **provenance,
        "contacts": {truth: contact.cells for truth, contact in result.contacts.items()},
        "failed": dict(result.failed),
        "remarks": result.remarks,
        "files_sha256": {path.name: file_digest(path) for path in (*files, *pictures, page)},
    }
    write_json(out / "crossval.json", content)


def draw_held_out(result: CrossvalResult) -> Figure:
    """Draw the mean of |du| + |dv| at every marker where it is held out: a chart a case, a line a solver."""
    scheme = result.main_scheme
    held = result.samples[result.samples["held_out"] & (result.samples["scheme"] == scheme)]
    errors = held[["error_u_mm", "error_v_mm"]].abs().sum(axis=1)
    means = errors.groupby([held[name] for name in [*CASE, "solver", "marker"]], sort=False).mean()
    note = f"{scheme}; mean over seeds, against {result.study.label} displacements."
    with _charts(result, "Error of each marker when it is held out", note) as charts:
        for case, said, (axes,) in charts:
            for label, values in means.loc[case].groupby("solver", sort=False):
                _line(axes, result, label, values.droplevel("solver"))
            axes.set_title(said, fontsize=8.5, loc="left")
            axes.set_xlabel("marker, by its number in the drawing")
            axes.set_ylabel(r"$|\Delta u| + |\Delta v|$, mm")
            axes.set_xticks(sorted(means.loc[case].index.unique("marker")))
        drawn = axes.figure
    return drawn  # type: ignore[return-value]


def draw_fields(result: CrossvalResult) -> Figure:
    """Draw relative L2 distances from the truth by scheme, a row a case, a chart for each field."""
    title = "Distance from the truth over the body"
    note = "Relative L², %, by what is held out; the line at 100 % is a field of zero."
    schemes, means = result.schemes, result.scores["mean"]
    with _charts(result, title, note, columns=3, gap=0.5, foot=0.75) as charts:
        for case, said, columns in charts:
            for axes, (name, field) in zip(columns, FIELD_NAMES.items(), strict=True):
                values = 100 * means.loc[case].xs(name, level="score")
                for label, each in values.groupby("solver", sort=False):
                    places = [schemes.index(scheme) for scheme in each.index.get_level_values("scheme")]
                    _line(axes, result, label, pd.Series(each.to_numpy(), places))
                axes.axhline(100, color="#999999", linewidth=0.6, zorder=1)
                axes.set_xticks(range(len(schemes)), schemes, rotation=45, ha="right")
                axes.set_xlabel(field)
            columns[0].set_title(said, fontsize=8.5, loc="left")
            columns[0].set_ylabel("%")
        drawn = axes.figure
    return drawn  # type: ignore[return-value]


@contextmanager
def _charts(
    result: CrossvalResult, title: str, note: str, *, columns: int = 1, gap: float = 0.0, foot: float = 0.5
) -> Iterator[Sequence[tuple[tuple[str, str], str, list[Axes]]]]:
    """Logarithmic charts: for each truth and layout both, a title, and a row of charts.

    Height of the foot and the gap between charts in inches.
    """
    cases = [case for case, _ in result.samples.groupby(CASE, sort=False)]
    solvers = list(result.samples["solver"].unique())
    left, height = 0.72, 2.2
    top, pitch = 0.5 + legend_height(solvers), height + foot
    width = (WIDTH - left - 0.1 - (columns - 1) * gap) / columns
    with figure(top + len(cases) * pitch) as drawn:
        write_heading(drawn, title, note)
        rows = []
        for row, case in enumerate(cases):
            boxes = [(left + at * (width + gap), top + row * pitch, width, height) for at in range(columns)]
            rows.append((case, result.said(*case), [axes_at(drawn, box) for box in boxes]))
        for axes in drawn.axes:
            axes.set_yscale("log")
            axes.yaxis.set_major_formatter("{x:g}")
            axes.grid()
            axes.set_axisbelow(True)
        yield rows
        legend_above(drawn.axes[0])


def _line(axes: Axes, result: CrossvalResult, label: str, values: pd.Series) -> None:
    """A solver's line, whose marks are shifted a little by its number, so that none hides another."""
    number = list(result.samples["solver"].unique()).index(label)
    axes.plot(
        [place + 0.03 * number for place in values.index],
        values.to_numpy(),
        color=solver_colour(number),
        marker="os^Dv"[number // len(SOLVER_COLOURS) % 5],  # another shape when the colours begin again
        linestyle="-" if number < len(SOLVER_COLOURS) else "--",
        linewidth=0.9,
        markersize=3.5,
        label=label,
    )
