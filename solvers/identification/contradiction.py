"""Markers that no finger explains: what else they could be, and a solution that says so."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from scipy.optimize import linear_sum_assignment

from pinnray.geometry.observations import Observations
from pinnray.geometry.registration import HAND_HELD
from pinnray.runtime.arrays import FloatArray, IntArray
from pinnray.solvers.solution import Solution, Status
from pinnray.solvers.solver import NoSolutionError

CONTRADICTED = 20.0
"""φ from which the markers are not those of the finger. It is 1 to 2 over the truths of
`comparison.evaluation.truths`, 60 with a clamp that gave by 0.5 degrees and 0.4 mm, and 270 to 410 with
markers
in another order."""
EXPLAINED = 3.0
"""Factor by which another order or frame has to lower φ to be named; they are tried where it can."""
MUCH_NEARER = 0.75
"""Share of the distance from a linear finger to which another order of the markers has to bring them to be
suspected: 0.53 to 0.58 where they were in reverse order, numbered one off or had their walls swapped."""


def likely_order(moved: FloatArray, expected: FloatArray, share: float = 1.0) -> IntArray | None:
    """The order in which displacements are nearest to expected ones, or None if the given one is not far off.

    Args:
        moved: Displacements, shape (m, 2), mm.
        expected: What is expected of the same markers up to a factor, shape (m, 2), mm.
        share: The share of the given order's distance from the expected ones to which another has to come.

    Returns:
        Rows of `moved`, shape (m,): the one of the first marker first.
    """
    size = float((moved * expected).sum() / max(float((expected**2).sum()), np.finfo(float).tiny))
    apart = ((moved[:, None] - abs(size) * expected) ** 2).sum(axis=2)
    rows, places = linear_sum_assignment(apart)
    order = rows[np.argsort(places)]
    nearer = _distance(moved[order], expected) < share * _distance(moved, expected)
    return order if nearer and (order != np.arange(len(order))).any() else None


def order_words(order: IntArray, numbers: IntArray) -> str:
    """An order of rows in words, with the markers' numbers."""
    count = len(order)
    if (order == np.arange(count)[::-1]).all():
        return "in reverse order"
    for off, said in ((1, "numbered one on"), (-1, "numbered one back")):
        if (order == np.roll(np.arange(count), off)).all():
            return said
    if len(swapped := np.flatnonzero(order != np.arange(count))) == 2:
        return f"with {numbers[swapped[0]]} and {numbers[swapped[1]]} swapped"
    return f"in the order of the rows {' '.join(map(str, numbers[order]))}"


def with_doubts(
    solve: Callable[[Observations], Solution],
    observations: Observations,
    expected: Callable[[Observations], FloatArray],
) -> Solution:
    """The solution; where it does not explain the markers, one that has not converged and says why.

    If another order of the markers explains them, that is a guess. If another frame of the pressed picture
    does, although the measurements say that it is fixed, the solution is that with the frame found.

    Args:
        solve: Solves with observations; the solution's `stats` have φ as `inflation`.
        observations: What was given.
        expected: Displacements of the markers seen, up to a factor, for a guess of their order.
    """
    try:
        found = solve(observations)
    except NoSolutionError as error:
        raise NoSolutionError(f"{error}{_better_order(solve, observations, expected)}") from error
    off = _inflation(found)
    if off < EXPLAINED:
        return found
    fault = (
        f"NO FINGER OF THIS DRAWING EXPLAINS THE MARKERS: they are {off:.0f} times as far off as they are "
        "known, so that force and intervals say nothing"
    )
    seen = np.flatnonzero(observations.visible)
    order = likely_order(observations.displacements[seen], expected(observations))
    if order is not None and (gain := _gain(solve, _reordered(observations, order), off)):
        words, (factor, other) = order_words(order, seen + 1), gain
        return _doubted(
            found,
            f"{fault}; {words} their displacements fit {factor:.0f} times better, with a force of "
            f"{np.linalg.norm(other.reaction):.3g} N/mm; see how they are numbered",
        )
    free = replace(observations, pressed=HAND_HELD)
    if observations.pressed.fixed and (gain := _gain(solve, free, off)):
        factor, other = gain
        turn, x, y = (float(other.stats[f"pressed_{name}"]) for name in ("turn", "shift_x", "shift_y"))
        fault = (
            "THE PRESSED PICTURE IS NOT IN THE FRAME OF THAT AT REST, though the measurements say so: turned "
            f"by {turn:.2g} degrees and shifted by ({x:.2g}, {y:.2g}) mm it fits {factor:.0f} times better, "
            "as if the clamp had given or the camera had moved; the result is with the frame that was found, "
            f"which the measurements may allow by a line '# pressed picture: {HAND_HELD}'"
        )
        return _doubted(other, fault, f"{fault}; {other.status.message}")
    if off <= CONTRADICTED:
        return found
    return _doubted(found, f"{fault}; see whether drawing, clamp, load and numbers of the markers are right")


def _better_order(
    solve: Callable[[Observations], Solution],
    observations: Observations,
    expected: Callable[[Observations], FloatArray],
) -> str:
    """Words on another order that explains markers for which there is no solution; empty if none does."""
    seen = np.flatnonzero(observations.visible)
    try:
        order = likely_order(observations.displacements[seen], expected(observations), MUCH_NEARER)
    except NoSolutionError:
        return ""
    if order is None or (gain := _gain(solve, _reordered(observations, order), EXPLAINED**2)) is None:
        return ""
    return (
        f"; {order_words(order, seen + 1)} their displacements fit, with a force of "
        f"{np.linalg.norm(gain[1].reaction):.3g} N/mm; see how they are numbered"
    )


def _gain(
    solve: Callable[[Observations], Solution], other: Observations, off: float
) -> tuple[float, Solution] | None:
    """Factor by which φ falls with other observations, and the solution; None if it is no large one."""
    try:
        found = solve(other)
    except NoSolutionError:
        return None
    factor = off / _inflation(found)
    return (factor, found) if factor >= EXPLAINED else None


def _reordered(observations: Observations, order: IntArray) -> Observations:
    """The observations with the displacements of the markers seen in another order."""
    seen = np.flatnonzero(observations.visible)
    columns = {}
    for name in ("displacements", "standard_deviations"):
        columns[name] = getattr(observations, name).copy()
        columns[name][seen] = columns[name][seen[order]]
    return replace(observations, **columns)


def _doubted(found: Solution, fault: str, message: str | None = None) -> Solution:
    """A solution that has not converged, since something is wrong with what was measured."""
    return replace(found, status=Status(False, message or fault, (fault, *found.status.warnings)))


def _inflation(found: Solution) -> float:
    return float(found.stats["inflation"])


def _distance(moved: FloatArray, expected: FloatArray) -> float:
    """Distance of displacements from the nearest multiple of expected ones, mm."""
    size = float((moved * expected).sum() / max(float((expected**2).sum()), np.finfo(float).tiny))
    return float(np.linalg.norm(moved - size * expected))
