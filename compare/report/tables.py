"""The numbers of a comparison as CSV files and for the terminal, among them Table I of the paper.

The paper gives all nine markers to the solver that assimilates them, and judges it by the same nine: that is
a training error. Errors at markers that a solver was not given are other columns here.
"""

from pathlib import Path
from typing import NamedTuple

from rich.table import Table

from pinnray.comparison.evaluation.certificate import Certificate
from pinnray.comparison.evaluation.comparison import Results
from pinnray.comparison.evaluation.evaluation import Evaluation, ReferenceDifferences
from pinnray.comparison.evaluation.metrics import (
    MEANS,
    RIGID,
    TruthDifferences,
    at_markers,
    force_error,
    held_out_errors,
    marker_errors,
    reference_differences,
    truth_differences,
)
from pinnray.geometry.finger.design import Design
from pinnray.geometry.finger.finger import Finger
from pinnray.geometry.finger.parameters import SYMBOLS
from pinnray.runtime.tables import NONE, Cell, percent, terminal_table, write_csv

Means = tuple[float, float, float | None, float]
"""Mean absolute errors at the markers in the order of `MEANS`, mm; None where it is not printed."""


class Row(NamedTuple):
    """One solver's errors in Table I."""

    solver: str  # its label
    source: str  # of the displacements of the markers
    given: Means | None  # at markers that it was given; None if it was given none
    held_out: Means | None  # at markers that it was not given: all, or each in its turn; None if unknown


PAPER = "paper"
PRINTED = (
    Row("FEM", PAPER, None, (1.41, 0.39, None, 1.463)),
    Row("PINN-Ray std", PAPER, None, (1.37, 0.48, None, 1.452)),
    Row("PINN-Ray asm", PAPER, (0.03, 0.00, None, 0.03), None),
)
"""Table I as it is printed: nine markers of the paper's own experiment, whose data is not published.

Source: X. Wang et al., PINN-Ray, arXiv:2407.08222, Table I.
"""


def printed_rows(finger: Finger) -> tuple[Row, ...]:
    """The rows that the paper prints, for a finger with its nine parameters; none for another."""
    own, paper = finger.definition(), Design()
    same = all(own.get(name) == getattr(paper, name) for name in SYMBOLS.values())
    return PRINTED if same else ()


def table_one(comparison: Results) -> list[Row]:
    """A row of Table I for each evaluation of this run at its markers; see `at_markers`."""
    rows, observations = [], comparison.observations
    for evaluation in at_markers(comparison.evaluations, observations):
        given = marker_errors(evaluation, observations)[2:] if evaluation.in_sample else None
        held_out = held_out_errors(evaluation, observations)
        rows.append(Row(evaluation.label, observations.label, given, held_out and held_out[2:]))
    return rows


def millimetres(error: float, printed: bool = False) -> str:
    """A mean error, mm, to 0.001; of those that the paper prints, without a last zero, as there."""
    text = f"{error:.3f}"
    return text.removesuffix("0") if printed else text


def write_table_one(path: Path, comparison: Results) -> None:
    """Write a row a solver, then `printed_rows`; cells without a number are empty."""
    found = at_markers(comparison.evaluations, comparison.observations)
    own = [(each.solver, int(each.converged)) for each in found]
    printed = printed_rows(comparison.design)
    names: list[tuple[str, Cell]] = [*own, *((row.solver, "") for row in printed)]
    rows: list[dict[str, Cell]] = []
    for (name, converged), row in zip(names, (*table_one(comparison), *printed), strict=True):
        rows.append({"solver": name, "converged": converged, "observations": row.source})
        for column, means in (("in_sample", row.given), ("held_out", row.held_out)):
            for mean, value in zip(MEANS, means or [None] * len(MEANS), strict=True):
                rows[-1][f"{column}_{mean}_mm"] = "" if value is None else value
    write_csv(path, rows)


def write_markers(path: Path, comparison: Results) -> None:
    """Write a row a marker: its place and observed motion, every solver's displacement and its errors.

    A displacement is what the measurement's pictures show of it, if the solver found their frames.

    The cells of observations and errors are empty at markers that were not seen; those of held-out errors
    are also empty where a solver that was given the marker does not tell its prediction without it.
    """
    observations = comparison.observations
    errors = [
        (each, marker_errors(each, observations), held_out_errors(each, observations))
        for each in comparison.evaluations
    ]
    rows: list[dict[str, Cell]] = []
    for marker, (x, y) in enumerate(observations.points.tolist()):
        seen = bool(observations.visible[marker])
        u, v = observations.displacements[marker].tolist()
        row: dict[str, Cell] = {"marker": marker + 1, "x_mm": x, "y_mm": y}
        row |= {"observations": observations.label, "visible": int(seen)}
        row |= {"observed_u_mm": u if seen else "", "observed_v_mm": v if seen else ""}
        for each, error, held_out in errors:
            name, (own_u, own_v) = each.solver, each.shown_displacement[marker].tolist()
            row |= {f"{name}_converged": int(each.converged), f"{name}_in_sample": int(each.in_sample)}
            row |= {f"{name}_u_mm": own_u, f"{name}_v_mm": own_v}
            for kind, found in (("ae", error), ("held_out_ae", held_out)):
                for axis in "uv":
                    known = found is not None and seen
                    value = float(getattr(found, f"ae_{axis}")[marker]) if known else ""
                    row[f"{name}_{kind}_{axis}_mm"] = value
        rows.append(row)
    write_csv(path, rows)


