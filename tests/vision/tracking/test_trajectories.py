"""Displacements from the means at rest, through a plane that turns and doubles, by hand."""

from typing import Any

import numpy as np

from pinnray.runtime.arrays import FloatArray
from pinnray.vision.discs.disc_detector import DiscDetections
from pinnray.vision.tracking.marker_plane import SIMILARITY, MarkerPlane
from pinnray.vision.tracking.rest_detection import RestIntervals
from pinnray.vision.tracking.trajectories import Tracking
from tests.fingers import beam
from tests.vision.tracking.listed_discs import discs_at

DESIGN = beam()
MARKERS = DESIGN.markers
PLACED = MARKERS + np.array([0.3, 0.0])
COUNT = len(MARKERS)
SCALE = 5.0
PLANE = MarkerPlane(SIMILARITY, np.array([0.0, -SCALE, 400.0, 300.0]), np.zeros((4, 4)), 0.0)
MOVED = np.column_stack([0.1 * np.arange(COUNT), -0.5 * np.arange(COUNT)])
SEEN = np.array([True, True, False, True, True, False, True])


def pixels(places: FloatArray) -> FloatArray:
    """As the plane has them: pixel = (b y + c, b x + d) with b = -5."""
    return np.column_stack([400 - SCALE * places[:, 1], 300 - SCALE * places[:, 0]])


def discs(places: FloatArray, hidden: int, variance: float) -> DiscDetections:
    return discs_at(pixels(places), hidden=[hidden], variance=variance * np.array([1.0, 4.0]))


def tracking(**changes: Any) -> Tracking:
    """Marker 3 is hidden at the start and marker 6 at the end; all are 0.3 mm beside the design's places."""
    initial, final = discs(PLACED, 2, 0.01), discs(PLACED + MOVED, 5, 0.03)
    values: dict[str, Any] = {
        **{"design": DESIGN, "expected": MARKERS, "times": np.array([0.0, 0.1])},
        **{"pixels": np.stack([initial.centres, final.centres]), "plane": PLANE},
        **{"covariances": np.stack([initial.covariances, final.covariances])},
        **{"rest": RestIntervals(range(1), range(1, 2)), "initial": initial, "final": final},
        **{"method": "precise"},
    }
    return Tracking(**values | changes)


def test_positions_are_in_the_fingers_frame() -> None:
    found = tracking()
    np.testing.assert_allclose(found.positions[0, SEEN], PLACED[SEEN], rtol=1e-12)
    np.testing.assert_allclose(found.positions[1, SEEN], (PLACED + MOVED)[SEEN], rtol=1e-12)
    assert np.isnan(found.positions[0, 2]).all()
    assert np.isnan(found.positions[1, 5]).all()
    np.testing.assert_allclose(found.rest_positions, found.positions, rtol=1e-12)


def test_offsets_are_from_the_designs_places() -> None:
    offsets = tracking().offsets
    np.testing.assert_allclose(offsets[SEEN], np.tile([0.3, 0.0], (5, 1)), atol=1e-12)
    assert np.isnan(offsets[~SEEN]).all()


def test_displacements_and_their_deviations() -> None:
    """The image is turned by a quarter, so the variance along x is that down the image, over 25."""
    found = tracking()
    covariance = found.displacement_covariance
    np.testing.assert_allclose(covariance, np.diag([0.16 / 25, 0.04 / 25] * 5), atol=1e-15)
    observed = found.observations("a film")
    assert observed.visible.tolist() == SEEN.tolist()
    np.testing.assert_allclose(observed.points[SEEN], PLACED[SEEN], rtol=1e-12)
    np.testing.assert_array_equal(observed.points[~SEEN], MARKERS[~SEEN])
    np.testing.assert_allclose(observed.displacements[SEEN], MOVED[SEEN], atol=1e-12)
    np.testing.assert_allclose(observed.standard_deviations[SEEN], np.tile([0.08, 0.04], (5, 1)), rtol=1e-12)
    assert not observed.displacements[~SEEN].any()
    assert not observed.standard_deviations[~SEEN].any()
    assert (observed.source, observed.simulated, observed.marker_radius) == ("a film", False, 0.8)
    assert found.final_plane is None
    assert found.warnings == ()
    assert tracking(simulated=True).observations("a film").simulated


def test_the_papers_linear_map_does_not_find_places() -> None:
    observed = tracking(method="hough").observations("a film")
    np.testing.assert_array_equal(observed.points, MARKERS)
    np.testing.assert_allclose(observed.displacements[SEEN], MOVED[SEEN], atol=1e-12)
