"""A finger of unknown modulus that two presses teach, one of them on a scale, and a third one of it."""

from dataclasses import replace

import numpy as np
import pytest

from pinnray.geometry.finger.design import Design
from pinnray.solvers.assimilation.estimation import Prior
from pinnray.solvers.fem.identification import FemIdSolver
from pinnray.solvers.identification.settings import taught
from pinnray.solvers.identification.unknowns import Unknowns
from pinnray.solvers.problem import Material
from tests.solvers.identification.twins import twin

WALLS = {"front_thickness": 2.1, "rib_thickness": 2.06}
SOLVER = FemIdSolver(degree=1, law="given")
SCALE = 0.02


@pytest.fixture(scope="module")
def finger(problem):
    """The problem of a finger whose modulus is known to a third; in truth it has 14 MPa and other walls."""
    return replace(problem, finger=Design(), material=Material(young="11.4±3.4", law="neo-hookean"))


def pressed(finger, seed, **contact):
    """What a camera sees of a press, and its force, N/mm."""
    true = replace(finger, material=Material(young=14.0, law="neo-hookean"))
    observed, response = twin(true, "neo-hookean", WALLS | contact, seed=seed)
    return replace(observed, simulated=True, source=f"press {seed}"), -response.force[1]


@pytest.fixture(scope="module")
def learned(finger):
    first, _ = pressed(finger, 1, position=33.0, normal_force=0.2)
    second, force = pressed(finger, 2, position=38.0, normal_force=0.15)
    weight = force * finger.finger.depth
    return taught(SOLVER, finger, [first, replace(second, weighed=(weight, SCALE * weight))])


def test_walls_and_modulus_are_learned(learned):
    """Each within three of its deviations; the modulus to little more than the scale's error."""
    assert (learned.pictures, learned.weighed) == (2, 1)
    found = dict(zip(learned.unknowns, zip(learned.mean, learned.deviation, strict=True), strict=True))
    for name, true in {**WALLS, "young": np.log(14.0)}.items():
        mean, deviation = found[name]
        assert abs(mean - true) < 3 * deviation
    assert SCALE < found["young"][1] < 3 * SCALE
    assert "position" not in found
    assert "normal_force" not in found


def test_the_next_press_has_a_third_of_the_interval(finger, learned):
    observed, force = pressed(finger, 3, position=35.0, normal_force=0.17)
    own = replace(finger, observations=observed)
    halves = []
    for known in (None, learned):
        found = SOLVER.solve(replace(own, learned=known))
        value, low, high = found.identified.force
        assert low < force < high
        halves.append((high - low) / 2 / value)
    assert "with what 2 pictures, 1 weighed, have taught" in found.status.message
    assert halves[0] > 0.5  # as the modulus
    assert halves[1] < halves[0] / 3
    assert value == pytest.approx(force, rel=3 * SCALE)


def test_what_was_learned_is_the_prior_of_the_same_unknowns(finger, learned):
    """Its mean and covariance, of the finger's unknowns; the others have their own."""
    unknowns = Unknowns(replace(finger, learned=learned), SOLVER.unknowns)
    parameters = unknowns.parameters(1.0)
    prior = unknowns.prior(parameters)
    rows = [unknowns.names.index(name) for name in learned.unknowns]
    scale = np.array([parameters[row].scale for row in rows])
    middle = np.array([parameters[row].middle for row in rows])
    covariance = np.linalg.inv(prior.precision)[np.ix_(rows, rows)] * np.outer(scale, scale)
    told = np.array(learned.correlation) * np.outer(learned.deviation, learned.deviation)
    np.testing.assert_allclose(middle + scale * prior.mean[rows], learned.mean, rtol=1e-5)
    np.testing.assert_allclose(covariance, told, rtol=1e-4, atol=1e-9)
    others = np.delete(np.arange(len(parameters)), rows)
    alone = Prior.independent(len(parameters))
    np.testing.assert_array_equal(prior.precision[others], alone.precision[others])
