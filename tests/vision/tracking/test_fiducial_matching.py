"""Limits of what counts as a fiducial: distance, size, obliqueness, number; layouts of few discs."""

from itertools import permutations

import numpy as np
import pytest

from pinnray.runtime.arrays import FloatArray
from pinnray.runtime.errors import UserError
from pinnray.vision.tracking.fiducial_matching import UnseenError, identify_fiducials
from pinnray.vision.tracking.workspace import Workspace

SCALE = 6.0
"""Pixels per mm."""
FIVE = ((0.0, 0.0), (80.0, 5.0), (95.0, 60.0), (10.0, 50.0), (40.0, 75.0))
SIX = (*FIVE, (52.0, 27.0))


def of(fiducials: tuple[tuple[float, float], ...]) -> Workspace:
    return Workspace(fiducials=fiducials)


def seen(places: FloatArray, stretch: float = 1.0, turn: float = 0.0, tilt: float = 0.0) -> FloatArray:
    """Pixels of places, mm: stretched along x, turned by an angle in degrees, tilted, with y down."""
    cos, sin = np.cos(np.radians(turn)), np.sin(np.radians(turn))
    x, y = np.array([[cos, -sin], [sin, cos]]) @ (places * (stretch, 1)).T
    pixels = np.column_stack([700 + SCALE * x, 600 - SCALE * y])
    return np.asarray(pixels / (1 + tilt * places @ (2e-3, 1e-3))[:, None])


def names(
    pixels: FloatArray, workspace: Workspace, sizes: FloatArray | float = 1.0, diameter: float = 4.0
) -> list[int]:
    radii = np.broadcast_to(sizes, len(pixels)) * SCALE * diameter / 2
    return identify_fiducials(pixels, radii, workspace).tolist()


def test_the_order_of_the_discs_is_of_no_account() -> None:
    """All orders of four discs, which fit in any turn: only one has the right sizes."""
    workspace = of(FIVE[:4])
    for order in permutations(range(4)):
        found = names(seen(workspace.points, turn=20)[list(order)], workspace)
        assert np.array(order)[found].tolist() == list(range(4))


@pytest.mark.parametrize("direction", [(1, 0), (-0.6, 0.8)])
@pytest.mark.parametrize(("away", "name"), [(1.9, 5), (2.1, -1)])
def test_a_disc_is_no_fiducial_more_than_two_millimetres_away(direction, away, name):
    """The five others have their places exactly, and the misfit of other four would be larger."""
    places = of(SIX).points
    places[5] += away * np.array(direction)
    assert names(seen(places, tilt=0.2), of(SIX)) == [0, 1, 2, 3, 4, name]


@pytest.mark.parametrize(("size", "name"), [(1.28, 5), (0.78, 5), (1.32, -1), (0.76, -1)])
def test_a_disc_of_another_size_is_no_fiducial(size: float, name: int) -> None:
    """Beyond a ratio of 1.3."""
    assert names(seen(of(SIX).points), of(SIX), np.array([1, 1, 1, 1, 1, size])) == [0, 1, 2, 3, 4, name]


def test_the_size_counts_where_the_fiducial_is() -> None:
    """A plane so oblique that its far discs are seen at three quarters of the near ones' size."""
    places, step = of(FIVE).points, 1e-4
    pixels = seen(places, tilt=0.8)
    along, across = ((seen(places + step * axis, tilt=0.8) - pixels) / step for axis in np.eye(2))
    scales = np.sqrt(np.abs(along[:, 0] * across[:, 1] - along[:, 1] * across[:, 0])) / SCALE
    assert scales.max() / scales.min() > 1.3
    assert names(pixels, of(FIVE), scales) == list(range(5))


