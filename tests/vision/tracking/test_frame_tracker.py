"""Tracking from frame to frame through pictures that are lists of discs; 8 pixels are 1 mm."""

from collections.abc import Sequence

import numpy as np
import pytest

from pinnray.runtime.arrays import FloatArray
from pinnray.runtime.errors import UserError
from pinnray.vision.discs.colour import DARK, ColourRange
from pinnray.vision.discs.disc_detector import DiscDetections
from pinnray.vision.frames.frame import Image
from pinnray.vision.tracking.data_association import distance_from_base, with_predictions
from pinnray.vision.tracking.frame_tracker import FrameTracker
from pinnray.vision.tracking.marker_plane import SIMILARITY, MarkerPlane
from pinnray.vision.tracking.scene import FilmedScene
from pinnray.vision.tracking.workspace import Workspace
from tests.fingers import beam
from tests.vision.tracking.listed_discs import ListedDiscs, discs_at

FINGER, RED = beam(), ColourRange((20.0, 40.0, 20.0), (80.0, 90.0, 80.0))
MARKERS, RADIUS, COUNT = FINGER.markers, FINGER.marker_radius, 7
REACH = distance_from_base(FINGER.section, MARKERS)
SCALE = 8.0
PLANE = MarkerPlane(SIMILARITY, np.array([SCALE, 0.0, 150.0, 200.0]), np.zeros((4, 4)), 0.0)
CORNERS = np.array([[-12.0, 12.0], [112.0, 12.0], [112.0, -25.0], [-12.0, -22.0], [50.0, -24.0]])
SIZE = 2 * SCALE
BENT = -1.5 * np.column_stack([0.1 * (REACH / 100) ** 2, (REACH / 100) ** 2])
"""A small step, mm."""


class KnownPlane(FilmedScene):
    """A scene whose first plane is given; the third fiducial is hidden in the first frame."""

    def first_plane(self, image: Image) -> tuple[MarkerPlane, DiscDetections]:
        """The plane, and the fiducials."""
        return PLANE, discs_at(PLANE.pixels(CORNERS), hidden=[2], radius=SIZE)


SCENE = KnownPlane(FINGER, Workspace(fiducials=tuple(map(tuple, CORNERS.tolist()))), colour=RED)


def shown(
    listed: ListedDiscs,
    places: FloatArray = MARKERS,
    *,
    hidden: Sequence[int] = (),
    false: Sequence[tuple[float, float]] = (),
    size: FloatArray | float = 1.0,
    contrasts: FloatArray | float = 100.0,
    fiducials: FloatArray = CORNERS,
) -> Image:
    """A picture of the markers but for the hidden ones, false discs of their size, and the fiducials."""
    levels, radii = (
        np.broadcast_to(values, COUNT) for values in (contrasts, RADIUS * SCALE * np.array(size))
    )
    own = [
        (RED, PLANE.pixels(places[n : n + 1]), float(radii[n]), float(levels[n]))
        for n in range(COUNT)
        if n not in hidden
    ]
    others = [(RED, PLANE.pixels(np.array([place])), RADIUS * SCALE, 100.0) for place in false]
    return listed.picture(*own, *others, (DARK, PLANE.pixels(fiducials), SIZE, 100.0))


def found(detections: DiscDetections) -> list[int]:
    """Numbers of the markers that were detected."""
    return np.nonzero(np.isfinite(detections.radii))[0].tolist()


def searches(listed: ListedDiscs) -> int:
    """How often all discs of a window were asked for."""
    return sum(request.window is not None for request in listed.requests)


def guesses_of_markers(listed: ListedDiscs) -> list[FloatArray]:
    """Where markers were looked for, mm."""
    return [PLANE.points(r.guesses) for r in listed.requests if r.window is None and r.colour is RED]


def test_the_first_frame_names_the_markers_where_the_design_has_them(listed: ListedDiscs) -> None:
    off = MARKERS + np.array([0.4, -0.3])
    tracker = FrameTracker(SCENE, shown(listed, off))
    first = tracker.first
    np.testing.assert_allclose(first.markers.centres, PLANE.pixels(off))
    np.testing.assert_allclose(first.places, off)
    np.testing.assert_allclose(first.guesses, PLANE.pixels(off))
    assert tracker.plane is PLANE


