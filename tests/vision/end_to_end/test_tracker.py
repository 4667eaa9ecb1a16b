"""Films of the virtual rig, tracked, against their truth; and films that show something else."""

from dataclasses import replace

import cv2
import numpy as np
import pytest

from geometry.errors import UserError
from geometry.finger.design import Design
from geometry.registration import HAND_HELD
from tests.vision.films import CAMERA, DESIGN, WORKSPACE, bent, frames_of, images, recording
from vision.calibration.camera import Camera
from vision.rig.motion import Course, Motion
from vision.rig.occluders import cables
from vision.tracking.scene import FilmedScene
from vision.tracking.tracker import track
from vision.tracking.workspace import Workspace

pytestmark = pytest.mark.usefixtures("discs_fitted_once")

MARKERS = DESIGN.markers
TRUE = bent(MARKERS)


def tracked(pictures, **changes):
    return track(
        frames_of(pictures),
        FilmedScene(**{"design": DESIGN, "workspace": WORKSPACE, "camera": CAMERA} | changes),
    )


def error_of(observations, true=TRUE):
    """Mean over the markers of the sum of the absolute errors, mm."""
    return np.abs(observations.displacements - true)[observations.visible].sum(axis=1).mean()


@pytest.fixture(scope="module")
def tracking():
    return tracked(images())


@pytest.fixture(scope="module")
def without_camera():
    return tracked(images(), camera=None)


def test_a_tilted_camera_measures_a_jump_of_10_mm_to_hundredths_of_a_millimetre(tracking):
    observations = tracking.observations("rig")
    assert observations.visible.all()
    assert error_of(observations) < 0.01  # 0.02 is asked for
    np.testing.assert_allclose(observations.points, MARKERS, rtol=0, atol=0.02)
    assert not observations.simulated
    assert observations.marker_radius == DESIGN.marker_radius
    assert (tracking.rest.initial, tracking.rest.final) == (range(3), range(3, 6))
    assert not any("not at rest" in line for line in tracking.warnings)


@pytest.mark.parametrize(
    ("rest", "held"),
    [
        (3, 3),  # no fifth frame among those held
        (7, 8),  # one of eight, fewer than a fifth
        (6, 4),  # none again; the one before belongs to the rest at the start
    ],
)
def test_a_live_film_is_tracked_wherever_it_is_cut(tracking, rest, held):
    pictures = images()
    film = [*(pictures[number % 3] for number in range(rest)), *(pictures[3 + n % 3] for n in range(held))]
    live = track(frames_of(film, live=True), FilmedScene(DESIGN, WORKSPACE, CAMERA))
    # Fewer of the same pictures show the fiducials: their noise is 0.01 pixels, a thousandth of a millimetre.
    found, whole = (each.observations("rig").displacements for each in (live, tracking))
    np.testing.assert_allclose(found, whole, rtol=0, atol=0.002)


def test_the_standard_deviations_are_of_the_size_of_the_errors(tracking):
    observations = tracking.observations("rig")
    errors = (observations.displacements - TRUE) / observations.standard_deviations
    assert 0.3 < np.sqrt(np.mean(errors**2)) < 1.7
    assert observations.standard_deviations.max() < 0.02


def test_pixels_are_those_of_the_truth(tracking):
    _, truth = recording().frame(0)
    for number in range(3):
        np.testing.assert_allclose(tracking.pixels[number], truth.pixels, rtol=0, atol=0.15)


def test_the_papers_pipeline_is_an_order_of_magnitude_worse():
    tracking = tracked(images(), method="hough")
    observations = tracking.observations("rig")
    assert 0.03 < error_of(observations) < 0.4
    assert 0.05 < observations.standard_deviations.mean() < 0.2
    np.testing.assert_array_equal(observations.points, MARKERS)


def test_a_marker_behind_a_cable_is_missing_and_no_other_takes_its_name():
    tracking = tracked(images(hidden=4))
    observations = tracking.observations("rig")
    np.testing.assert_array_equal(np.nonzero(~observations.visible)[0], [4])
    assert error_of(observations) < 0.015
    np.testing.assert_array_equal(observations.points[4], MARKERS[4])
    assert any("reported missing: marker 5" in warning for warning in tracking.warnings)


