"""Fields of a comparison for other programs: VTK grids (.vtu) for ParaView; units mm and MPa."""

import unicodedata
from pathlib import Path

import numpy as np
import pyvista
from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridWriter

from pinnray.comparison.evaluation.differences import COMPONENTS
from pinnray.comparison.evaluation.evaluation import Evaluation
from pinnray.geometry.mesh.triangle_mesh import TriangleMesh
from pinnray.runtime.atomic import write_text

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
    stress, stress_zz = map(evaluation.per_triangle, (evaluation.stress, evaluation.stress_zz))
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
