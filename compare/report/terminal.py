"""The numbers of a comparison as tables for the terminal; both fit into 80 columns."""

from rich.box import SIMPLE_HEAD
from rich.table import Table

from compare.evaluation.comparison import Comparison
from compare.evaluation.evaluation import Evaluation
from compare.evaluation.metrics import force_error, reference_differences, truth_differences
from compare.report.tables import PAPER, Row, millimetres, printed_rows, seconds, table_one
from compare.runtime.tables import NONE, percent


def marker_table(comparison: Comparison) -> Table:
    """Mean absolute errors at the markers; below, for the paper's finger, those of the paper's Table I."""
    observations, printed = comparison.observations, printed_rows(comparison.design)
    seen, count = int(observations.visible.sum()), len(observations.visible)
    markers = f"{count} marker{'s' * (count > 1)}" if seen == count else f"{seen} of {count} markers"
    table = _table(
        f"Mean absolute error at {markers}, mm ({observations.label} displacements)",
        "given: at markers that the solver was given, a training error.\n"
        "held out: at markers that it was not given; one that is given markers has\n"
        "all but the one that it predicts.\n"
        "sum: mean of |Δu| + |Δv| (the paper's text); rss: √(u² + v²) (its Table I)."
        + ("\npaper: as it prints them, of its own experiment and not of this run." if printed else ""),
    )
    for heading in ("given\nu", "\nv", "\nsum", "\nrss", "held out\nu", "\nv", "\nsum", "\nrss"):
        table.add_column(heading, justify="right", no_wrap=True)
    for row, evaluation in zip(table_one(comparison), comparison.evaluations, strict=True):
        style = None if evaluation.converged else "yellow"
        table.add_row(_name(evaluation), *_means(row), style=style)
    table.add_section()
    for row in printed:
        label = f"{row.source}: {row.solver.removeprefix('PINN-Ray ')}"
        table.add_row(label, *_means(row), style="dim")
    return table


def body_table(comparison: Comparison) -> Table:
    """Distances over the body, error of the force, and time."""
    evaluations, reference, truth = comparison.evaluations, comparison.reference, comparison.truth
    label = reference.label
    lines = [f"from ref.: relative L² difference of the displacement from {label}."]
    if reference.uncertainty is not None and len(evaluations) > 1:
        lines.append(f"±: error of {label} itself, estimated; a smaller difference says nothing.")
    lines.append("above fem: energy of the displacement on fem's elements above the least there.")
    if truth is not None:
        lines.append("truth: relative L² difference from the simulated finger of finite strain;")
        lines.append("force: error of the size of the indenter's force.")
    table = _table("Over the whole body", "\n".join(lines))
    headings = ["from ref.\n%", "above fem\n%"]
    headings += ["truth\ndispl.", "\nv. Mises", "\nforce, %"] * (truth is not None)
    for heading in [*headings, "time\ns"]:
        table.add_column(heading, justify="right", no_wrap=True)
    for evaluation in evaluations:
        distance = reference_differences(evaluation, reference).displacement.rel_l2
        cells = [NONE if evaluation is reference else _with_own_error(distance, reference)]
        cells.append(above_fem(evaluation))
        if truth is not None:
            found = truth_differences(evaluation, truth)
            fields = found.displacement.rel_l2, found.von_mises.rel_l2
            cells += [percent(value, 2, sign=False) for value in (*fields, force_error(evaluation, truth))]
        style = None if evaluation.converged else "yellow"
        table.add_row(_name(evaluation), *cells, seconds(evaluation), style=style)
    return table


def above_fem(evaluation: Evaluation) -> str:
    """Excess energy over the least of finite elements, %; a dash without a certificate."""
    certificate = evaluation.certificate
    if certificate is None:
        return NONE
    return percent(certificate.rel_excess if certificate.has_excess else 0.0, 2, sign=False)


def _table(title: str, caption: str) -> Table:
    table = Table(
        title=title,
        caption=caption,
        box=SIMPLE_HEAD,
        collapse_padding=True,
        title_justify="left",
        caption_justify="left",
    )
    table.add_column("solver", no_wrap=True)
    return table


def _name(evaluation: Evaluation) -> str:
    return evaluation.label.replace(" (", "\n(")


def _means(row: Row) -> list[str]:
    values = [value for means in (row.given, row.held_out) for value in means or [None] * 4]
    return [NONE if value is None else millimetres(value, row.source == PAPER) for value in values]


def _with_own_error(distance: float, reference: Evaluation) -> str:
    """The relative difference in %, and that of the reference from the exact solution."""
    own = reference.uncertainty
    if own is None:
        return percent(distance, sign=False)
    return f"{percent(distance, 2, sign=False)}±{percent(own.displacement.rel_l2, 1, sign=False)}"
