"""Names of markers against the truth: deformations by finite elements, hidden markers and false discs."""

import numpy as np
import pytest

from pinnray.vision.tracking.data_association import associate_markers, rest_covariances, step_covariances
from tests.vision.fingers import MARKERS, pressed

FRONT = MARKERS["front"]


def names_after(step, *, layout="front", hidden=(), false=(), start=None, seed=0):
    """What markers are called after `step`: their own number, another's, -1, or -2 for a false disc."""
    points = MARKERS[layout] if start is None else start
    seen = np.setdiff1d(np.arange(len(points)), hidden)
    found = np.concatenate([(points + step)[seen], np.reshape(false, (-1, 2))])
    label = np.concatenate([seen, np.full(len(found) - len(seen), -2)])
    order = np.random.default_rng(seed).permutation(len(found))
    chosen = associate_markers(found[order], points, step_covariances(MARKERS[layout], MARKERS[layout][:, 0]))
    return np.where(chosen >= 0, label[order][chosen], -1)


def a_jump(generator, layout):
    """Where markers were and the step to where they are: up to 10 mm, deeper or back."""
    whole = pressed(layout, generator)
    before = generator.uniform(0, 1) * whole
    step = pressed(layout, generator) * generator.choice([-1, 1])
    step *= generator.uniform(0, 10) / np.linalg.norm(step, axis=1).max()
    return MARKERS[layout] + before, step + generator.normal(0, 0.01, step.shape)


@pytest.mark.parametrize(("layout", "least"), [("front", 0.98), ("joints", 0.94)])
def test_no_jump_swaps_or_invents_markers(layout, least):
    generator = np.random.default_rng(1)
    named = shown = 0
    for case in range(150):
        start, step = a_jump(generator, layout)
        hidden = generator.choice(9, generator.integers(0, 4), replace=False)
        false = generator.uniform((-5, -40), (100, 15), (generator.integers(0, 4), 2))
        truth = np.where(np.isin(np.arange(9), hidden), -1, np.arange(9))
        # A false disc where a smooth deformation could have brought a hidden marker deceives anybody.
        to_hidden = np.linalg.norm(false[:, None] - (start + step)[hidden], axis=2)
        false = false[(to_hidden > 6).all(axis=1)]
        names = names_after(step, layout=layout, hidden=hidden, false=false, start=start, seed=case)
        assert ((names == truth) | (names == -1)).all(), case
        named, shown = named + (names >= 0).sum(), shown + (truth >= 0).sum()
    assert named >= least * shown


def test_at_rest_markers_are_named_within_a_millimetre_and_a_degree_and_not_at_another_place():
    near = FRONT @ np.array([[1, 0.017], [-0.017, 1]]) + (1, -1)
    np.testing.assert_array_equal(
        associate_markers(near[::-1], FRONT, rest_covariances(FRONT)), np.arange(9)[::-1]
    )
    assert (associate_markers(FRONT + np.array([0, 12]), FRONT, rest_covariances(FRONT)) == -1).all()