def test_markers_that_were_lost_are_found_in_the_next_frame_that_shows_them():
    blurred = [cv2.blur(image, (200, 200)) for image in images()[:3]]
    tracking = tracked([*images()[:3], *blurred, *images()[3:]])
    assert np.isnan(tracking.pixels[3:6]).all()
    assert np.isfinite(tracking.pixels[6, :8]).all()
    assert np.isfinite(tracking.pixels[7:]).all()  # that in the tip, 21 mm from the next one, a frame later
    assert error_of(tracking.observations("rig")) < 0.01


def test_a_marker_that_jumps_partly_behind_a_cable_is_found():
    film = recording()
    film = replace(
        film,
        motion=Motion(rest=1, moving=0, held=2),
        occluders=cables(film.bench, Course.proportional(film.displacement), film.motion, {5: 0.35}),
    )
    observations = tracked([image for image, _ in film.frames()]).observations("rig")
    assert observations.visible.all()
    others = np.delete(np.abs(observations.displacements - TRUE).sum(axis=1), 4)
    assert others.max() < 0.015
    assert np.abs(observations.displacements - TRUE)[4].sum() < 0.1
    assert observations.standard_deviations[4].max() > 2 * observations.standard_deviations.mean()


def shifted(image, x, y):
    """What a camera sees that was turned a little."""
    return np.roll(image, (y, x), axis=(0, 1))


def test_a_camera_that_moves_between_start_and_end_is_undone_by_the_fiducials(without_camera):
    """With a calibrated camera, see `test_shake`."""
    still = without_camera.observations("rig")
    moved = tracked([*images()[:3], *(shifted(image, 3, 2) for image in images()[3:])], camera=None)
    observations = moved.observations("rig")
    np.testing.assert_allclose(observations.displacements, still.displacements, rtol=0, atol=0.01)  # of 0.38
    assert any("moved by 3.6" in warning and "they undo" in warning for warning in moved.warnings)


def test_a_camera_that_loses_all_fiducials_is_refused():
    with pytest.raises(UserError, match="no fiducial is seen in the end where it was"):
        tracked([*images()[:3], *(shifted(image, 25, 0) for image in images()[3:])])


def test_a_patch_a_little_lighter_than_the_wall_is_no_marker():
    _, truth = recording().frame(0)
    x, y = truth.pixels[4]
    patched = [image.copy() for image in images()]
    for image in patched[:3]:
        lighter = image[round(y), round(x) - 13] + 10.0
        cv2.circle(image, (round(16 * x), round(16 * y)), 9 * 16, lighter.tolist(), -1, cv2.LINE_AA, shift=4)
    observations = tracked(patched).observations("rig")
    np.testing.assert_array_equal(np.nonzero(~observations.visible)[0], [4])  # its fit is 0.25 mm off
    assert error_of(observations) < 0.015


def test_a_camera_may_be_turned_if_the_fiducials_are_seen():
    tracking = tracked([np.rot90(image) for image in images()], camera=None)
    assert error_of(tracking.observations("rig")) < 0.2  # the lens is not undone
    assert any("no camera" in warning for warning in tracking.warnings)


def test_without_a_camera_the_residual_of_the_fiducials_is_told(without_camera):
    residual = without_camera.plane.residual
    assert residual > 0.1
    assert any(f"{residual:.3f} mm" in warning for warning in without_camera.warnings)


def test_grey_images_do_as_well():
    observations = tracked([cv2.cvtColor(image, cv2.COLOR_BGR2GRAY) for image in images()]).observations(
        "rig"
    )
    assert error_of(observations) < 0.01


def test_covariances_of_the_camera_are_in_the_standard_deviations(tracking):
    sure = tracking.observations("rig").standard_deviations
    wide = np.diag(np.square([40.0, 40.0, 5.0, 5.0, 0.05, 0.05, 1e-3, 1e-3, 0.0]))
    known = replace(CAMERA, covariance=tuple(map(tuple, wide.tolist())))
    unsure = tracked(images(), camera=known).observations("rig").standard_deviations
    assert (unsure > sure).all()


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


def test_two_pictures_are_enough():
    observations = tracked([images()[0], images()[-1]]).observations("rig")
    assert error_of(observations) < 0.015


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
