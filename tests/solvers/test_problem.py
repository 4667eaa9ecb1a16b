"""The boundary-value problem: the load's functional, and what is refused."""

import numpy as np
import pytest
from pydantic import ValidationError

from solvers.problem import Load, Material, Problem, contact_extent, contact_functional


def test_the_mean_is_weighted_by_a_raised_cosine(coarse_mesh):
    """Its moments over a contact of width b about the middle: 1, 0 and b^2 (1/12 - 1/(2 pi^2))."""
    points, weights = contact_functional(Problem(coarse_mesh))
    middle, width = contact_extent(coarse_mesh)
    assert (middle, width) == pytest.approx((35.0, 2.0))
    offset = points[:, 0] - middle
    assert weights.sum() == pytest.approx(1.0, rel=1e-12)
    assert weights @ offset == pytest.approx(0.0, abs=1e-12)
    assert weights @ offset**2 == pytest.approx(width**2 * (1 / 12 - 1 / (2 * np.pi**2)), rel=1e-4)


def test_the_point_load_is_the_contacts_middle_node(coarse_mesh):
    points, weights = contact_functional(Problem(coarse_mesh, load=Load(kind="point")))
    np.testing.assert_allclose(points, [[35.0, 0.0]], atol=1e-12)
    assert weights.tolist() == [1.0]


def test_the_digest_depends_on_everything_that_defines_the_problem(coarse_mesh, medium_mesh):
    problems = [
        Problem(coarse_mesh),
        Problem(medium_mesh),
        Problem(coarse_mesh, Material(poisson=0.3)),
        Problem(coarse_mesh, load=Load(kind="point")),
        Problem(coarse_mesh, load=Load(displacement=(None, -10.0))),
    ]
    assert len({problem.digest for problem in problems}) == len(problems)
    assert Problem(coarse_mesh).digest == problems[0].digest


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Material(young=-1.0), "greater than 0"),
        (lambda: Material(poisson=0.5), "less than 0.5"),  # incompressible: no displacement formulation
        (lambda: Load(displacement=(None, None)), "leaves both components free"),
        (lambda: Load(kind="magnet"), "'mean', 'point' or 'patch'"),
    ],
)
def test_impossible_materials_and_loads_are_refused(make, message):
    with pytest.raises(ValidationError, match=message):
        make()
