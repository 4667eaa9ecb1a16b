"""Films that show something else than a finger among its fiducials, or lack the fiducials."""

import cv2
import numpy as np
import pytest

from pinnray.geometry.finger.design import Design
from pinnray.geometry.picture_frame import HAND_HELD
from tests.vision.films import CAMERA, DESIGN, WORKSPACE, bent, error_of, images, recording, tracked

pytestmark = pytest.mark.usefixtures("discs_fitted_once")


def painted_over(image, points, radius=30):
    image = image.copy()
    for x, y in points:
        cv2.circle(image, (round(x), round(y)), radius, (150, 150, 150), -1)
    return image


def fiducials():
    flat = np.column_stack([WORKSPACE.points, np.zeros(len(WORKSPACE.points))])
    return CAMERA.project(flat, recording().pose)


def without_fiducials(turns=0, design=DESIGN):
    return [np.rot90(painted_over(image, fiducials()), turns) for image in images(design=design)]


@pytest.mark.slow
@pytest.mark.parametrize(("layout", "turns"), [("joints", 3), ("front", 2)])
def test_without_fiducials_the_markers_give_the_plane_and_their_motion_the_way_up(layout, turns):
    """Markers at the joints show the way up themselves; a row looks the same from both ends."""
    design = Design(marker_layout=layout)
    true = bent(design.markers)
    tracking = tracked(without_fiducials(turns, design), camera=None, markers_only=True, design=design)
    assert tracking.pressed == HAND_HELD  # nothing tells whether the camera stood still
    observations = tracking.observations("rig")
    assert observations.visible.sum() >= 7  # a jump of 10 mm is harder to follow from the wrong end
    assert error_of(observations, true) < 0.3  # the lens and a tilt of 5 degrees are not undone
    seen = observations.visible
    missed = (observations.displacements - true)[seen] / observations.standard_deviations[seen]
    assert np.sqrt(np.mean(missed**2)) < 3
    told = "the finger points at 180 degrees" in " ".join(tracking.warnings)
    assert told == (layout == "front" and turns == 2)
