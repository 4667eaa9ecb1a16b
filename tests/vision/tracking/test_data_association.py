"""Data association against all joint hypotheses, one by one, and the covariances against closed forms."""

from itertools import product
from math import exp, log, pi, radians

import numpy as np
import pytest

from pinnray.runtime.arrays import FloatArray, IntArray
from pinnray.vision.tracking.data_association import (
    associate_markers,
    distance_from_base,
    rest_covariances,
    step_covariances,
    with_predictions,
)
from tests.fingers import RADIUS, ring

SEEN, FALSE_DENSITY, NOISE, GATE, SURE = 0.9, 1e-4, 0.15, 5.0, 0.999
"""As documented; written again here, so that a change of them fails."""


def hypotheses(found: FloatArray, expected: FloatArray, fields: FloatArray):
    """Log weight and names of every joint hypothesis within the gate, by conditioning the whole Gaussian."""
    order = np.argsort(fields[-1, 1].diagonal(), kind="stable")
    for field in fields:
        for names in product(range(-1, len(found)), repeat=len(expected)):
            used = [name for name in names if name >= 0]
            if len(set(used)) < len(used):
                continue
            total, before, inside = 0.0, list[int](), True
            for marker in order:
                name = names[marker]
                if name < 0:
                    total += log(1 - SEEN)
                    continue
                total += log(SEEN / FALSE_DENSITY)
                square = 0.0
                for axis in (0, 1):
                    known = field[axis][np.ix_(before, before)] + NOISE**2 * np.eye(len(before))
                    row = field[axis][marker, before]
                    off = found[[names[each] for each in before], axis] - expected[before, axis]
                    mean = expected[marker, axis] + row @ np.linalg.solve(known, off)
                    spread = field[axis][marker, marker] + NOISE**2 - row @ np.linalg.solve(known, row)
                    part = (found[name, axis] - mean) ** 2 / spread
                    square += part
                    total += -0.5 * (part + log(2 * pi * spread))
                inside &= square < GATE**2
                before.append(marker)
            if inside:
                yield total, names


def by_brute_force(
    found: FloatArray, expected: FloatArray, fields: FloatArray
) -> tuple[IntArray, FloatArray]:
    """What the likeliest hypothesis says where it is sure, and how sure it is."""
    weights, names = map(np.array, zip(*hypotheses(found, expected, fields), strict=True))
    best = names[weights.argmax()]
    share = np.exp(weights - weights.max())
    agreed = share @ (names == best) / share.sum()
    return np.where(agreed >= SURE, best, -1), agreed


