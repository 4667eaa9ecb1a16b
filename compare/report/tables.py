"""The numbers of a comparison as CSV files."""

from pathlib import Path

from compare.evaluation.certificate import Certificate
from compare.evaluation.comparison import MEANS, Comparison
from compare.evaluation.differences import ReferenceDifferences
from compare.evaluation.evaluation import Evaluation
from compare.evaluation.metrics import (
    TruthDifferences,
    held_out_errors,
    marker_errors,
    reference_differences,
    truth_differences,
)
from compare.runtime.csv_files import Cell, write_csv


def write_markers(path: Path, comparison: Comparison) -> None:
    """Write a row a marker: where it was, how it moved, what each solver says and how far off that is.

    The cells of observations and errors are empty at markers that were not seen.
    """
    observations, evaluations = comparison.observations, comparison.evaluations
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


def write_summary(path: Path, comparison: Comparison) -> None:
    """Write a row a solver: errors at the markers, distances over the body, energy, reaction, status."""
    write_csv(path, [_summary(evaluation, comparison) for evaluation in comparison.evaluations])


def seconds(evaluation: Evaluation) -> str:
    """Time of the solve, s, or a dash if it is not recorded."""
    value = evaluation.stats.get("seconds")
    if not isinstance(value, int | float):
        return "–"
    return f"{value:.{2 if value < 10 else 1 if value < 100 else 0}f}"


def _summary(evaluation: Evaluation, comparison: Comparison) -> dict[str, Cell]:
    observations, reference, truth = comparison.observations, comparison.reference, comparison.truth
    errors, to = marker_errors(evaluation, observations), reference_differences(evaluation, reference)
    row: dict[str, Cell] = {"solver": evaluation.solver, "converged": int(evaluation.converged)}
    row |= {"in_sample": int(evaluation.in_sample)}
    row |= {"observations": observations.label, "reference": reference.solver}
    row |= {"mae_u_mm": errors.mae_u, "mae_v_mm": errors.mae_v}
    row |= {"mae_sum_mm": errors.mae_sum, "mae_rss_mm": errors.mae_rss}
    held_out = held_out_errors(evaluation, observations)
    for name in MEANS:
        row[f"held_out_{name}_mm"] = getattr(held_out, name) if held_out else ""
    row |= _differences("to_reference", to)
    empty = dict.fromkeys(_differences("reference_uncertainty", to), "")
    own = reference.uncertainty
    row |= _differences("reference_uncertainty", own) if own else empty
    row |= _to_truth(None if truth is None else truth_differences(evaluation, truth))
    row |= {"energy_N_mm_per_mm": evaluation.energy}
    row |= _certificate(evaluation.certificate)
    row |= {f"reaction_{axis}_N_per_mm": float(evaluation.reaction[n]) for n, axis in enumerate("uv")}
    row |= {"seconds_s": evaluation.stats.get("seconds", ""), "status": evaluation.message}
    return row


def _to_truth(differences: TruthDifferences | None) -> dict[str, Cell]:
    """The distances from the virtual experiment's fields, which are empty where markers were measured."""
    row: dict[str, Cell] = {f"to_truth_{name}_rel_l2": "" for name in TruthDifferences._fields}
    if differences is not None:
        row |= {f"to_truth_{name}_rel_l2": each.rel_l2 for name, each in differences._asdict().items()}
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
