"""The boundary-value problem: the load's functional, and what is refused."""

from dataclasses import replace

import numpy as np
import pytest

from pinnray.geometry.finger.design import Design
from pinnray.geometry.picture_frame import Registration
from pinnray.solvers.problem import Load, Material, Problem, contact_ends, contact_functional, contact_nodes
from tests.solvers.conftest import observed_at


@pytest.mark.parametrize(("position", "found"), [(None, 35.0), (41.23, 41.23)])  # a node, and between two
def test_the_point_load_is_at_the_contacts_middle_or_its_position(coarse_mesh, position, found):
    points, weights = contact_functional(Problem(coarse_mesh, load=Load(kind="point", position=position)))
    np.testing.assert_allclose(points, [[found, 0.0]], atol=1e-12)
    assert weights.tolist() == [1.0]


def test_the_digest_depends_on_everything_that_defines_the_problem(coarse_mesh, medium_mesh):
    seen = observed_at(coarse_mesh.markers, np.zeros((9, 2)), 0.01)
    loose, drawn = (replace(seen, **{picture: Registration(turn=1.0)}) for picture in ("pressed", "drawn"))
    problems = [
        Problem(coarse_mesh),
        Problem(medium_mesh),
        Problem(coarse_mesh, Material(poisson=0.3)),
        Problem(coarse_mesh, load=Load(kind="point")),
        Problem(coarse_mesh, load=Load(displacement=(None, -10.0))),
        Problem(coarse_mesh, finger=Design()),
        Problem(coarse_mesh, finger=Design(front_thickness=2.2)),
        *(Problem(coarse_mesh, observations=each) for each in (seen, loose, drawn)),
    ]
    assert len({problem.digest for problem in problems}) == len(problems)
    assert Problem(coarse_mesh).digest == problems[0].digest


@pytest.mark.parametrize("position", [35.0, 47.3, 1.0, 89.0])
def test_the_mean_can_be_taken_anywhere_on_the_front_face(coarse_mesh, position):
    """With a raised cosine's moments over a contact of width b: 1, 0 and b^2 (1/12 - 1/(2 pi^2)).

    Elements are cut at the contact's ends, so that the moments do not depend on where they lie.
    """
    problem = Problem(coarse_mesh, load=Load(position=position))
    points, weights = contact_functional(problem)
    assert contact_ends(problem) == pytest.approx((position - 1, position + 1))
    assert weights.sum() == pytest.approx(1.0, rel=1e-12)
    assert weights @ points == pytest.approx([position, 0.0], abs=1e-9)
    second = 4 * (1 / 12 - 1 / (2 * np.pi**2))
    assert weights @ (points[:, 0] - position) ** 2 == pytest.approx(second, rel=1e-3)
    assert np.abs(coarse_mesh.points[contact_nodes(problem)] - [position, 0]).max() < 1 + 1e-9
