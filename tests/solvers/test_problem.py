"""The boundary-value problem: the load's functional, and what is refused."""

from dataclasses import replace

import numpy as np
import pytest

from geometry.errors import UserError
from geometry.registration import Registration
from solvers.problem import Load, Material, Physics, Problem, contact_ends, contact_functional, contact_nodes
from tests.solvers.conftest import observed_at


def test_the_mean_is_weighted_by_a_raised_cosine(coarse_mesh):
    """Its moments over a contact of width b about the middle: 1, 0 and b^2 (1/12 - 1/(2 pi^2))."""
    problem = Problem(coarse_mesh)
    points, weights = contact_functional(problem)
    assert contact_ends(problem) == pytest.approx((34.0, 36.0))
    offset, width = points[:, 0] - 35.0, 2.0
    assert weights.sum() == pytest.approx(1.0, rel=1e-12)
    assert weights @ offset == pytest.approx(0.0, abs=1e-12)
    assert weights @ offset**2 == pytest.approx(width**2 * (1 / 12 - 1 / (2 * np.pi**2)), rel=1e-4)


@pytest.mark.parametrize(("position", "found"), [(None, 35.0), (41.23, 41.23)])  # a node, and between two
def test_the_point_load_is_at_the_contacts_middle_or_its_position(coarse_mesh, position, found):
    points, weights = contact_functional(Problem(coarse_mesh, load=Load(kind="point", position=position)))
    np.testing.assert_allclose(points, [[found, 0.0]], atol=1e-12)
    assert weights.tolist() == [1.0]


def test_the_digest_depends_on_how_well_the_pictures_are_known(coarse_mesh):
    """Else a resumed run would take over the solution from before the file said so."""
    seen = observed_at(coarse_mesh.markers, np.zeros((9, 2)), 0.01)
    loose = Registration(turn=1.0)
    kinds = [seen, replace(seen, pressed=loose), replace(seen, drawn=loose)]
    assert len({Problem(coarse_mesh, observations=each).digest for each in kinds}) == 3


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


@pytest.mark.parametrize("position", [35.0, 47.3, 1.0, 89.0])
def test_the_mean_can_be_taken_anywhere_on_the_front_face(coarse_mesh, position):
    """Elements are cut at the contact's ends, so that the moments do not depend on where they lie."""
    problem = Problem(coarse_mesh, load=Load(position=position))
    points, weights = contact_functional(problem)
    assert contact_ends(problem) == pytest.approx((position - 1, position + 1))
    assert weights @ points == pytest.approx([position, 0.0], abs=1e-9)
    second = 4 * (1 / 12 - 1 / (2 * np.pi**2))
    assert weights @ (points[:, 0] - position) ** 2 == pytest.approx(second, rel=1e-3)
    assert np.abs(coarse_mesh.points[contact_nodes(problem)] - [position, 0]).max() < 1 + 1e-9


def test_where_the_mesh_has_its_contact_the_position_changes_nothing(coarse_mesh):
    for kind in ("mean", "point"):
        own = contact_functional(Problem(coarse_mesh, load=Load(kind=kind)))
        given = contact_functional(Problem(coarse_mesh, load=Load(kind=kind, position=35.0)))
        for ours, theirs in zip(own, given, strict=True):
            np.testing.assert_allclose(ours, theirs, atol=1e-12)


def test_a_contact_beyond_the_finger_is_refused(coarse_mesh):
    with pytest.raises(
        UserError, match=r"from x = 88\.5 to 90\.5 mm is not on the front face, which runs from 0 to 90"
    ):
        Problem(coarse_mesh, load=Load(position=89.5))
    with pytest.raises(UserError, match="mesh the finger with its contact_position there"):
        Load(kind="patch", position=40.0)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Material(young=-1.0), r"young \(E\) = -1.0: input should be greater than 0"),
        (lambda: Material(young=1e300), r"young \(E\) = 1e\+300: no solid has this Young's modulus"),
        (lambda: Material(young=True), r"young \(E\) = 'true' is not a finite number; give one from"),
        (
            lambda: Material(young=np.ones(99)),
            r"young \(E\) = array\(.* is not a finite number; give",
        ),  # many lines
        (lambda: Material(poisson=0.5), r"poisson \(nu\) = 0.5: .* less than 0.5"),  # incompressible
        (lambda: Material(law="gent", plane="stress"), "the gent law is given for plane strain only"),
        (lambda: Material(youngs=1), "unknown parameter 'youngs'; did you mean young"),
        (lambda: Load(displacement=(0.0, float("nan"))), "displacement = nan is not a finite number$"),
        (lambda: Load(displacement=(None, None)), "leaves both components free"),
        (lambda: Load(displacement=(0.0, -1e-200)), "by less than 1e-09 mm, a hundredth of an atom's size"),
        (
            lambda: Load((0.0, -3.0)),
            r"by name only \(kind, displacement, position, radius, friction\), not \(0.0, -3.0\)$",
        ),
        (lambda: Load(np.ones((9, 9))), r"Load takes values by name only .*, not array"),  # many lines
        (lambda: Load(displacement=-3), "displacement = -3: give u and v in mm, such as"),
        (lambda: Load(kind="magnet"), "kind = 'magnet': there are mean, point, patch, cylinder$"),
        (lambda: Load(kind="cylinder", radius=0), "radius = 0: input should be greater than 0"),
        (lambda: Load(position="middle"), "position = 'middle' is not a finite number$"),
    ],
)
def test_impossible_materials_and_loads_are_one_line(make, message):
    with pytest.raises(UserError, match=message) as refused:
        make()
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize("value", [[1.0], (1, 2), "ten", None, 1j])
@pytest.mark.parametrize("name", ["stroke", "direction"])
def test_a_travel_is_a_number(name: str, value: object) -> None:
    with pytest.raises(UserError, match=f"{name} = .* is not a finite number"):
        Physics(**{name: value})
