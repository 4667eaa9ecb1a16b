"""Files of a comparison for other programs: `metrics.json`, and fields as VTK grids (.vtu) for ParaView.

Units: mm, MPa, N/mm, s.
"""

import math
import unicodedata
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pyvista
from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridWriter

from pinnray.comparison.evaluation.comparison import Results
from pinnray.comparison.evaluation.evaluation import Evaluation, FieldDifference, ReferenceDifferences
from pinnray.comparison.evaluation.metrics import (
    COMPONENTS,
    MEANS,
    MarkerErrors,
    force_error,
    held_out_errors,
    marker_errors,
    reference_differences,
    truth_differences,
    without_rigid_motion,
)
from pinnray.geometry.mesh.triangle_mesh import TriangleMesh
from pinnray.geometry.observations import Observations
from pinnray.runtime.atomic import write_text
from pinnray.solvers.finger_figures import FingerFigures
from pinnray.solvers.solution import IdentifiedForce

SCHEMA = 1
"""Keys may be added to a schema; a key that is renamed or removed makes a new one."""

ABSENT = {
    "twin",
    "force",
    "position",
    "figures",
    "certificate",
    "held_out",
    "rigid_motion_off",
    "uncertainty",
    "reference_uncertainty",
    "to_truth",
}
"""Keys of a solver in `metrics.json` whose null says that it has none of these."""


def metrics(comparison: Results) -> dict[str, Any]:
    """The content of `metrics.json`.

    `markers` compares with every marker that was seen. `held_out` compares with markers that the solver was
    not given: those same markers for a solver that was given none; each marker held out in its turn for one
    that assimilated them, null if it does not tell. `to_truth` is null where the markers were measured,
    since nobody knows the fields of a real finger.

    Any number can be NaN, such as the error at a marker that was not seen. The file has null for it, which
    `solver_numbers` undoes.
    """
    observations = comparison.observations
    return {
        "schema": SCHEMA,
        "design": comparison.design.definition(),
        "material": comparison.material.model_dump(),
        "load": comparison.load.model_dump(),
        "measurements": {
            "source": observations.label,
            "description": observations.source,
            "markers": int(observations.visible.sum()),
        },
        "warnings": list(comparison.warnings),
        "reference": comparison.reference.solver,
        "solvers": {
            evaluation.solver: _solver(evaluation, comparison) for evaluation in comparison.evaluations
        },
    }


def solver_numbers(content: Mapping[str, Any]) -> dict[str, Any]:
    """The solvers in the content of a file `metrics.json`: NaN where null stands for a number.

    JSON has no word for a number that is not finite, such as the force by a solver that finds none.
    """

    def read(value: Any, key: str) -> Any:
        if isinstance(value, Mapping):
            return {name: read(entry, name) for name, entry in value.items()}
        if isinstance(value, list):
            return [read(entry, key) for entry in value]
        return math.nan if value is None and key not in ABSENT else value

    return {name: read(own, "") for name, own in content["solvers"].items()}


def _solver(evaluation: Evaluation, comparison: Results) -> dict[str, Any]:
    observations, reference, truth = comparison.observations, comparison.reference, comparison.truth
    errors, held_out = marker_errors(evaluation, observations), held_out_errors(evaluation, observations)
    differences = reference_differences(evaluation, reference)
    return {
        "family": evaluation.family,
        "twin": evaluation.twin,
        "law": evaluation.law,
        "status": "converged" if evaluation.converged else "not converged",
        "message": evaluation.message,
        "seconds": float(evaluation.stats.get("seconds", math.nan)),
        "energy": evaluation.energy,
        "reaction": evaluation.reaction.tolist(),
        "stats": dict(evaluation.stats),
        "force": evaluation.identified and _force(evaluation.identified),
        "figures": evaluation.figures and _figures(evaluation.figures),
        "certificate": evaluation.certificate and evaluation.certificate.numbers(),
        "markers": {
            "in_sample": evaluation.in_sample,
            "ae_u": errors.ae_u.tolist(),
            "ae_v": errors.ae_v.tolist(),
            **_means(errors),
        },
        "held_out": held_out
        and {"ae_u": held_out.ae_u.tolist(), "ae_v": held_out.ae_v.tolist(), **_means(held_out)},
        "rigid_motion_off": _without_rigid_motion(evaluation, observations),
        "uncertainty": _own_uncertainty(evaluation),
        "to_reference": _differences(differences)
        | {"reference_uncertainty": reference.uncertainty and _differences(reference.uncertainty)},
        "to_truth": None if truth is None else _by_component(truth_differences(evaluation, truth)._asdict()),
        "force_to_truth_rel": math.nan if truth is None else force_error(evaluation, truth),
    }


def _force(force: IdentifiedForce) -> dict[str, Any]:
    parts = {"size": force.size, "position": force.position}
    return {name: part and part._asdict() for name, part in parts.items()}


def _figures(figures: FingerFigures) -> dict[str, Any]:
    places = {name: list(place) for name, place in figures.places.items()}
    return {"values": figures.columns(), "places": places}


def _without_rigid_motion(evaluation: Evaluation, observations: Observations) -> dict[str, float] | None:
    moved = without_rigid_motion(evaluation, observations)
    return None if moved is None else _means(marker_errors(moved, observations))


def _means(errors: MarkerErrors) -> dict[str, float]:
    return {name: getattr(errors, name) for name in MEANS}