def write_summary(path: Path, comparison: Results) -> None:
    """Write a row a solver: errors at the markers, distances over the body, energy, reaction, status."""
    write_csv(path, [_summary(evaluation, comparison) for evaluation in comparison.evaluations])


def seconds(evaluation: Evaluation) -> str:
    """Time of the solve, s, or a dash if it is not recorded."""
    value = evaluation.stats.get("seconds")
    if not isinstance(value, int | float):
        return "–"
    return f"{value:.{2 if value < 10 else 1 if value < 100 else 0}f}"


def _summary(evaluation: Evaluation, comparison: Results) -> dict[str, Cell]:
    observations, reference, truth = comparison.observations, comparison.reference, comparison.truth
    errors, to = marker_errors(evaluation, observations), reference_differences(evaluation, reference)
    row: dict[str, Cell] = {"solver": evaluation.solver, "converged": int(evaluation.converged)}
    row |= {"in_sample": int(evaluation.in_sample)}
    row |= {"observations": observations.label, "reference": reference.solver}
    row |= {f"{name}_mm": getattr(errors, name) if observations.known else "" for name in MEANS}
    held_out = held_out_errors(evaluation, observations)
    for name in MEANS:
        row[f"held_out_{name}_mm"] = getattr(held_out, name) if held_out else ""
    row |= _differences("to_reference", to)
    empty = dict.fromkeys(_differences("reference_uncertainty", to), "")
    own = reference.uncertainty
    row |= _differences("reference_uncertainty", own) if own else empty
    true = None if truth is None else truth_differences(evaluation, truth)
    for name in TruthDifferences._fields:
        row[f"to_truth_{name}_rel_l2"] = getattr(true, name).rel_l2 if true else ""
    row["to_truth_force_rel"] = "" if truth is None else force_error(evaluation, truth)
    row |= {"energy_N_mm_per_mm": evaluation.energy}
    row |= _certificate(evaluation.certificate)
    row |= {f"reaction_{axis}_N_per_mm": float(evaluation.reaction[n]) for n, axis in enumerate("uv")}
    row |= {"seconds_s": evaluation.stats.get("seconds", ""), "status": evaluation.message}
    return row


def _certificate(certificate: Certificate | None) -> dict[str, Cell]:
    """The certificate in a few cells, which are empty without one."""
    names = ("rel_excess", "rel_violation", "energy_norm_error", "weak_residual", "imbalance")
    headers = [f"{name.removeprefix('rel_')}_rel" for name in names]
    headers += ["misses_energy", "base_off_mm", "load_off_u_mm", "load_off_v_mm"]
    if certificate is None:
        return dict.fromkeys(headers, "")
    values = [getattr(certificate, name) for name in names]
    values += [int(certificate.misses_energy), certificate.base, *certificate.load.tolist()]
    return dict(zip(headers, values, strict=True))


def _differences(what: str, differences: ReferenceDifferences) -> dict[str, Cell]:
    """Three cells a field and two more; dimensionless quantities carry the unit 1."""
    fields = {"displacement": (differences.displacement, "mm"), "von_mises": (differences.von_mises, "MPa")}
    fields |= {f"stress_{name}": (difference, "MPa") for name, difference in differences.stress.items()}
    fields |= {f"strain_{name}": (difference, "1") for name, difference in differences.strain.items()}
    row: dict[str, Cell] = {}
    for name, (difference, unit) in fields.items():
        row[f"{what}_{name}_rel_l2"] = difference.rel_l2
        row[f"{what}_{name}_mean_{unit}"] = difference.mean
        row[f"{what}_{name}_p95_{unit}"] = difference.p95
    return row | {
        f"{what}_markers_mae_sum_mm": differences.mae_markers,
        f"{what}_energy_rel": differences.energy,
    }


def marker_table(comparison: Results) -> Table:
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
    found = at_markers(comparison.evaluations, observations)
    if len(found) > len(comparison.evaluations):
        caption += f"\n{RIGID}: turned and shifted to be nearest to the pressed picture."
    rows = zip(table_one(comparison), found, strict=True)
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


def body_table(comparison: Results) -> Table:
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
        table.add_row(evaluation.label.replace(" (", "\n(").replace(", ", ",\n"), *cells, style=style)
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