def test_the_first_search_is_15_mm_around_the_design_for_discs_of_about_the_size(listed: ListedDiscs) -> None:
    FrameTracker(SCENE, shown(listed))
    (request,) = [request for request in listed.requests if request.window is not None][:1]
    (x0, y0), (x1, y1) = MARKERS.min(axis=0) - 15, MARKERS.max(axis=0) + 15
    assert request.window == (150 + 8 * x0, 200 - 8 * y1, 150 + 8 * x1 + 1, 200 - 8 * y0 + 1)
    assert request.limits == pytest.approx((0.8 * 8 / 1.3, 0.8 * 8 * 1.3))
    assert request.colour is RED
    assert not len(request.radii), "not yet"


def test_three_markers_must_be_where_the_design_has_them(listed: ListedDiscs) -> None:
    assert found(FrameTracker(SCENE, shown(listed, hidden=range(4))).first.markers) == [4, 5, 6]
    with pytest.raises(UserError, match="2 of 7 markers"):
        FrameTracker(SCENE, shown(listed, hidden=range(5)))


@pytest.mark.parametrize("size", [1.0, 1.2])
def test_markers_are_looked_for_at_the_size_that_the_first_frame_shows(listed, size):
    tracker = FrameTracker(SCENE, shown(listed, size=size, hidden=[2]))
    tracker.see(shown(listed, size=size))
    near = [r for r in listed.requests if r.window is None and r.colour is RED]
    assert len(near) >= 2
    for request in near:
        np.testing.assert_allclose(request.radii, size * RADIUS * SCALE)
    again = [r for r in listed.requests if r.window is not None][-1]
    assert len(again.radii), "of partly hidden discs, too"
    np.testing.assert_allclose(again.radii, size * RADIUS * SCALE)
    assert again.limits == pytest.approx((size * 6.4 / 1.3, size * 6.4 * 1.3))


@pytest.mark.parametrize(
    ("contrast", "seen"),
    [(21.0, True), (19.0, False), (490.0, True), (510.0, False), (-100.0, False), (np.nan, True)],
)
def test_a_disc_of_another_contrast_is_no_marker(listed: ListedDiscs, contrast: float, seen: bool) -> None:
    """A fifth to five times that of the first frame's markers; hough circles have none."""
    tracker = FrameTracker(SCENE, shown(listed))
    levels = np.full(COUNT, 100.0)
    levels[4] = contrast
    expected = list(range(7)) if seen else [0, 1, 2, 3, 5, 6]
    assert found(tracker.see(shown(listed, contrasts=levels)).markers) == expected


def test_markers_are_looked_for_where_the_last_step_leads(listed: ListedDiscs) -> None:
    """From the second frame on; the offset of the first one from the design is no motion."""
    off, step = MARKERS + np.array([0.5, 0.4]), 0.4 * BENT
    tracker = FrameTracker(SCENE, shown(listed, off))
    listed.requests.clear()
    for number in (1, 2, 3):
        seen = tracker.see(shown(listed, off + number * step))
        assert found(seen.markers) == list(range(7))
        np.testing.assert_allclose(seen.places, off + number * step, atol=1e-9)
    np.testing.assert_allclose(guesses_of_markers(listed), [off, off + 2 * step, off + 3 * step], atol=1e-9)
    assert searches(listed) == 0


def test_a_hidden_marker_is_expected_where_the_others_predict(listed: ListedDiscs) -> None:
    tracker = FrameTracker(SCENE, shown(listed))
    seen = tracker.see(shown(listed, MARKERS + BENT, hidden=[3]))
    assert found(seen.markers) == [0, 1, 2, 4, 5, 6]
    step = BENT.copy()
    step[3] = np.nan
    expected = MARKERS + with_predictions(MARKERS, REACH, step)
    np.testing.assert_allclose(seen.places, expected, atol=1e-9)
    np.testing.assert_allclose(seen.guesses, PLANE.pixels(expected), atol=1e-9)
    np.testing.assert_allclose(seen.places[3], (MARKERS + BENT)[3], atol=0.1)
    again = tracker.see(shown(listed, MARKERS + 2 * BENT))
    assert found(again.markers) == list(range(7))