@pytest.mark.parametrize(
    ("pixels", "sizes", "fits"),
    [
        *((seen(of(FIVE).points), size, 0.77 < size < 1.3) for size in (1.28, 1.32, 0.78, 0.76)),
        # seen at 50 degrees one direction is 1.6 times as long as the other; size is the root of the area
        *(
            (seen(of(FIVE).points, stretch, turn=30), stretch**0.5, 1 / 1.6 < stretch < 1.6)
            for stretch in (1.55, 1.65, 1 / 1.55, 1 / 1.65)
        ),
    ],
)
def test_a_layout_has_the_size_of_the_workspace_and_is_not_too_oblique(pixels, sizes, fits) -> None:
    if fits:
        assert names(pixels, of(FIVE), sizes) == list(range(5))
    else:
        with pytest.raises(UnseenError):
            names(pixels, of(FIVE), sizes)


@pytest.mark.parametrize(("fiducials", "least"), [(SIX, 5), (FIVE[:4], 4)])
def test_five_fiducials_must_be_seen_or_all_of_four(fiducials, least) -> None:
    pixels, absent = seen(of(fiducials).points, tilt=0.3), len(fiducials) - least
    assert names(pixels[:least], of(fiducials)) == [*range(least), *[-1] * absent]
    with pytest.raises(UnseenError):
        names(pixels[: least - 1], of(fiducials))


def test_a_mirrored_image_is_told_from_one_that_is_not() -> None:
    with pytest.raises(UserError, match="the image is mirrored"):
        names(seen(of(FIVE).points) * (-1, 1), of(FIVE))
    symmetric = of(((0.0, 0.0), (80.0, 0.0), (20.0, 50.0), (60.0, 50.0), (40.0, 75.0)))
    mirrored = seen(symmetric.points) * (-1, 1)
    assert names(mirrored, symmetric) == [1, 0, 3, 2, 4]  # the same layout, seen from its front
    with pytest.raises(UnseenError):
        names(seen(of(SIX).points)[:4] * (-1, 1), of(SIX))  # too few to be sure that it is mirrored


def test_the_better_of_two_matches_with_as_many_fiducials_is_taken() -> None:
    """Each fiducial has a second disc 1 mm beside it: those without a residual are taken, in any order."""
    places = of(FIVE).points
    offsets = np.array([[1.0, 0.2], [-0.9, 0.4], [0.3, -1.0], [0.1, 1.1], [-0.7, -0.7]])
    both = np.concatenate([seen(places), seen(places + offsets)])
    assert names(both, of(FIVE)) == [0, 1, 2, 3, 4]
    assert names(both[::-1], of(FIVE)) == [9, 8, 7, 6, 5]


@pytest.mark.parametrize(("others", "searched"), [(11, True), (12, False)])
def test_sixteen_discs_of_one_size_are_searched(others: int, searched: bool) -> None:
    false = np.random.default_rng(7).uniform(-150, -20, (others, 2))
    pixels = seen(np.concatenate([of(FIVE).points, false]))
    if searched:
        assert names(pixels, of(FIVE)) == [0, 1, 2, 3, 4]
    else:
        with pytest.raises(UnseenError, match="at best 0 fit"):
            names(pixels, of(FIVE))


def test_many_discs_of_other_sizes_do_not_hide_the_fiducials() -> None:
    false = np.random.default_rng(8).uniform(-150, 150, (20, 2))
    pixels = seen(np.concatenate([false, of(FIVE).points]))
    assert names(pixels, of(FIVE), np.repeat([2.0, 1.0], [20, 5])) == [20, 21, 22, 23, 24]
    assert names(pixels, of(FIVE), np.repeat([0.5, 1.0], [20, 5])) == [20, 21, 22, 23, 24]


def test_fiducials_of_which_three_are_on_a_line_are_known_by_the_others() -> None:
    """Their triangle has no orientation, so rounding may not decide."""
    rows = of(((0.0, 0.0), (40.0, 0.0), (80.0, 0.0), (10.0, 50.0), (75.0, 60.0)))
    for turn in (0, 17, 90):
        assert names(seen(rows.points, turn=turn, tilt=0.3), rows) == list(range(5))
        noisy = seen(rows.points, turn=turn) + np.random.default_rng(turn).normal(0, 0.2, (5, 2))
        assert names(noisy, rows) == list(range(5))