def random_problem(seed: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Markers 1 to 6 mm apart that move together, some of them not seen, and false detections."""
    random = np.random.default_rng(seed)
    count = int(random.integers(1, 4))
    expected = np.cumsum(random.uniform(1, 6, (count, 2)), axis=0)
    root = random.normal(size=(2, count, count)) + 2
    size = random.uniform(0.02, 0.5)
    field = np.stack([size * each @ each.T for each in root])
    fields = np.stack([field / 50, field])[-int(random.integers(1, 3)) :]
    moved = np.stack([random.multivariate_normal(np.zeros(count), each) for each in field], axis=1)
    seen = random.random(count) < 0.8
    true = (expected + moved + random.normal(scale=NOISE, size=moved.shape))[seen]
    false = expected[0] + random.uniform(-4, 12, (int(random.integers(0, 2)), 2))
    found = np.concatenate([true, false])
    return random.permutation(found), expected, fields


def test_all_joint_hypotheses_of_random_problems():
    sure, unsure = 0, 0
    for seed in range(150):
        found, expected, fields = random_problem(seed)
        names, agreed = by_brute_force(found, expected, fields)
        if np.abs(agreed - SURE).min() < 1e-9:
            continue  # rounding decides
        assert associate_markers(found, expected, fields).tolist() == names.tolist(), seed
        sure += (names >= 0).sum()
        unsure += (names < 0).sum()
    assert sure > 80  # both ends are common among these problems
    assert unsure > 80


def test_without_detections_all_are_missing():
    expected = np.array([[1.0, 2.0], [3.0, 4.0]])
    assert associate_markers(np.empty((0, 2)), expected, rest_covariances(expected)).tolist() == [-1, -1]


def test_many_markers_among_many_false_detections():
    """More joint hypotheses than are kept, and weights whose sum no float's exponential holds."""
    expected = np.column_stack([10.0 * np.arange(60), np.zeros(60)])
    false = np.column_stack([10.0 * np.arange(300), np.full(300, 50.0)])
    found = np.concatenate([false, np.add(expected[::-1], (0.1, -0.1))])
    names = associate_markers(found, expected, np.zeros((1, 2, 60, 60)))
    assert names.tolist() == list(range(359, 299, -1))


def test_distances_from_a_round_base():
    """The ring's base is an arc of 60 degrees; a line through 65 of its points is a little inside of it."""
    body = ring().section
    centre = np.array([RADIUS * np.sin(np.pi / 6), -RADIUS])
    angles = np.radians([240.0, 251.0, 270.3, 299.0, 300.0])
    sides = np.column_stack([np.cos(angles), np.sin(angles)])
    inside = RADIUS * (1 - np.cos(np.radians(60) / 128))
    depths = np.array([0.0, 1.0, 2.0, 3.0, 0.5])
    found = distance_from_base(body, centre + (RADIUS - depths)[:, None] * sides)
    assert found.shape == (5,)
    assert found == pytest.approx(depths, abs=inside + 1e-9)
    beyond = centre + RADIUS * np.array([[np.cos(np.radians(200)), np.sin(np.radians(200))]])
    chord = 2 * RADIUS * np.sin(np.radians(20))  # to the arc's end, 40 degrees away
    assert distance_from_base(body, beyond) == pytest.approx([chord], rel=1e-9)


POINTS = np.array([[0.0, 1.0], [20.0, -3.0], [45.0, -8.0], [50.0, -1.0]])
REACH = np.array([0.5, 21.0, 40.0, 50.0])
NODES, WEIGHTS = np.polynomial.legendre.leggauss(400)


def walk(first: float, second: float) -> float:
    """Covariance of the integrals, from 0 to two places, of a random walk: the integral of min(s, t)."""
    s, t = (0.5 * place * (NODES + 1) for place in (first, second))
    whole = 0.25 * first * second * WEIGHTS @ np.minimum(s[:, None], t) @ WEIGHTS
    return float(whole)


@pytest.mark.parametrize("jump", [1.0, 0.25])
def test_covariances_of_a_step(jump):
    """Both axes of every pair, from the documented parts: hinge, random walk, rotation of the section."""
    (found,) = step_covariances(POINTS, REACH, (jump,))
    length, middle = 50.0, POINTS[:, 1].mean()
    assert found.shape == (2, 4, 4)
    for (i, (xi, yi)), (j, (xj, yj)) in product(enumerate(POINTS), repeat=2):
        a, b = REACH[i] / length, REACH[j] / length
        hi, hj = (yi - middle) / length, (yj - middle) / length
        branch = exp(-0.5 * (((xi / length - a) - (xj / length - b)) / 0.8) ** 2)
        size = (jump * length) ** 2 * branch
        u = 0.05**2 * a * b + 0.15**2 * walk(a, b) + 0.2**2 * min(a, b) * hi * hj
        v = (0.25**2 * a * b + 0.6**2 * walk(a, b)) * exp(-0.5 * ((hi - hj) / 0.4) ** 2)
        assert found[0, i, j] == pytest.approx(size * u, rel=1e-4)  # of the quadrature across the kink
        assert found[1, i, j] == pytest.approx(size * v, rel=1e-4)


def test_covariances_at_rest():
    """A shift by 1 mm and a turn by 1 degree: u = -y t, v = x t."""
    (u, v), *others = rest_covariances(POINTS)
    assert others == []
    turn = radians(1) ** 2
    assert u == pytest.approx(1 + turn * np.outer(POINTS[:, 1], POINTS[:, 1]), rel=1e-12)
    assert v == pytest.approx(1 + turn * np.outer(POINTS[:, 0], POINTS[:, 0]), rel=1e-12)


def test_predictions_are_the_conditional_mean_of_the_field():
    """By the inverse of the covariance of all: the mean of one given the others is a ratio of entries."""
    moved = np.array([[0.0, -0.1], [np.nan, np.nan], [-1.0, -4.0], [0.3, np.nan]])
    whole = with_predictions(POINTS, REACH, moved)
    assert whole[[0, 2]].tolist() == moved[[0, 2]].tolist()
    assert np.isnan(moved[1]).all()  # what was given stays as it is
    for axis, field in enumerate(step_covariances(POINTS, REACH, (1.0,))[0]):
        for missing in (1, 3):  # a displacement with one number is none
            chosen = [missing, 0, 2]
            noise = np.diag([0.0, NOISE**2, NOISE**2])
            precision = np.linalg.inv(field[np.ix_(chosen, chosen)] + noise)
            mean = -precision[0, 1:] @ moved[[0, 2], axis] / precision[0, 0]
            assert whole[missing, axis] == pytest.approx(mean, rel=1e-6)