def _own_uncertainty(evaluation: Evaluation) -> dict[str, Any] | None:
    own, markers = evaluation.uncertainty, evaluation.marker_uncertainty
    if own is None or markers is None:
        return None
    return {
        "energy_norm": math.sqrt(abs(own.energy)),
        "rel_l2_displacement": own.displacement.rel_l2,
        "rel_l2_von_mises": own.von_mises.rel_l2,
        "mae_markers": own.mae_markers,
        "markers_u": markers[:, 0].tolist(),
        "markers_v": markers[:, 1].tolist(),
    }


def _differences(differences: ReferenceDifferences) -> dict[str, Any]:
    return {
        "rel_l2_displacement": differences.displacement.rel_l2,
        "rel_l2_von_mises": differences.von_mises.rel_l2,
        "mae_markers": differences.mae_markers,
        "rel_energy": differences.energy,
        "displacement": differences.displacement._asdict(),
        "von_mises": differences.von_mises._asdict(),
        "stress": _by_component(differences.stress),
        "strain": _by_component(differences.strain),
    }


def _by_component(differences: Mapping[str, FieldDifference]) -> dict[str, dict[str, float]]:
    return {name: difference._asdict() for name, difference in differences.items()}


SYMMETRIC = ("XX", "YY", "ZZ", "XY", "YZ", "XZ")
"""VTK's order of the six components of a symmetric tensor."""


def write_vtu(path: Path, mesh: TriangleMesh, evaluation: Evaluation) -> None:
    """Write one solver's fields on the shared mesh, atomically; see `field_grid`."""
    _write(path, field_grid(mesh, evaluation))


def field_grid(mesh: TriangleMesh, evaluation: Evaluation) -> pyvista.UnstructuredGrid:
    """One solver's fields on the shared mesh as a grid of VTK.

    At the nodes: `displacement_mm` (u, v, 0), and where the solver estimates it, its standard deviation
    `displacement_deviation_mm`.

    In the triangles, each the area-weighted mean over the triangle: `strain_xx`, `strain_yy`, `strain_xy`
    (the tensor's component, half the engineering shear), `stress_MPa` (Cauchy; six components named XX to XZ,
    of which YZ and XZ are zero), `stress_zz_MPa`, `von_mises_MPa`, `energy_density_MPa`. At
    their centroids, where the solver estimates it, `von_mises_deviation_MPa`, a standard deviation.

    For the whole: `solver`, `converged` (1 or 0), `status`, `energy_N_mm_per_mm`, `reaction_N_per_mm`.
    """
    grid = _grid(mesh)
    grid.point_data["displacement_mm"] = np.pad(evaluation.node_displacement, ((0, 0), (0, 1)))
    if evaluation.node_deviation is not None:
        deviation = np.pad(evaluation.node_deviation, ((0, 0), (0, 1)))
        grid.point_data["displacement_deviation_mm"] = deviation
    if evaluation.von_mises_deviation is not None:
        grid.cell_data["von_mises_deviation_MPa"] = evaluation.von_mises_deviation
    strain = evaluation.per_triangle(evaluation.strain)
    for name, (row, column) in COMPONENTS.items():
        grid.cell_data[f"strain_{name}"] = strain[:, row, column]
    stress, stress_zz = (
        evaluation.per_triangle(values) for values in (evaluation.stress, evaluation.stress_zz)
    )
    components = [stress[:, 0, 0], stress[:, 1, 1], stress_zz, stress[:, 0, 1]]
    grid.cell_data["stress_MPa"] = np.pad(np.column_stack(components), ((0, 0), (0, 2)))
    for number, name in enumerate(SYMMETRIC):
        grid.GetCellData().GetArray("stress_MPa").SetComponentName(number, name)
    grid.cell_data["stress_zz_MPa"] = stress_zz
    grid.cell_data["von_mises_MPa"] = evaluation.per_triangle(evaluation.von_mises)
    grid.cell_data["energy_density_MPa"] = evaluation.per_triangle(evaluation.energy_density)
    grid.field_data["solver"] = [evaluation.solver]
    grid.field_data["converged"] = [int(evaluation.converged)]
    grid.field_data["status"] = [_ascii(evaluation.message)]
    grid.field_data["energy_N_mm_per_mm"] = [evaluation.energy]
    grid.field_data["reaction_N_per_mm"] = evaluation.reaction[None]
    return grid


def _ascii(text: str) -> str:
    """The text in the only letters that VTK takes: no-break spaces and minus signs become plain ones."""
    plain = unicodedata.normalize("NFKC", text).replace("−", "-")
    return plain.encode("ascii", "replace").decode("ascii")


def write_mesh(path: Path, mesh: TriangleMesh) -> None:
    """Write the mesh atomically, with point data `boundary_NAME` and `marker` (its number, or 0)."""
    grid = _grid(mesh)
    for name, edges in mesh.boundaries.items():
        grid.point_data[f"boundary_{name}"] = np.isin(np.arange(len(mesh.points)), edges).astype(np.uint8)
    marker = np.zeros(len(mesh.points), dtype=np.int32)
    marker[mesh.marker_nodes] = np.arange(1, len(mesh.marker_nodes) + 1)
    grid.point_data["marker"] = marker
    _write(path, grid)


def _write(path: Path, grid: pyvista.UnstructuredGrid) -> None:
    writer = vtkXMLUnstructuredGridWriter()
    writer.SetInputData(grid)
    writer.SetDataModeToBinary()
    writer.SetCompressionLevel(1)  # the higher ones take longer for the same size
    writer.WriteToOutputStringOn()
    writer.Write()
    write_text(path, writer.GetOutputString())


def _grid(mesh: TriangleMesh) -> pyvista.UnstructuredGrid:
    points = np.pad(mesh.points, ((0, 0), (0, 1)))
    return pyvista.UnstructuredGrid({pyvista.CellType.TRIANGLE: mesh.triangles}, points)