def test_markers_that_a_search_leaves_out_are_looked_for_where_the_others_predict(listed):
    """As one that is partly hidden: here its disc is too large for a search of all discs."""
    tracker = FrameTracker(SCENE, shown(listed))
    places, sizes = MARKERS + 6 * BENT, np.array([1, 1, 1, 1.33, 1, 1, 1])
    listed.requests.clear()
    seen = tracker.see(shown(listed, places, size=sizes))
    assert searches(listed) == 1
    first, second = guesses_of_markers(listed)
    np.testing.assert_allclose(first, MARKERS, atol=1e-9)
    others = np.delete(np.arange(COUNT), 3)
    np.testing.assert_allclose(second[others], places[others], atol=1e-9)
    assert np.linalg.norm(second[3] - places[3]) < 0.8 * RADIUS
    assert found(seen.markers) == list(range(7))


@pytest.mark.parametrize(
    ("first", "later", "expected"),
    [
        # the first loss is searched for at once, as is one more at the end
        ([], [*[[2]] * 11, [2, 4]], [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 1]),
        ([2], [[2]] * 11, [0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0]),
        ([], [[]] * 7, [0] * 7),
    ],
)
@pytest.mark.parametrize("live", [False, True])
def test_lost_markers_are_searched_for_in_every_frame_of_a_film_and_every_fifth_of_a_camera(
    listed: ListedDiscs, first, later, expected, live: bool
) -> None:
    tracker = FrameTracker(SCENE, shown(listed, hidden=first), live=live)
    counts = []
    for hidden in later:
        before = searches(listed)
        tracker.see(shown(listed, hidden=hidden))
        counts.append(searches(listed) - before)
    assert counts == (expected if live else [int(bool(hidden)) for hidden in later])


@pytest.mark.parametrize("live", [False, True])
def test_fiducials_are_looked_for_in_every_frame_of_a_film_and_every_fifth_of_a_camera(listed, live):
    tracker = FrameTracker(SCENE, shown(listed), live=live)
    detections = [tracker.first, *(tracker.see(shown(listed)) for _ in range(11))]
    looked = [number for number, each in enumerate(detections) if each.fiducials is not None]
    assert looked == ([0, 5, 10] if live else list(range(12)))
    assert detections[10].fiducials is not None
    assert found(detections[10].fiducials) == [0, 1, 3, 4], "one was hidden in the first frame"


def test_fiducials_are_found_anew_where_a_camera_that_is_knocked_shows_them(listed: ListedDiscs) -> None:
    tracker, moved = FrameTracker(SCENE, shown(listed)), CORNERS + np.array([3.0, 0.5])
    for _ in range(2):
        seen = tracker.see(shown(listed, fiducials=moved)).fiducials
        assert seen is not None
        assert found(seen) == [0, 1, 2, 3, 4]
        np.testing.assert_allclose(seen.centres, PLANE.pixels(moved))


def test_a_fiducial_is_known_within_its_radius_of_where_it_was(listed: ListedDiscs) -> None:
    tracker = FrameTracker(SCENE, shown(listed))
    moved = CORNERS[::-1].copy()  # the order in which they are detected is of no account
    moved[4] += (0.5, 0.4)
    moved[3] += (3.0, 0.0)
    seen = tracker.see(shown(listed, fiducials=moved)).fiducials
    assert seen is not None
    assert found(seen) == [0, 3, 4]
    np.testing.assert_allclose(seen.centres[[0, 3, 4]], PLANE.pixels(moved[::-1])[[0, 3, 4]])
    last = [request for request in listed.requests if request.colour is DARK][-1]
    np.testing.assert_allclose(last.guesses, PLANE.pixels(CORNERS[[0, 1, 3, 4]]))
    np.testing.assert_allclose(last.radii, SIZE)
    gone = tracker.see(shown(listed, fiducials=np.empty((0, 2)))).fiducials
    assert gone is not None
    assert gone.centres.shape == (5, 2)
    assert found(gone) == []
