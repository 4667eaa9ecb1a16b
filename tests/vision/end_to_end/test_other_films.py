"""Films that show something else than a finger among its fiducials, or lack the fiducials."""

import cv2
import numpy as np
import pytest

from geometry.errors import UserError
from geometry.finger.design import Design
from geometry.registration import HAND_HELD
from tests.vision.films import CAMERA, DESIGN, WORKSPACE, bent, error_of, images, recording, shifted, tracked
from vision.calibration.camera import Camera
from vision.tracking.workspace import Workspace

pytestmark = pytest.mark.usefixtures("discs_fitted_once")


def test_a_camera_that_loses_all_fiducials_is_refused():
    with pytest.raises(UserError, match="no fiducial is seen in the end where it was"):
        tracked([*images()[:3], *(shifted(image, 25, 0) for image in images()[3:])])


def painted_over(image, points, radius=30):
    image = image.copy()
    for x, y in points:
        cv2.circle(image, (round(x), round(y)), radius, (150, 150, 150), -1)
    return image


def fiducials():
    flat = np.column_stack([WORKSPACE.points, np.zeros(len(WORKSPACE.points))])
    return CAMERA.project(flat, recording().pose)


@pytest.mark.parametrize(
    ("change", "settings", "said"),
    [
        (lambda image: image[:, ::-1], {"camera": None}, "the image is mirrored"),
        (lambda image: np.full_like(image, 128), {}, "fiducials cannot be made out among 0 discs"),
        (lambda image: painted_over(image, fiducials()[:4]), {}, "cannot be made out among 12 discs"),
        (
            lambda image: image,
            {"design": Design(height=60, tip_length=12)},
            "of 9 markers are where the design has",
        ),
        (lambda image: image[::2, ::2], {}, "640x360 pixels, but the camera was calibrated with 1280x720"),
        (
            lambda image: image,
            {"workspace": Workspace(fiducials=((0, 0), (50, 0), (50, 30), (0, 30), (20, 60)))},
            "5 fiducials cannot be made out",
        ),
        (lambda image: image, {"camera": Camera(1280, 720, 400.0, 900.0, 640.0, 360.0)}, "fiducials"),
    ],
)
def test_what_the_film_should_not_show_is_one_line(change, settings, said):
    with pytest.raises(UserError, match=said) as caught:
        tracked([change(image) for image in images()], **settings)
    assert "\n" not in str(caught.value)


def test_a_finger_that_does_not_move_is_refused():
    with pytest.raises(UserError, match="in the end where it was at the start"):
        tracked(images()[:3])


def without_fiducials(turns=0, design=DESIGN):
    return [np.rot90(painted_over(image, fiducials()), turns) for image in images(design=design)]


@pytest.mark.parametrize(("layout", "turns"), [("joints", 3), ("front", 1), ("front", 2)])
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
    assert f"{tracking.plane.residual:.3f} mm (rms) off" in tracking.warnings[0]
    assert ("the finger points at 180 degrees" in " ".join(tracking.warnings)) == (
        layout == "front" and turns == 2
    )


def test_without_fiducials_and_markers_there_is_one_line():
    blank = [np.full_like(image, 128) for image in images()]
    with pytest.raises(
        UserError, match="neither the fiducials nor the markers can be made out among 0 discs"
    ):
        tracked(blank, camera=None, markers_only=True)
