"""The numbers of a comparison as CSV files and as a table for the terminal."""

import csv
from collections.abc import Sequence
from pathlib import Path

from rich.box import SIMPLE_HEAD
from rich.table import Table

from compare.certificate import Certificate
from compare.differences import ReferenceDifferences
from compare.evaluation import Evaluation
from compare.figures.labels import IN_SAMPLE, significant, solver_at_markers, solver_label
from compare.metrics import MarkerErrors, held_out_errors, marker_errors, reference_differences
from geometry.atomic import atomic_path
from geometry.observations import Observations

LEFT_OUT = "  each left out"
"""Says of a row that each marker was left out in its turn."""

Cell = str | int | float | bool


def write_markers(path: Path, *, evaluations: Sequence[Evaluation], observations: Observations) -> None:
    """Write a row a marker: where it was, how it moved, what each solver says and how far off that is.

    The cells of observations and errors are empty at markers that were not seen.
    """
    rows: list[dict[str, Cell]] = []
    errors = [marker_errors(evaluation, observations) for evaluation in evaluations]
    for marker, (x, y) in enumerate(observations.points):
        seen = bool(observations.visible[marker])
        u, v = observations.displacements[marker]
        row: dict[str, Cell] = {"marker": marker + 1, "x_mm": float(x), "y_mm": float(y)}
        row |= {"observations": observations.label, "visible": int(seen)}
        row |= {"observed_u_mm": float(u) if seen else "", "observed_v_mm": float(v) if seen else ""}
        for evaluation, error in zip(evaluations, errors, strict=True):
            name = evaluation.solver
            own_u, own_v = (float(value) for value in evaluation.marker_displacement[marker])
            row |= {
                f"{name}_converged": int(evaluation.converged),
                f"{name}_in_sample": int(evaluation.in_sample),
            }
            row |= {f"{name}_u_mm": own_u, f"{name}_v_mm": own_v}
            row[f"{name}_ae_u_mm"] = float(error.ae_u[marker]) if seen else ""
            row[f"{name}_ae_v_mm"] = float(error.ae_v[marker]) if seen else ""
        rows.append(row)
    write_csv(path, rows)


def write_summary(
    path: Path, *, evaluations: Sequence[Evaluation], observations: Observations, reference: Evaluation
) -> None:
    """Write a row a solver: errors at the markers, distance from the reference, energy, reaction, status."""
    write_csv(path, [_summary(evaluation, observations, reference) for evaluation in evaluations])


def write_csv(path: Path, rows: Sequence[dict[str, Cell]]) -> None:
    """Write rows with equal keys under a header, atomically; numbers keep all their digits."""
    with atomic_path(path) as partial, partial.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, fieldnames=list(rows[0]), lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)


def mae_table(evaluations: Sequence[Evaluation], observations: Observations, reference: Evaluation) -> Table:
    """Mean absolute errors at the markers and the distance from the reference, for the terminal."""
    seen, count = int(observations.visible.sum()), len(observations.visible)
    markers = f"{count} marker{'s' * (count > 1)}" if seen == count else f"{seen} of {count} markers"
    table = Table(
        title=f"Mean absolute error at {markers}, mm ({observations.label} displacements)",
        caption=(
            "sum: mean of |Δu| + |Δv| (the paper's text); rss: √(u² + v²) of the two means (its Table I).\n"
            f"L²: relative difference of the displacement from the reference, {solver_label(reference)}.\n"
            f"{_own_error(reference) if len(evaluations) > 1 else ''}"
            "above fem: energy of the displacement on fem's elements above the least there."
            f"{_in_sample(evaluations)}"
        ),
        box=SIMPLE_HEAD,
        collapse_padding=True,
        title_justify="left",
        caption_justify="left",
    )
    table.add_column("solver", no_wrap=True)
    for heading in ("u", "v", "sum", "rss", "L²\n%", "energy\nN mm/mm", "above\nfem, %", "time\ns"):
        table.add_column(heading, justify="right", no_wrap=True)
    for evaluation in evaluations:
        errors = marker_errors(evaluation, observations)
        distance = reference_differences(evaluation, reference).displacement.rel_l2
        table.add_row(
            solver_at_markers(evaluation).replace(" (", "\n("),
            *_three_digits(errors),
            "–" if evaluation is reference else _with_own_error(distance, reference),
            f"{evaluation.energy:.4g}",
            above_fem(evaluation),
            seconds(evaluation),
            style=None if evaluation.converged else "yellow",
        )
        if evaluation.left_out is not None:
            left_out = held_out_errors(evaluation, observations)
            table.add_row(LEFT_OUT, *(_three_digits(left_out) if left_out else ()))
    return table


def _three_digits(errors: MarkerErrors) -> list[str]:
    return [f"{value:.3f}" for value in (errors.mae_u, errors.mae_v, errors.mae_sum, errors.mae_rss)]


def _in_sample(evaluations: Sequence[Evaluation]) -> str:
    """What the mark beside a solver's name means, if there is one."""
    return f"\n{IN_SAMPLE}." if any(evaluation.in_sample for evaluation in evaluations) else ""


def _own_error(reference: Evaluation) -> str:
    """What ± stands for, if it appears."""
    if reference.uncertainty is None:
        return ""
    return f"±: error of {solver_label(reference)} itself, estimated; a smaller difference says nothing.\n"


def _with_own_error(distance: float, reference: Evaluation) -> str:
    """The relative difference in %, and that of the reference from the exact solution."""
    own = reference.uncertainty
    if own is None:
        return significant(100 * distance, 3)
    percent = f"{100 * distance:.0f}" if distance >= 1 else f"{100 * distance:.2g}"
    return f"{percent}±{100 * own.displacement.rel_l2:.1g}"


def seconds(evaluation: Evaluation) -> str:
    """How long the solver took, s, or a dash if it does not say."""
    value = evaluation.stats.get("seconds")
    if not isinstance(value, int | float):
        return "–"
    return f"{value:.{2 if value < 10 else 1 if value < 100 else 0}f}"


def above_fem(evaluation: Evaluation) -> str:
    """By how much the energy is above the least of finite elements, %; a dash where that is no measure."""
    certificate = evaluation.certificate
    if certificate is None:
        return "–"
    percent = 100 * certificate.rel_excess if certificate.has_excess else 0.0
    return f"{percent:.1f}" if percent >= 1 else f"{percent:.1g}"


def _summary(evaluation: Evaluation, observations: Observations, reference: Evaluation) -> dict[str, Cell]:
    errors, to = marker_errors(evaluation, observations), reference_differences(evaluation, reference)
    row: dict[str, Cell] = {"solver": evaluation.solver, "converged": int(evaluation.converged)}
    row |= {"in_sample": int(evaluation.in_sample)}
    row |= {"observations": observations.label, "reference": reference.solver}
    row |= {"mae_u_mm": errors.mae_u, "mae_v_mm": errors.mae_v}
    row |= {"mae_sum_mm": errors.mae_sum, "mae_rss_mm": errors.mae_rss}
    held_out = held_out_errors(evaluation, observations)
    for name in ("mae_u", "mae_v", "mae_sum", "mae_rss"):
        row[f"held_out_{name}_mm"] = getattr(held_out, name) if held_out else ""
    row |= _differences("to_reference", to)
    empty = dict.fromkeys(_differences("reference_uncertainty", to), "")
    own = reference.uncertainty
    row |= _differences("reference_uncertainty", own) if own else empty
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
