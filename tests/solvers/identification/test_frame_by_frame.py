"""The force from frame to frame: a simulated loading and unloading, hidden markers, rest, jumps."""

import numpy as np
import pytest

from pinnray.solvers.fem.identification import FemBody
from pinnray.solvers.identification.model import EXACT, ResponseModel
from pinnray.solvers.identification.tracker import ForceTracker
from pinnray.solvers.identification.unknowns import DEFAULT, Unknowns

NOISE, RADIUS = 0.005, 0.8
FORCE, POSITION = (0.2, 0.03), 37.0
SHARES = np.concatenate([np.zeros(3), np.linspace(0, 1, 13), np.ones(2), np.linspace(1, 0, 9)])
PRINTED = {"front_thickness": 2.06, "back_thickness": 1.95, "rib_thickness": 2.05, "base_compliance": 0.05}
"""Walls within one and a half standard deviations of their priors."""


@pytest.fixture(scope="module")
def tracker_of(problem):
    unknowns = Unknowns(problem, DEFAULT)
    return lambda: ForceTracker(ResponseModel(FemBody(unknowns, 1), unknowns), problem.mesh.markers, RADIUS)


def marker_path(problem, shares, finger):
    """Displacements of the markers, (f, 9, 2), mm, and forces, (f, 2), N/mm, of a finger under shares."""
    unknowns = Unknowns(problem, DEFAULT)
    model = ResponseModel(FemBody(unknowns, 1), unknowns)
    twin = ForceTracker(model, problem.mesh.markers, RADIUS)
    drawn = {parameter.name: parameter.start for parameter in unknowns.parameters(1.0)}
    places, forces = [], []
    for share in shares:
        forced = dict(zip(("normal_force", "shear_force"), share * np.array(FORCE), strict=True))
        changed = drawn | {"position": POSITION} | finger | forced
        response = model.response(np.array([changed[name] for name in unknowns.names]), EXACT)
        assert response is not None
        places.append(twin._markers.predicted(response)[0].reshape(-1, 2))
        forces.append(response.hypothesis.force)
    return np.array(places), np.array(forces)


@pytest.fixture(scope="module")
def drawn_path(problem):
    return marker_path(problem, SHARES, {})


@pytest.fixture(scope="module")
def printed_path(problem):
    return marker_path(problem, SHARES, PRINTED)


def readings(tracker, places, seed=1, visible=None):
    rng = np.random.default_rng(seed)
    noisy = places + NOISE * rng.standard_normal(places.shape)
    mask = np.ones(places.shape[:2], dtype=bool) if visible is None else visible
    spread = np.full(places.shape[1:], NOISE)
    return [tracker.update(each, spread, seen) for each, seen in zip(noisy, mask, strict=True)]


def column(found, name):
    return np.array([getattr(reading, name) for reading in found])


def pressing(forces):
    return -np.asarray(forces)[..., 1]


def test_the_force_is_within_three_percent_on_the_way_up_and_down(drawn_path, tracker_of):
    places, forces = drawn_path
    found = readings(tracker_of(), places)
    true = pressing(forces)
    # The walls' priors and the noise leave 2.5 % of the full force in every single frame.
    error = np.sqrt(np.mean((column(found, "force")[:, 0] - true) ** 2))
    assert error < 0.03 * true.max()
    large = true > 0.2 * true.max()
    np.testing.assert_allclose(column(found, "position")[large, 0], POSITION, atol=1.0)


@pytest.mark.slow
def test_intervals_hold_for_walls_that_are_not_those_drawn(printed_path, tracker_of):
    places, forces = printed_path
    found = readings(tracker_of(), places)
    true = pressing(forces)
    _, low, high = column(found, "force").T
    inside = (low <= true) & (true <= high)
    assert inside.mean() > 0.9  # of 95 %
    # The finger is known from its largest load on: the way down has narrower intervals at the same force.
    widths = high - low
    up, down = (np.flatnonzero(np.isclose(SHARES, 0.5))[end] for end in (0, -1))
    assert widths[down] < widths[up]


def test_an_unloaded_finger_may_have_no_force(drawn_path, tracker_of):
    places, _ = drawn_path
    for reading in readings(tracker_of(), places[:3]):
        assert reading.force.low < 0 < reading.force.high < 0.002
        assert reading.tangential_force.low < 0 < reading.tangential_force.high
        assert reading.position.low < POSITION < reading.position.high


def test_frames_that_barely_move_cost_no_equilibrium(drawn_path, tracker_of):
    places, _ = drawn_path
    tracker = tracker_of()
    found = readings(tracker, places)
    still = readings(tracker, places[[-1, -1, -1]])
    assert max(column(still, "evaluations")) == 0
    assert column(found, "evaluations").sum() < 2 * len(found)


def test_a_jump_to_the_full_load_is_followed(drawn_path, tracker_of):
    places, forces = drawn_path
    tracker = tracker_of()
    readings(tracker, places[:1])
    (found,) = readings(tracker, places[[15]])
    assert found.force.value == pytest.approx(pressing(forces[15]), rel=0.03)
    assert found.evaluations > 2


@pytest.mark.slow
def test_hidden_markers_widen_the_interval_and_are_named(drawn_path, tracker_of):
    places, forces = drawn_path
    visible = np.ones((len(places), 9), dtype=bool)
    visible[:, [2, 5, 7]] = False
    whole, partial = (readings(tracker_of(), places, visible=seen)[15] for seen in (None, visible))
    assert partial.status.startswith("hidden: marker 3, 6, 8")
    assert np.ptp(partial.force) > np.ptp(whole.force)
    assert partial.force.low < pressing(forces[15]) < partial.force.high


def test_too_few_markers_leave_the_interval_open_and_the_next_frame_goes_on(drawn_path, tracker_of):
    places, forces = drawn_path
    visible = np.ones((17, 9), dtype=bool)
    visible[15, 2:] = False
    found = readings(tracker_of(), places[:17], visible=visible)
    assert found[15].status == "2 of 9 markers are seen, too few for a force"
    assert found[15].force[1:] == (-np.inf, np.inf)
    assert np.isnan(found[15].force.value)
    assert found[16].force.value == pytest.approx(pressing(forces[16]), rel=0.03)


def test_markers_that_no_force_explains_are_told(drawn_path, tracker_of):
    places, _ = drawn_path
    off = places[:16].copy()
    off[:, 4] += 0.5 * SHARES[:16, None]  # 100 standard deviations at the full load
    found, plain = (readings(tracker_of(), given)[-1] for given in (off, places[:16]))
    assert found.inflation > 5
    assert "times as far off as noise explains" in found.status
    assert np.ptp(found.force) > 3 * np.ptp(plain.force)
