"""The output files of a cross-validation: tables, pictures and the page."""

from collections.abc import Mapping
from typing import Any

import pandas as pd
from matplotlib.axes import Axes

from pinnray.comparison.figures.layout import axes_at, legend_above, legend_height, write_heading
from pinnray.comparison.figures.solver_colours import SOLVER_COLOURS, solver_colour
from pinnray.runtime.atomic import write_json
from pinnray.runtime.content_hash import file_digest
from pinnray.runtime.figure import WIDTH, Figure, figure
from pinnray.studies.crossval.result import CrossvalResult
from pinnray.studies.crossval.scores import CASE
from pinnray.studies.crossval.tables import all_tables
from pinnray.studies.sweep.page import write_page
from pinnray.studies.sweep.tables import write_frame


def write_results(result: CrossvalResult, provenance: Mapping[str, Any]) -> None:
    """Write all files; `crossval.json` last, with the SHA-256 of the others."""
    out, formats = result.study.out, result.study.picture_formats
    files = [
        *write_frame(result.samples, out / "samples"),
        *write_frame(result.scores.reset_index(), out / "scores"),
    ]
    caption = "Error of each marker when it is held out, mean over seeds."
    name = result.study.design.name
    pages = write_page(
        out / "report.html",
        f"Cross-validation of {name}",
        [
            "Errors of the solvers at markers, loads and fields that they were not given. The markers' "
            f"displacements are {'; '.join(dict.fromkeys(result.sources.values()))}. Seeds: "
            f"{result.study.seeds}.",
            *(f"{name} has no score: {message}" for name, message in result.failed.items()),
            *(f"Warning: {remark}" for remark in result.remarks),
        ],
        all_tables(result),
        {"held_out": (draw_held_out(result), caption)},
        f"{', '.join(path.name for path in files)}.",
        formats,
    )
    content = {
        **provenance,
        "contacts": {
            name: {"true_force_N_mm": truth.force, "true_position_mm": truth.position}
            for name, truth in result.truths.items()
        },
        "failed": dict(result.failed),
        "remarks": result.remarks,
        "files_sha256": {path.name: file_digest(path) for path in (*files, *pages)},
    }
    write_json(out / "crossval.json", content)


def draw_held_out(result: CrossvalResult) -> Figure:
    """Draw the mean of |du| + |dv| at every marker where it is held out: a chart a case, a line a solver."""
    scheme = result.main_scheme
    held = result.samples[result.samples["held_out"] & (result.samples["scheme"] == scheme)]
    errors = held[["error_u_mm", "error_v_mm"]].abs().sum(axis=1)
    means = errors.groupby([held[name] for name in [*CASE, "solver", "marker"]], sort=False).mean()
    cases = [case for case, _ in result.samples.groupby(CASE, sort=False)]
    left, height, pitch = 0.72, 2.2, 2.7
    top = 0.5 + legend_height(list(result.samples["solver"].unique()))
    with figure(top + len(cases) * pitch) as drawn:
        note = f"{scheme}; mean over seeds, against {result.study.label} displacements."
        write_heading(drawn, "Error of each marker when it is held out", note)
        for row, case in enumerate(cases):
            axes = axes_at(drawn, (left, top + row * pitch, WIDTH - left - 0.1, height))
            for label, values in means.loc[case].groupby("solver", sort=False):
                _line(axes, result, label, values.droplevel("solver"))
            axes.set_title(result.said(*case), fontsize=8.5, loc="left")
            axes.set_xlabel("marker, by its number in the drawing")
            axes.set_ylabel(r"$|\Delta u| + |\Delta v|$, mm")
            axes.set_xticks(sorted(means.loc[case].index.unique("marker")))
            axes.set_yscale("log")
            axes.yaxis.set_major_formatter("{x:g}")
            axes.grid()
            axes.set_axisbelow(True)
        legend_above(drawn.axes[0])
    return drawn


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
