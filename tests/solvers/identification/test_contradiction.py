"""Markers that no finger explains: the guess, and what becomes of the solution."""

from dataclasses import dataclass, replace

import numpy as np
import pytest

from pinnray.geometry.registration import FIXED, HAND_HELD, Registration
from pinnray.solvers.identification.contradiction import (
    CONTRADICTED,
    EXPLAINED,
    likely_order,
    order_words,
    with_doubts,
)
from pinnray.solvers.solution import Status
from pinnray.solvers.solver import NoSolutionError
from tests.solvers.conftest import observed_at

EXPECTED = np.array([[0.1, -1.0], [0.3, -2.0], [0.2, -4.0], [-0.1, -5.0], [-0.4, -3.0], [-0.5, -0.5]])


@dataclass(frozen=True)
class Found:
    """What the function under test needs of a solution."""

    status: Status
    stats: dict[str, float]
    reaction: np.ndarray


def seen(displacements=EXPECTED, visible=None, pressed=FIXED):
    count = len(displacements)
    points = np.column_stack([np.arange(count), np.zeros(count)])
    deviations = np.column_stack([np.arange(count) + 1.0] * 2)
    return replace(observed_at(points, displacements, deviations, visible), pressed=pressed)


def doubted(observations, inflation):
    """The solution of `with_doubts`, where a function gives φ, and the observations that were solved with."""
    asked = []

    def solve(given):
        asked.append(given)
        stats = {"inflation": inflation(given), "pressed_turn": 0.5}
        stats |= {"pressed_shift_x": 0.3, "pressed_shift_y": -0.2}
        return Found(Status(True, "found", ["a marker was left out"]), stats, np.array([0.0, 0.25]))

    return with_doubts(solve, observations, lambda given: EXPECTED[given.visible]), asked


def in_order(given):
    """φ is one where the displacements seen are those expected, else it is that of a contradiction."""
    return 1.0 if np.allclose(given.displacements[given.visible], EXPECTED[given.visible]) else 300.0


@pytest.mark.parametrize(
    ("order", "said"),
    [
        ([5, 4, 3, 2, 1, 0], "in reverse order"),
        ([5, 0, 1, 2, 3, 4], "numbered one on"),
        ([1, 2, 3, 4, 5, 0], "numbered one back"),
        ([0, 1, 4, 3, 2, 5], "with 3 and 5 swapped"),
        ([1, 0, 2, 4, 3, 5], "in the order of the rows 2 1 3 5 4 6"),
    ],
)
def test_the_order_of_markers_is_found_and_said(order, said):
    moved = np.empty_like(EXPECTED)
    moved[order] = 0.8 * EXPECTED
    found = likely_order(moved, EXPECTED)
    np.testing.assert_array_equal(found, order)
    assert order_words(found, np.arange(1, 7)) == said
    assert likely_order(1.1 * EXPECTED, EXPECTED) is None


@pytest.mark.parametrize(("off", "asked"), [(EXPLAINED - 0.1, 1), (EXPLAINED + 0.1, 3), (CONTRADICTED, 3)])
def test_what_is_not_far_off_is_returned_as_it_is(off, asked):
    """From three on, another order and frame are tried; where they explain no more, all is as it was."""
    found, solved = doubted(seen(EXPECTED[::-1]), lambda given: off)
    assert found.status == Status(True, "found", ["a marker was left out"])
    assert len(solved) == asked


def test_a_small_motion_is_found_too():
    found, _ = doubted(seen(), lambda given: 6.0 if given.pressed.fixed else 1.0)
    assert not found.status.converged


def test_another_order_is_a_guess_and_not_taken():
    mixed = seen(EXPECTED[::-1])
    found, asked = doubted(mixed, in_order)
    assert not found.status.converged
    assert found.stats["inflation"] == 300
    assert "in reverse order" in found.status.warnings[0]
    np.testing.assert_array_equal(asked[1].standard_deviations, mixed.standard_deviations[::-1])


def test_markers_that_were_not_seen_keep_their_row():
    visible = np.array([1, 1, 0, 1, 1, 1])
    moved = np.zeros_like(EXPECTED)
    kept = np.flatnonzero(visible)
    moved[kept] = EXPECTED[kept][[1, 0, 2, 3, 4]]
    found, asked = doubted(seen(moved, visible), in_order)
    assert "with 1 and 2 swapped" in found.status.warnings[0]
    np.testing.assert_array_equal(asked[1].displacements[kept], EXPECTED[kept])
    assert not asked[1].displacements[2].any()


def test_a_frame_that_explains_is_taken_and_said():
    """As if the clamp had given: the solution is that of the freed frame, but has not converged."""
    found, asked = doubted(seen(), lambda given: 60.0 if given.pressed.fixed else 2.0)
    assert [given.pressed for given in asked] == [FIXED, HAND_HELD]
    assert found.stats["inflation"] == 2
    assert not found.status.converged
    assert Registration.parse(found.status.warnings[0].split("picture: ")[1].rstrip("'")) == HAND_HELD


def test_what_nothing_explains_says_what_to_look_at():
    found, asked = doubted(seen(pressed=HAND_HELD), lambda given: 60.0)
    assert len(asked) == 1
    assert not found.status.converged
    assert "60 times as far off" in found.status.warnings[0]


def test_where_there_is_no_solution_an_order_that_explains_is_said():
    def solve(given):
        if in_order(given) > 1:
            raise NoSolutionError("the finger that was found is inside out")
        return Found(Status(True, "found"), {"inflation": 1.0}, np.array([0.0, 0.25]))

    with pytest.raises(NoSolutionError, match="inside out; in reverse order"):
        with_doubts(solve, seen(EXPECTED[::-1]), lambda given: EXPECTED)
    with pytest.raises(NoSolutionError, match=r"inside out$"):
        with_doubts(solve, seen(2 * EXPECTED), lambda given: EXPECTED)


def test_a_guess_without_a_solution_is_none():
    def solve(given):
        if given.pressed != FIXED:
            raise NoSolutionError("none near the markers")
        return Found(Status(True, "found"), {"inflation": 60.0}, np.zeros(2))

    found = with_doubts(solve, seen(), lambda given: EXPECTED)
    assert "see whether drawing" in found.status.warnings[0]
