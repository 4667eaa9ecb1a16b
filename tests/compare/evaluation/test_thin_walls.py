"""A wall that is thin for the elements or for the other walls is told with its place."""

import re

import numpy as np
import pytest

from pinnray.comparison.evaluation.plausibility import problem_remarks
from pinnray.geometry.cache import finger_mesh
from pinnray.geometry.drawing.description import Description
from pinnray.geometry.drawing.load import finger_from_file
from pinnray.geometry.mesh.settings import MeshSettings
from pinnray.geometry.mesh.triangle_mesh import TriangleMesh
from pinnray.solvers.problem import Problem
from tests.geometry.drawing.files import BEAM, write_dxf


def necked(neck: float) -> list[tuple[float, float]]:
    """A beam of 80 mm by 10 mm with a neck of 2 mm length in its middle."""
    low, high = -5 - neck / 2, -5 + neck / 2
    left = [(39, high), (39, 0), (0, 0), (0, -10), (39, -10), (39, low)]
    return [*left, (41, low), (41, -10), (80, -10), (80, 0), (41, 0), (41, high)]


@pytest.mark.parametrize(("neck", "said"), [(1.0, True), (4.0, False)])
def test_a_neck_is_told(tmp_path, neck, said):
    where = Description(clamp=(((0, 0), (0, -10)),), contact=(65, 0), contact_width=4, markers=((60, -5),))
    finger = finger_from_file(write_dxf(tmp_path / "neck.dxf", [necked(neck)]), where)
    remarks = problem_remarks(Problem(finger_mesh(finger, settings=MeshSettings(size=2.0)), finger=finger))
    assert len(remarks) == said
    if said:
        told = re.search(r"wall of 1 mm at \((\S+), (\S+)\) mm, 0.1 of the .* 10 mm: [3-5] el", remarks[0])
        assert told
        assert [float(each) for each in told.groups()] == pytest.approx([40, -5], abs=1)


def grid(rows: int) -> TriangleMesh:
    """The beam of 100 mm by 10 mm, in elements of 10 mm length."""
    points = np.array([(10.0 * x, -10.0 * y / rows) for y in range(rows + 1) for x in range(11)])
    corners = np.array([11 * y + x for y in range(rows) for x in range(10)])
    squares = corners[:, None] + [0, 11, 12, 1]
    return TriangleMesh(
        points,
        np.concatenate([squares[:, [0, 1, 2]], squares[:, [0, 2, 3]]]),
        {
            "base": np.array([(11 * y, 11 * y + 11) for y in range(rows)]),
            "front": np.array([(x, x + 1) for x in range(10)]),
            "contact": np.array([(4, 5)]),
        },
        np.array([7]),
        4,
    )


@pytest.mark.parametrize(("rows", "said"), [(1, True), (2, False)])
def test_a_wall_of_one_element_is_told(tmp_path, rows, said):
    where = Description(clamp=(((0, 0), (0, -10)),), contact=(45, 0), contact_width=10, markers=((70, -1),))
    finger = finger_from_file(write_dxf(tmp_path / "beam.dxf", [BEAM]), where)
    remarks = problem_remarks(Problem(grid(rows), finger=finger))
    assert len(remarks) == said
    assert not said or "wall of 10 mm at" in remarks[0]
    assert not said or "1 element of 7.1 mm across it, too few" in remarks[0]
