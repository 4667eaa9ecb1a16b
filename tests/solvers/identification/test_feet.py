"""A base of two feet, each of which gives and turns, and a tangential force that friction bounds."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from pinnray.solvers.fem.identification import FemBody, FemIdSolver
from pinnray.solvers.identification.boundary import Feet
from pinnray.solvers.identification.model import EXACT, MarkerData, MarkerModel
from pinnray.solvers.identification.search import Identifier
from pinnray.solvers.identification.unknowns import DEFAULT, SHARE, Unknowns
from pinnray.solvers.problem import Load, Material, Problem
from tests.solvers.bodies import body_mesh
from tests.solvers.conftest import observed_at
from tests.solvers.identification.test_model import check_taylor
from tests.solvers.identification.twins import NOISE, model_of, sought, values_of

NAMES = ("normal_force", "shear_force", "position", "feet")
MARKERS = np.array(
    [(3, -3), (3, -21), (9, -3), (9, -21), (20, -12), (35, -3), (50, -3), (50, -10)], dtype=float
)
PRESSED = {"position": 40.0, "normal_force": 0.2, "shear_force": 0.05}


@pytest.fixture(scope="module")
def standing():
    """A finger on two feet that stand on the line x = 0, one at the front, one at the back."""
    return Problem(
        body_mesh("feet and slot", 2.0), Material(law="neo-hookean"), Load(displacement=(None, -3.0))
    )


@pytest.fixture(scope="module")
def pair(standing):
    """The finger and eight markers in it."""
    model = model_of(standing, NAMES)
    seen = observed_at(MARKERS, 0 * MARKERS, NOISE)
    return model, MarkerModel(model, MarkerData.of(standing, seen, 0.0))


def moved(pair, values):
    """Displacements of the markers, shape (m, 2), mm, for values by name, the rest as drawn."""
    model, markers = pair
    model.restart(None)
    response = model.response(values_of(model.unknowns, values), EXACT)
    assert response is not None
    return markers.predicted(response)[0].reshape(-1, 2)


def test_each_foot_gives_along_its_normal_and_turns_about_its_middle(standing):
    feet = Feet(standing.mesh)
    assert feet.names == ("foot_1_give", "foot_1_turn", "foot_2_give", "foot_2_turn")
    # They are 6 mm long: the end of one that turns by the tolerance moves by 0.1 mm.
    np.testing.assert_allclose(feet.tolerances, [0.1, 0.1 / 3, 0.1, 0.1 / 3])
    found = feet.motions(np.array([(0.0, -1.0), (0.0, -23.0)]))
    np.testing.assert_allclose(found[0], [(1, 0), (0, 0)], atol=1e-12)
    np.testing.assert_allclose(found[1], [(-2, 0), (0, 0)], atol=1e-12)
    np.testing.assert_allclose(found[2], [(0, 0), (1, 0)], atol=1e-12)
    np.testing.assert_allclose(found[3], [(0, 0), (2, 0)], atol=1e-12)


def test_a_base_in_one_piece_has_no_feet(problem):
    assert Feet(problem.mesh).names == ()
    assert not [name for name in Unknowns(problem, DEFAULT).names if name.startswith("foot")]


def test_feet_that_give_alike_carry_the_finger_along(pair):
    """The exact answer is a translation, whatever the force."""
    fixed, carried = moved(pair, PRESSED), moved(pair, PRESSED | {"foot_1_give": 0.3, "foot_2_give": 0.3})
    np.testing.assert_allclose(carried - fixed, np.broadcast_to((0.3, 0.0), fixed.shape), atol=1e-6)


def test_feet_that_turn_with_the_line_between_them_carry_the_finger_along(pair):
    """A turn of both by a small angle about the base's middle is one of the finger, to angle² times 50 mm.

    The feet are 18 mm apart: each gives by 9 mm times the angle.
    """
    angle, lever = 1e-3, 9.0
    turned = {f"foot_{n}_{way}": size for n in (1, 2) for way, size in (("turn", angle), ("give", 0.0))}
    turned |= {"foot_1_give": -lever * angle, "foot_2_give": lever * angle}
    expected = angle * (MARKERS - (0.0, -12.0)) @ np.array([[0.0, 1.0], [-1.0, 0.0]])
    np.testing.assert_allclose(moved(pair, turned), expected, atol=4e-5)


@pytest.mark.parametrize("name", ["foot_1_give", "foot_1_turn", "foot_2_give", "foot_2_turn"])
def test_derivatives_by_the_feet_pass_the_taylor_test(pair, name):
    there = {"foot_1_give": 0.05, "foot_1_turn": -0.06, "foot_2_give": -0.08, "foot_2_turn": 0.1}
    check_taylor(*pair, name, PRESSED | there)  # type: ignore[call-arg]


@pytest.mark.release
def test_a_foot_that_turned_is_found_where_the_markers_show_it(standing, pair):
    """Ten times as far as a print is off at its ends; markers with a noise of 0.01 mm."""
    true = 0.12
    shown = moved(pair, PRESSED | {"foot_2_turn": true})
    shown = shown + NOISE * np.random.default_rng(2).normal(size=shown.shape)
    seen = replace(observed_at(MARKERS, shown, NOISE), marker_radius=0.0)
    asked = {"parameters": ",".join((*NAMES, "width")), "law": "given"}
    found = sought(standing, seen, **asked)
    assert found.status.converged
    assert found.stats["foot_2_turn_low"] < true < found.stats["foot_2_turn_high"]
    assert found.stats["foot_2_turn"] == pytest.approx(true, abs=0.02)
    held = asked | {"parameters": asked["parameters"].replace("feet,", "")}
    assert sought(standing, seen, **held).stats["inflation"] > 2
    vague = sought(standing, replace(seen, standard_deviations=np.full_like(shown, 0.3)), **asked)
    assert "foot_1_give" in vague.status.message.split("NOT DETERMINED")[1]


@pytest.fixture(scope="module")
def rubbed(problem):
    """The default finger under a cylinder with friction 0.3."""
    return replace(problem, load=Load(kind="cylinder", radius=10.0, displacement=(0.0, -3.0), friction=0.3))


def test_friction_bounds_the_tangential_force_to_a_share_of_the_normal_one(rubbed):
    unknowns = Unknowns(rubbed, DEFAULT)
    assert SHARE in unknowns.names
    assert "shear_force" not in unknowns.names
    bounded = unknowns.parameters(1.0)[unknowns.names.index(SHARE)]
    assert (bounded.low, bounded.high) == (-0.3, 0.3)
    values = values_of(unknowns, {"normal_force": 0.2, SHARE: -0.3})
    into, along = unknowns.hypothesis(values).force @ unknowns.directions.T
    assert (into, along) == pytest.approx((0.2, -0.06))


@pytest.mark.parametrize("name", ["normal_force", SHARE])
def test_derivatives_with_a_bounded_tangential_force_pass_the_taylor_test(rubbed, name):
    model = model_of(rubbed, ("normal_force", "shear_force", "eccentricity"))
    seen = observed_at(rubbed.mesh.markers, np.zeros((9, 2)), NOISE)
    markers = MarkerModel(model, MarkerData.of(rubbed, seen, None))
    check_taylor(model, markers, name, {"normal_force": 0.16, SHARE: 0.2, "eccentricity": 0.4})


def test_markers_that_ask_for_more_than_friction_get_as_much_as_it_allows(rubbed):
    """The truth has a tangential force of half of the normal one, the friction is 0.1."""
    free = model_of(replace(rubbed, load=Load()), ("normal_force", "shear_force"))
    seen = observed_at(rubbed.mesh.markers, np.zeros((9, 2)), NOISE)
    markers = MarkerModel(free, MarkerData.of(rubbed, seen, None))
    response = free.response(values_of(free.unknowns, {"normal_force": 0.16, "shear_force": -0.08}), EXACT)
    shown = observed_at(rubbed.mesh.markers, markers.predicted(response)[0].reshape(-1, 2), NOISE)
    slippery = replace(rubbed, load=rubbed.load.model_copy(update={"friction": 0.1}))
    solver = FemIdSolver(degree=1, law="given", parameters="normal_force,shear_force")
    patch = Identifier(solver, slippery, partial(FemBody, degree=1)).identify(shown)
    assert patch.stats()[SHARE] == pytest.approx(-0.1, abs=1e-3)
