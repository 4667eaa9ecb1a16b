"""Films without fiducials, on lists of discs: the markers give the plane; and which fiducials are at rest."""

from dataclasses import replace

import numpy as np
import pytest

from pinnray.runtime.arrays import FloatArray
from pinnray.runtime.errors import UserError
from pinnray.vision.tracking.marker_plane import SIMILARITY
from pinnray.vision.tracking.rest_detection import RestIntervals
from pinnray.vision.tracking.scene import FilmedScene
from pinnray.vision.tracking.tracker import _fiducials_at_rest, track
from pinnray.vision.tracking.trajectories import Tracking
from tests.vision.end_to_end.test_track import FINGER, MARKERS, PRESSED, RED, SHARES, SPACE, film
from tests.vision.tracking.listed_discs import NOISE, ListedDiscs


def markers_only(
    listed: ListedDiscs, markers: FloatArray, moved: FloatArray, turn: float, mirrored: bool = False
) -> Tracking:
    """A film without fiducials, turned in the image by an angle, degrees, counter-clockwise."""
    scene = FilmedScene(replace(FINGER, markers=markers), SPACE, colour=RED, markers_only=True)
    cos, sin = 9 * np.cos(np.radians(turn)), 9 * np.sin(np.radians(turn))
    pictures = []
    for share in SHARES:
        pixels = SIMILARITY.pixels(markers + share * moved, np.array([cos, -sin, 640.0, 360.0]))
        pixels = (pixels - (640, 360)) * (1, -1 if mirrored else 1) + (640, 360)
        pictures.append(listed.picture((RED, pixels, 0.8 * 9, 100.0)))
        listed.pictures[-1][0][1].covariances[:] *= np.arange(1, 8)[:, None, None]
    return track(film(pictures), scene)


ROW = np.column_stack([np.linspace(-40, 40, 7) + 50, np.full(7, -5.0)])
STEP = -1.0 * np.column_stack([0.1 * (ROW[:, 0] / 90) ** 2, (ROW[:, 0] / 90) ** 2])


@pytest.mark.parametrize(("turn", "said"), [(20, ""), (-60, ""), (180, "180"), (200, "200"), (130, "130")])
def test_the_markers_alone_give_the_plane_and_their_motion_its_direction(listed, turn, said):
    """A row looks the same from both ends: if x does not run to the right, the motion shows it."""
    tracking = markers_only(listed, ROW, STEP, turn)
    np.testing.assert_allclose(tracking.observations("a film").displacements, STEP, atol=1e-6)
    np.testing.assert_allclose(tracking.positions[-1], ROW + STEP, atol=1e-6)
    np.testing.assert_allclose(tracking.positions[0], ROW, atol=1e-6)
    assert len(tracking.warnings) == 1 + bool(said)
    assert said in tracking.warnings[-1]
    each = NOISE**2 * np.arange(1, 8)[:, None, None] * np.eye(2)
    np.testing.assert_allclose(tracking.covariances, np.tile(each, (8, 1, 1, 1)))


def test_markers_that_move_out_of_the_front_are_of_a_mirrored_image(listed: ListedDiscs) -> None:
    with pytest.raises(UserError, match="the markers move out of the front: the image is mirrored"):
        markers_only(listed, MARKERS, -PRESSED, 0.0)


@pytest.mark.parametrize(
    ("searched", "before", "after"),
    [
        ((0, 1, 2, 3, 7, 8, 9), (0, 1, 2), (8, 9)),  # those in the frames at rest
        ((0, 5), (0,), (5,)),  # none at the end: the last one
        ((0, 4, 5), (0,), (5,)),
        ((0, 8), (0,), (8,)),
        ((4, 5), (4,), (5,)),  # none at either end: the nearest ones
    ],
)
def test_fiducials_at_rest_are_those_searched_for_or_the_nearest(searched, before, after):
    numbers = [number if number in searched else None for number in range(10)]
    found = _fiducials_at_rest(numbers, RestIntervals(range(3), range(8, 10)))
    assert found == ([*before], [*after], [*before, *after])
