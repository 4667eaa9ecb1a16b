"""The output files of a cross-validation: numbers, tables, charts and the report."""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from itertools import product
from pathlib import Path
from typing import Any

from matplotlib.axes import Axes

from pinnray.comparison.crossval.folds import ONE, SeedResults
from pinnray.comparison.crossval.result import Case, CrossvalResult
from pinnray.comparison.crossval.scores import FIELD_NAMES, Score
from pinnray.comparison.crossval.tables import all_tables, conclusions
from pinnray.comparison.figures import FORMATS
from pinnray.comparison.figures.style import (
    LEGEND_LINE,
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
from pinnray.runtime.tables import Cell, write_csv

HELD_OUT, FIELDS, SWEEP = "held_out", "fields", "l_curve"
"""Names of the pictures, without the truth that follows if there are several."""


def write_results(
    out: Path,
    result: CrossvalResult,
    results: Mapping[Case, Mapping[str, SeedResults]],
    sweeps: Mapping[Case, Mapping[str, Sequence[float]]],
    provenance: Mapping[str, Any],
) -> None:
    """Write all files; `crossval.json` last, with the SHA-256 of the others."""
    write_csv(out / "held_out.csv", result.held_out_rows())
    if result.has_fields:
        write_csv(out / "fields.csv", result.field_rows())
    if result.study.chosen_truths:
        write_csv(out / "truths.csv", result.truth_rows())
    write_csv(out / "folds.csv", list(_fold_rows(results)))
    if sweeps:
        rows: list[dict[str, Cell]] = [
            case._asdict() | dict(zip(sweep, values, strict=True))
            for case, sweep in sweeps.items()
            for values in zip(*sweep.values(), strict=True)
        ]
        write_csv(out / "l_curve.csv", rows)
    pictures = _write_pictures(out, result, sweeps)
    answers = conclusions(result)
    write_html(
        out / "report.html",
        "crossval.html.j2",
        room="pinnray.comparison",
        result=result,
        answers=answers,
        tables=all_tables(result),
        pictures=pictures,
    )
    written = [path for path in sorted(out.glob("*.*")) if path.suffix in (".csv", ".png", ".html")]
    hashes = {path.name: file_digest(path) for path in written}
    content = {**provenance, **result.content(), "answers": answers, "files_sha256": hashes}
    write_json(out / "crossval.json", content)


def _fold_rows(results: Mapping[Case, Mapping[str, SeedResults]]) -> Iterator[dict[str, Cell]]:
    """Every error of every fold."""
    for case, by_label in results.items():
        for label, seeds in by_label.items():
            for seed, found in ((seed, found) for seed, folds in enumerate(seeds) for found in folds):
                for marker, (u, v) in enumerate(found.errors):
                    yield case._asdict() | {
                        "solver": label,
                        "seed": seed,
                        "scheme": found.fold.scheme,
                        "fold": found.fold.name,
                        "marker": marker + 1,
                        "held_out": int(marker in found.held),
                        "error_u_mm": u,
                        "error_v_mm": v,
                    }


def _write_pictures(
    out: Path, result: CrossvalResult, sweeps: Mapping[Case, Mapping[str, Sequence[float]]]
) -> dict[str, list[Path]]:
    """Write the pictures of each truth, and remove pictures of an earlier study."""
    formats = result.study.picture_formats
    pictures = {
        truth: [
            drawn.save(out / f"{name}{'' if len(result.truths) == 1 else '-' + truth}.png", formats)
            for name, drawn in _pictures(result, truth, sweeps)
        ]
        for truth in result.truths
    }
    kinds = ("png", *formats)
    saved = {path.with_suffix(f".{kind}") for each in pictures.values() for path in each for kind in kinds}
    for name, kind in product((HELD_OUT, FIELDS, SWEEP), ("png", *FORMATS)):
        for path in {*out.glob(f"{name}.{kind}"), *out.glob(f"{name}-*.{kind}")} - saved:
            path.unlink()
    return pictures


def _pictures(
    result: CrossvalResult, truth: str, sweeps: Mapping[Case, Mapping[str, Sequence[float]]]
) -> Iterator[tuple[str, Figure]]:
    """The pictures of a truth by name."""
    by_layout = result.of_truth(truth)
    if ONE in result.schemes:
        errors = {
            layout: {label: scores[ONE].per_marker for label, scores in each.scores.items()}
            for layout, each in by_layout.items()
        }
        yield HELD_OUT, draw_held_out(errors, result.study.label)
    if result.has_fields:
        scores = {layout: each.scores for layout, each in by_layout.items()}
        yield FIELDS, draw_fields(scores, result.schemes)
    if swept := {case.layout: sweep for case, sweep in sweeps.items() if case.truth == truth}:
        yield SWEEP, draw_weight_sweeps(swept)


def draw_held_out(errors: Mapping[str, Mapping[str, Sequence[float]]], label: str) -> Figure:
    """Draw the mean of |du| + |dv| at every marker where it is held out: a row a layout, a line a solver.

    `label` is `simulated` or `measured`, of the displacements.
    """
    solvers = _solvers(errors)
    note = f"Mean over seeds, against {label} displacements."
    with _rows(errors, legend_height(solvers), "Error of each marker when it is held out", note) as found:
        drawn, rows = found
        for layout, said, (axes,) in rows:
            for label, values in errors[layout].items():
                _line(axes, range(1, len(values) + 1), values, solvers.index(label), label)
            axes.set_xlabel("marker, by its number in the drawing" + said)
            axes.set_ylabel(r"$|\Delta u| + |\Delta v|$, mm")
            axes.set_xticks(range(1, len(values) + 1))
        legend_above(drawn.axes[0])
    return drawn


def draw_fields(scores: Mapping[str, Mapping[str, Mapping[str, Score]]], schemes: Sequence[str]) -> Figure:
    """Draw relative L2 distances from the truth by scheme, a row a layout, a chart for each field."""
    solvers = _solvers(scores)
    title = "Distance from the truth over the body"
    note = "Relative L², %, by what is held out; the line at 100 % is a field of zero."
    with _rows(scores, legend_height(solvers), title, note, columns=3, gap=0.5, foot=0.75) as found:
        drawn, rows = found
        for layout, said, columns in rows:
            for axes, (name, field) in zip(columns, FIELD_NAMES.items(), strict=True):
                for label, each in scores[layout].items():
                    values = [100 * each[scheme].fields[name].mean for scheme in schemes]
                    _line(axes, range(len(schemes)), values, solvers.index(label), label)
                axes.axhline(100, color="#999999", linewidth=0.6, zorder=1)
                axes.set_xticks(range(len(schemes)), schemes, rotation=45, ha="right")
                axes.set_xlabel(field + said)
            columns[0].set_ylabel("%")
        legend_above(drawn.axes[0])
    return drawn


def draw_weight_sweeps(sweeps: Mapping[str, Mapping[str, Sequence[float]]]) -> Figure:
    """Draw the errors of `fem-asm` at the markers and over the body against the weight of the markers.

    A row for each layout, with the columns of `pinnray.comparison.crossval.solver_folds.sweep_weights`.
    """
    panels: dict[str, dict[str, str]] = {
        "root mean square, mm": {"in_sample_mm": "markers given", "left_out_mm": "each held out"},
        "distance from the truth, %": FIELD_NAMES,
    }
    title = "fem-asm for other weights of the markers"
    note = "All markers given, first seed. Factors of the weight that it has."
    with _rows(sweeps, len(FIELD_NAMES) * LEGEND_LINE, title, note, columns=2, gap=0.72) as found:
        drawn, rows = found
        for layout, said, columns in rows:
            for column, (axes, (label, lines)) in enumerate(zip(columns, panels.items(), strict=True)):
                for number, (name, words) in enumerate(lines.items()):
                    values = [100 * value if column else value for value in sweeps[layout][name]]
                    colour = solver_colour(number)
                    axes.plot(sweeps[layout]["factor"], values, color=colour, lw=1.2, label=words)
                axes.set_xscale("log")
                axes.set_xlabel("factor of the weight" + said)
                axes.set_ylabel(label)
            columns[0].set_ylim(bottom=1e-4)  # mm: no camera resolves less
        for axes in drawn.axes[:2]:
            axes.legend(loc="lower left", bbox_to_anchor=(0, 1), borderaxespad=0, labelspacing=0.2)
    return drawn


@contextmanager
def _rows(
    by_layout: Mapping[str, object],
    legend: float,
    title: str,
    note: str,
    *,
    columns: int = 1,
    gap: float = 0.0,
    foot: float = 0.5,
) -> Iterator[tuple[Figure, list[tuple[str, str, list[Axes]]]]]:
    """A figure with logarithmic charts: a row a layout, with its name, words for labels, and the charts.

    Heights of legend and foot, and the gap between charts, in inches.
    """
    left, height = 0.72, 2.2
    top, pitch = 0.5 + legend, height + foot
    width = (WIDTH - left - 0.1 - (columns - 1) * gap) / columns
    with figure(top + len(by_layout) * pitch) as drawn:
        write_heading(drawn, title, note)
        rows = []
        for row, layout in enumerate(by_layout):
            boxes = [(left + at * (width + gap), top + row * pitch, width, height) for at in range(columns)]
            said = f"; {layout}" if len(by_layout) > 1 else ""
            rows.append((layout, said, [axes_at(drawn, box) for box in boxes]))
        for axes in drawn.axes:
            axes.set_yscale("log")
            axes.yaxis.set_major_formatter("{x:g}")
            axes.grid()
            axes.set_axisbelow(True)
        yield drawn, rows


def _solvers(by_layout: Mapping[str, Mapping[str, object]]) -> list[str]:
    """The solvers of all layouts."""
    return list(dict.fromkeys(label for each in by_layout.values() for label in each))


def _line(axes: Axes, x: Sequence[float], values: Sequence[float], number: int, label: str) -> None:
    """A line whose marks are shifted a little by the solver's number, so that none hides another."""
    axes.plot(
        [place + 0.03 * number for place in x],
        values,
        color=solver_colour(number),
        marker="os^Dv"[number // len(SOLVER_COLOURS) % 5],  # another shape when the colours begin again
        linestyle="-" if number < len(SOLVER_COLOURS) else "--",
        linewidth=0.9,
        markersize=3.5,
        label=label,
    )
