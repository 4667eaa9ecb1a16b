"""Charts: errors at the markers, and energy on the way to the solution."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes

from compare.evaluation import Evaluation
from compare.figures.labels import solver_label
from compare.figures.style import INK, MUTED, WIDTH, axes_at, figure, heading, solver_colour
from compare.metrics import marker_errors
from geometry.arrays import BoolArray, FloatArray
from geometry.observations import Observations

BAR_LEFT, BAR_HEIGHT = 0.55, 1.45
LOG_RATIO = 20.0
"""A column whose largest value exceeds its smallest by this factor is drawn on a logarithmic axis."""


def draw_marker_errors(path: Path, *, evaluations: Sequence[Evaluation], observations: Observations) -> None:
    """Bars of |du| and |dv| at every marker, grouped by marker, one colour a solver (Fig. 6 of the paper)."""
    errors = [marker_errors(evaluation, observations) for evaluation in evaluations]
    names = [solver_label(evaluation) for evaluation in evaluations]
    head, gap = 0.52, 0.45
    with figure(path, head + 2 * (BAR_HEIGHT + gap) + 0.05) as drawn:
        heading(
            drawn,
            f"Absolute error at the markers, against {observations.label} displacements",
            "marker 1 is nearest the base",
        )
        for row, (symbol, columns, means) in enumerate(
            [
                ("u", [error.ae_u for error in errors], [error.mae_u for error in errors]),
                ("v", [error.ae_v for error in errors], [error.mae_v for error in errors]),
            ]
        ):
            top = head + row * (BAR_HEIGHT + gap)
            axes = axes_at(drawn, (BAR_LEFT, top, WIDTH - BAR_LEFT - 0.1, BAR_HEIGHT))
            labels = [f"{name}, mean {mean:.3g} mm" for name, mean in zip(names, means, strict=True)]
            _bars(axes, columns, labels, observations.visible)
            axes.set_ylabel(rf"$|\Delta {symbol}|$, mm")
        axes.set_xlabel("marker")


def _bars(axes: Axes, columns: Sequence[FloatArray], labels: Sequence[str], visible: BoolArray) -> None:
    count = len(visible)
    width = 0.8 / len(columns)
    for number, (values, label) in enumerate(zip(columns, labels, strict=True)):
        x = np.arange(1, count + 1) + (number - (len(columns) - 1) / 2) * width
        axes.bar(x[visible], values[visible], width * 0.94, color=solver_colour(number), label=label)
    for marker in np.flatnonzero(~visible) + 1:
        axes.text(marker, 0.02, "not seen", rotation=90, size=7, color=MUTED, ha="center", va="bottom",
                  transform=axes.get_xaxis_transform())  # fmt: skip
    axes.set_xticks(range(1, count + 1) if count <= 20 else range(1, count + 1, 5))
    axes.set_xlim(0.4, count + 0.6)
    axes.margins(y=0.02)
    axes.grid(axis="y", color="#dddddd", linewidth=0.5)
    axes.set_axisbelow(True)
    ceiling = max(float(np.nanmax(values)) for values in columns) or 1.0
    axes.set_ylim(0, ceiling * (1.02 + 0.13 * -(-len(labels) // 2)))
    axes.legend(
        loc="upper left", ncols=2, handlelength=1.0, handletextpad=0.5, columnspacing=1.2, borderaxespad=0.1
    )


def recorded(evaluations: Sequence[Evaluation]) -> dict[tuple[str, str], list[Evaluation]]:
    """The evaluations that have a record, by its abscissa (the first column) and the column to draw over it.

    That is `energy` where there is one, else the second column.
    """
    groups: dict[tuple[str, str], list[Evaluation]] = {}
    for evaluation in evaluations:
        abscissa, *others = list(evaluation.history) or [""]
        if others and len(evaluation.history[abscissa]):
            column = "energy" if "energy" in others else others[0]
            groups.setdefault((abscissa, column), []).append(evaluation)
    return groups


def draw_energy(path: Path, *, evaluations: Sequence[Evaluation], reference: Evaluation) -> bool:
    """Draw every solver's record, a chart for each kind of record; the reference's energy is a line.

    Returns:
        Whether there was a record to draw.
    """
    groups = recorded(evaluations)
    if not groups:
        return False
    order = [evaluation.solver for evaluation in evaluations]
    head, height, gap = 0.36, 1.6, 0.5
    with figure(path, head + len(groups) * (height + gap)) as drawn:
        heading(drawn, "Energy on the way to the solution")
        for row, ((abscissa, column), members) in enumerate(groups.items()):
            left = 0.75
            axes = axes_at(drawn, (left, head + row * (height + gap), WIDTH - left - 0.12, height))
            for evaluation in members:
                _curve(axes, abscissa, column, evaluation, solver_colour(order.index(evaluation.solver)))
            if column == "energy":
                label = f"{solver_label(reference)}, {reference.energy:.4g} N mm/mm"
                axes.axhline(
                    reference.energy, color=INK, linewidth=0.9, linestyle=(0, (4, 2)), label=label, zorder=1
                )
            _axes(axes, abscissa, column, [evaluation.history for evaluation in members])
    return True


def _curve(axes: Axes, abscissa: str, column: str, evaluation: Evaluation, colour: str) -> None:
    x, y = evaluation.history[abscissa], evaluation.history[column]
    marker = "o" if len(x) <= 40 else ""
    label = f"{solver_label(evaluation)}, ends at {y[-1]:.4g}"
    axes.plot(x, y, color=colour, linewidth=1.2, marker=marker, markersize=3, label=label, zorder=2)


def _axes(axes: Axes, abscissa: str, column: str, histories: Sequence[object]) -> None:
    axes.set_xlabel(readable(abscissa))
    axes.set_ylabel("energy, N mm/mm" if column == "energy" else readable(column))
    for axis, lines in (
        ("x", [line.get_xdata() for line in axes.get_lines()]),
        ("y", [line.get_ydata() for line in axes.get_lines()]),
    ):
        values = np.concatenate([np.asarray(data, dtype=np.float64) for data in lines])
        if wants_log(values):
            axes.set(**{f"{axis}scale": "log"})
    axes.grid(color="#dddddd", linewidth=0.5)
    axes.legend(loc="upper right")


def wants_log(values: FloatArray) -> bool:
    """Whether a logarithmic axis helps: all values are positive and they span more than `LOG_RATIO`."""
    finite = values[np.isfinite(values)]
    return bool(finite.size and finite.min() > 0 and finite.max() > LOG_RATIO * finite.min())


def readable(name: str) -> str:
    """A column's name for an axis: `seconds` is a unit already, the rest loses its underscores."""
    return {"seconds": "time, s", "energy": "energy, N mm/mm"}.get(name, name.replace("_", " "))
