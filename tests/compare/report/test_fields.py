from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import pyvista

from pinnray.comparison.evaluation.evaluation import Evaluation
from pinnray.comparison.report.output_files import write_mesh, write_vtu
from pinnray.geometry.mesh.triangle_mesh import TriangleMesh


@pytest.fixture
def sheared(fem: Evaluation) -> Evaluation:
    """Every component of its stress and strain is another number."""
    count = len(fem.weights)
    return replace(
        fem,
        strain=np.tile([[0.11, 0.12], [0.12, 0.22]], (count, 1, 1)),
        stress=np.tile([[1.1, 1.2], [1.2, 2.2]], (count, 1, 1)),
        stress_zz=np.full(count, 3.3),
        von_mises=np.full(count, 4.4),
        energy_density=np.linspace(0, 1, count),
    )


@pytest.fixture
def grid(sheared: Evaluation, mesh: TriangleMesh, tmp_path: Path) -> pyvista.UnstructuredGrid:
    write_vtu(tmp_path / "fem.vtu", mesh, sheared)
    return pyvista.read(tmp_path / "fem.vtu")


def test_the_mesh_comes_back(grid: pyvista.UnstructuredGrid, mesh: TriangleMesh) -> None:
    np.testing.assert_array_equal(grid.points[:, :2], mesh.points)
    np.testing.assert_array_equal(grid.cells_dict[pyvista.CellType.TRIANGLE], mesh.triangles)


def test_displacements_are_vectors_with_z_zero(grid: pyvista.UnstructuredGrid, sheared: Evaluation) -> None:
    np.testing.assert_array_equal(grid.point_data["displacement_mm"][:, :2], sheared.node_displacement)
    assert not grid.point_data["displacement_mm"][:, 2].any()


def test_deviations_are_written_where_the_solver_estimates_them(
    sheared: Evaluation, mesh: TriangleMesh, tmp_path: Path
) -> None:
    nodes, cells = np.arange(2.0 * len(mesh.points)).reshape(-1, 2), np.arange(1.0 * len(mesh.triangles))
    for found, names in (
        (sheared, set()),
        (replace(sheared, node_deviation=nodes), {"displacement_deviation_mm"}),
        (
            replace(sheared, node_deviation=nodes, von_mises_deviation=cells),
            {"displacement_deviation_mm", "von_mises_deviation_MPa"},
        ),
    ):
        write_vtu(tmp_path / "fem.vtu", mesh, found)
        grid = pyvista.read(tmp_path / "fem.vtu")
        every = {*grid.point_data.keys(), *grid.cell_data.keys()}
        assert {name for name in every if "deviation" in name} == names
    np.testing.assert_array_equal(grid.point_data["displacement_deviation_mm"][:, :2], nodes)
    np.testing.assert_array_equal(grid.cell_data["von_mises_deviation_MPa"], cells)


def test_tensor_components_are_where_their_names_say(grid: pyvista.UnstructuredGrid) -> None:
    array = grid.GetCellData().GetArray("stress_MPa")
    names = [array.GetComponentName(number) for number in range(6)]
    first = dict(zip(names, grid.cell_data["stress_MPa"][0], strict=True))
    assert first == pytest.approx({"XX": 1.1, "YY": 2.2, "ZZ": 3.3, "XY": 1.2, "YZ": 0, "XZ": 0})
    strains = {name: grid.cell_data[f"strain_{name}"][0] for name in ("xx", "yy", "xy")}
    assert strains == pytest.approx({"xx": 0.11, "yy": 0.22, "xy": 0.12})


@pytest.mark.parametrize("name", ["stress_zz_MPa", "von_mises_MPa", "energy_density_MPa"])
def test_scalars_are_means_over_the_triangles(name, grid, sheared):
    expected = sheared.per_triangle(getattr(sheared, name.removesuffix("_MPa")))
    np.testing.assert_allclose(grid.cell_data[name], expected)


def test_a_mesh_file_says_where_boundaries_and_markers_are(mesh: TriangleMesh, tmp_path: Path) -> None:
    write_mesh(tmp_path / "mesh.vtu", mesh)
    data = pyvista.read(tmp_path / "mesh.vtu").point_data
    np.testing.assert_array_equal(data["boundary_base"], mesh.points[:, 0] == 0)
    assert data["marker"][mesh.marker_nodes].tolist() == [1, 2, 3]
    assert np.count_nonzero(data["marker"]) == 3
