"""A cylinder on a front of known compliance: the conditions that its forces meet, and their derivatives."""

import numpy as np
import pytest

from pinnray.solvers.contact.cylinder import Cylinder
from pinnray.solvers.contact.front_contact import FrontContact

COUNT = 9


@pytest.fixture
def front():
    """A soft front under a cylinder that was dragged along it: its places without forces, and the contact."""
    x = np.linspace(-3, 3, COUNT)
    near = np.exp(-np.abs(x[:, None] - x)) + 0.5
    compliance = np.kron(near, [[0.6, 0.2], [0.2, 1.0]])
    free = np.column_stack([x, 0.1 * np.cos(2 * x)])
    cylinder = Cylinder(20.0, np.array([0.2, 19.6]), 0.4)
    before = cylinder.places(free - [0.08, 0.0])
    return free, FrontContact(cylinder, compliance, before)


def test_what_touches_is_pushed_and_what_sticks_has_less_than_the_whole_friction(front):
    """To rounding; the front has points of all three kinds, so that no condition is met by nothing."""
    free, contact = front
    forces = contact.forces(free, np.zeros((COUNT, 2)))
    points = free + (contact.compliance @ forces.ravel()).reshape(-1, 2)
    q, t = (forces * contact.cylinder.axes(points)).sum(axis=2)
    gap, slip = contact.cylinder.gaps(points), contact.cylinder.places(points) - contact.before
    touches, sticks = q > 1e-9, (q > 1e-9) & (np.abs(slip) < 1e-9)
    assert 0 < sticks.sum() < touches.sum() < COUNT
    assert min(gap.min(), q.min(), (0.4 * q - np.abs(t)).min()) > -1e-9
    np.testing.assert_allclose(np.abs(q * gap), 0.0, atol=1e-9)
    slips = touches & ~sticks
    np.testing.assert_allclose(t[slips], -0.4 * q[slips] * np.sign(slip[slips]), atol=1e-9)


def test_derivatives_of_the_forces_are_those_of_differences(front):
    """By place without forces, centre, friction and places before, which 1e-6 of each leaves to 1e-5."""
    free, contact = front
    forces = contact.forces(free, np.zeros((COUNT, 2)))
    rng = np.random.default_rng(6)
    moved, centre = rng.standard_normal((COUNT, 2)), rng.standard_normal(2)
    friction, before = 0.5, rng.standard_normal(COUNT)
    found = contact.slopes(free, forces, (moved - centre)[None], np.array([friction]), before[None])[0]
    ends = []
    for step in (1e-6, -1e-6):
        cylinder = contact.cylinder
        there = Cylinder(20.0, cylinder.centre + step * centre, 0.4 + step * friction)
        other = FrontContact(there, contact.compliance, contact.before + step * before)
        ends.append(other.forces(free + step * moved, forces))
    slope = (ends[0] - ends[1]) / 2e-6
    np.testing.assert_allclose(found, slope, atol=1e-5 * np.abs(slope).max())
