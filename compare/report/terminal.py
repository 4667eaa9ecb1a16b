"""The numbers of a comparison as tables for the terminal; both fit into 80 columns."""

from rich.table import Table

from compare.evaluation.comparison import Comparison
from compare.evaluation.evaluation import Evaluation
from compare.evaluation.metrics import force_error, reference_differences, truth_differences
from compare.report.tables import PAPER, Row, millimetres, printed_rows, seconds, table_one
from compare.runtime.tables import NONE, percent, terminal_table


def marker_table(comparison: Comparison) -> Table:
    """Mean absolute errors at the markers; below, for the paper's finger, the paper's own numbers."""
    observations, printed = comparison.observations, printed_rows(comparison.design)
    seen, count = int(observations.visible.sum()), len(observations.visible)
    markers = f"{count} marker{'s' * (count > 1)}" if seen == count else f"{seen} of {count} markers"
    caption = (
        "given: at markers that the solver was given, a training error.\n"
        "held out: at markers that it was not given; one that is given markers has\n"
        "all but the one that it predicts.\n"
        "sum: mean of |Δu| + |Δv| (the paper's text); rss: √(u² + v²) (its Table I)."
        + ("\npaper: as it prints them, of its own experiment and not of this run." if printed else "")
    )
    rows = zip(table_one(comparison), comparison.evaluations, strict=True)
    table = _table(
        f"Mean absolute error at {markers}, mm ({observations.label} displacements)",
        ["given\nu", "\nv", "\nsum", "\nrss", "held out\nu", "\nv", "\nsum", "\nrss"],
        [(evaluation, _means(row)) for row, evaluation in rows],
        caption,
    )
    table.add_section()
    for row in printed:
        label = f"{row.source}: {row.solver.removeprefix('PINN-Ray ')}"
        table.add_row(label, *_means(row), style="dim")
    return table


def body_table(comparison: Comparison) -> Table:
    """Distances over the body, error of the force, and time."""
    evaluations, reference, truth = comparison.evaluations, comparison.reference, comparison.truth
    lines = [f"from ref.: relative L² difference of the displacement from {reference.label}."]
    if reference.uncertainty is not None and len(evaluations) > 1:
        lines.append(f"±: error of {reference.label} itself, estimated; a smaller difference says nothing.")
    lines.append("above fem: energy of the displacement on fem's elements above the least there.")
    if truth is not None:
        lines.append("truth: relative L² difference from the simulated finger of finite strain;")
        lines.append("force: error of the size of the indenter's force.")
    rows = []
    for evaluation in evaluations:
        cells = [_from_reference(evaluation, reference), _above_fem(evaluation)]
        if truth is not None:
            found = truth_differences(evaluation, truth)
            shares = found.displacement.rel_l2, found.von_mises.rel_l2, force_error(evaluation, truth)
            cells += [percent(share, 2, sign=False) for share in shares]
        rows.append((evaluation, [*cells, seconds(evaluation)]))
    headings = ["truth\ndispl.", "\nv. Mises", "\nforce, %"] if truth else []
    headings = ["from ref.\n%", "above fem\n%", *headings, "time\ns"]
    return _table("Over the whole body", headings, rows, "\n".join(lines))


def _table(title: str, headings: list[str], rows: list[tuple[Evaluation, list[str]]], caption: str) -> Table:
    """A table whose rows are yellow where the solver did not converge."""
    table = terminal_table(title, ["solver", *headings], [], caption=caption, left=["solver"])
    table.collapse_padding, table.pad_edge = True, True
    for evaluation, cells in rows:
        style = None if evaluation.converged else "yellow"
        table.add_row(evaluation.label.replace(" (", "\n("), *cells, style=style)
    return table


def _means(row: Row) -> list[str]:
    values = [value for means in (row.given, row.held_out) for value in means or [None] * 4]
    return [NONE if value is None else millimetres(value, row.source == PAPER) for value in values]


def _from_reference(evaluation: Evaluation, reference: Evaluation) -> str:
    """The relative difference of the displacement in %, and the reference's own error."""
    if evaluation is reference:
        return NONE
    share, own = reference_differences(evaluation, reference).displacement.rel_l2, reference.uncertainty
    if own is None:
        return percent(share, sign=False)
    return f"{percent(share, 2, sign=False)}±{percent(own.displacement.rel_l2, 1, sign=False)}"


def _above_fem(evaluation: Evaluation) -> str:
    """Excess energy over the least of finite elements, %; a dash without a certificate."""
    certificate = evaluation.certificate
    if certificate is None:
        return NONE
    return percent(certificate.rel_excess if certificate.has_excess else 0.0, 2, sign=False)
