"""CalculiX: its quadrature explains the difference, its input is what it should be, its absence is told."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.tables import cells_of, markdown
from benchmarks.verification.cases import calculix
from benchmarks.verification.document import OVERVIEW, PAGE, tables
from pinnray.geometry.cache import finger_mesh
from pinnray.geometry.finger.design import Design
from pinnray.geometry.mesh.settings import MeshSettings
from pinnray.solvers.extrusion import ExtrudedSpace
from pinnray.solvers.fem import equilibrium
from pinnray.solvers.problem import Load, Material, Problem

SHORT = Design(height=50, rib_count=1, tip_length=12, contact_position=20, depth=6.0)
COARSE = MeshSettings(size=1.0)


@pytest.mark.slow
@pytest.mark.skipif(not calculix.CALCULIX.available, reason="ccx is not installed")
@pytest.mark.parametrize(
    ("differences", "design", "depth"),
    [
        (calculix.plane_differences, Design(), -10.0),  # three points a triangle
        (calculix.solid_differences, SHORT, -4.0),  # four points a tetrahedron
    ],
)
def test_with_its_quadrature_the_other_program_agrees_to_the_printed_digits(
    differences, design, depth, monkeypatch
):
    """Its points are those of degree 2; with the usual ones the forces are 1e-4 apart."""
    monkeypatch.setattr(equilibrium, "QUADRATURE_DEGREE", 2)
    load = Load(kind="patch", displacement=(None, depth))
    problem = Problem(finger_mesh(design, settings=COARSE), Material(law="st-venant-kirchhoff"), load)
    assert max(differences(problem)) < calculix.BOUNDS["linear"][0]


def test_tetrahedra_have_positive_volumes_and_their_edges_middles():
    space = ExtrudedSpace.of(finger_mesh(SHORT, settings=COARSE), 2, 0.5)
    places = space.nodes[calculix.cells(space)]
    assert np.linalg.det(places[:, 1:4] - places[:, :1]).min() > 0
    for middle, (first, second) in enumerate(calculix.TETRAHEDRON, 4):
        np.testing.assert_allclose(places[:, middle], (places[:, first] + places[:, second]) / 2, atol=1e-12)


def test_the_last_table_of_its_output_is_read():
    """Two increments; the number of the node comes first."""
    head = " displacements (vx,vy,vz) for set ALL and time  0.{}000000E+00\n\n"
    rows = "   1  {0}.000000E-01 -1.000000E+00  0.000000E+00\n   2  0.000000E+00  0.000000E+00  {0}.5E+00\n"
    printed = "\n" + "\n".join(head.format(k) + rows.format(k) for k in (1, 2))
    np.testing.assert_array_equal(calculix.table(printed, "displacements"), [[1, 0.2, -1, 0], [2, 0, 0, 2.5]])


def test_without_the_program_its_numbers_stay_on_the_page():
    missing = replace(calculix.CALCULIX, needs="no-such-program")
    assert not missing.available
    kept = [cells for cells in cells_of(PAGE, "overview") if cells[0] == "[CalculiX](#calculix)"]
    assert len(kept) == 1
    assert tables([missing]) == {"overview": markdown(OVERVIEW, kept, left=6)}
