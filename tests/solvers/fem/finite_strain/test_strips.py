"""The path on coarser elements of a strip that is 0.2 mm thick."""

import pytest

from pinnray.geometry.cache import finger_mesh
from pinnray.geometry.drawing.description import Description
from pinnray.geometry.drawing.load import finger_from_file
from pinnray.geometry.mesh.settings import MeshSettings
from pinnray.solvers.fem.finite_strain.nested_path import coarser
from pinnray.solvers.problem import Material, Problem
from tests.geometry.drawing.files import rectangle, write_dxf

STEEL = Material(young=2e5, poisson=0.3, law="neo-hookean")


@pytest.fixture(scope="module")
def strip(tmp_path_factory):
    """A strip of 60 mm, clamped at the left end, touched at x = 40 mm."""
    file = write_dxf(tmp_path_factory.mktemp("strip") / "strip.dxf", [rectangle(0, -0.2, 60, 0.2)])
    where = Description(clamp=(((0, 0), (0, -0.2)),), contact=(40, 0), contact_width=1, markers=((50, -0.1),))
    return finger_from_file(file, where)


def test_a_thin_strip_has_coarser_elements_to_start_on(strip):
    problem = Problem(finger_mesh(strip, settings=MeshSettings(size=0.25)), STEEL, finger=strip)
    coarse = coarser(problem)
    assert coarse is not None
    assert 4 * len(coarse.mesh.triangles) < len(problem.mesh.triangles)
