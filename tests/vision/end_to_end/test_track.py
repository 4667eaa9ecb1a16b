"""From frames to displacements on lists of discs: means at rest, moved cameras, orientation, warnings."""

import re
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from pinnray.runtime.arrays import FloatArray
from pinnray.vision.calibration.camera import Camera, Pose
from pinnray.vision.discs.colour import DARK, ColourRange
from pinnray.vision.frames.frame import CapturedImage, Frames, Image
from pinnray.vision.rig.virtual_camera import viewing_pose
from pinnray.vision.tracking.rest_detection import RestIntervals
from pinnray.vision.tracking.scene import FilmedScene
from pinnray.vision.tracking.tracker import track
from pinnray.vision.tracking.workspace import Workspace
from tests.fingers import beam
from tests.vision.tracking.listed_discs import NOISE, ListedDiscs, middles, seen

FINGER, RED = beam(), ColourRange((20.0, 40.0, 20.0), (80.0, 90.0, 80.0))
MARKERS = FINGER.markers
SPACE = Workspace(
    fiducials=((-12.0, 12.0), (20.0, 14.0), (112.0, 13.0), (-10.0, -22.0), (45.0, -20.0), (108.0, -24.0))
)
CAMERA = Camera(1280, 720, 1100.0, 1100.0, 650.0, 350.0)
POSE = viewing_pose(CAMERA, SPACE, tilt=5.0)
NUDGED = Pose(POSE.rotation + np.array([3e-4, -2e-4, 5e-4]), POSE.translation + np.array([0.1, -0.1, 0.1]))
SCENE = FilmedScene(FINGER, SPACE, CAMERA, RED)
PRESSED = -4.0 * np.column_stack([0.2 * (MARKERS[:, 0] / 90) ** 2, (MARKERS[:, 0] / 90) ** 2])
SHARES = (0.0, 0.0, 0.0, 0.3, 0.7, 1.0, 1.0, 1.0)
"""Of the displacement, in the frames of a film."""


def picture(
    listed: ListedDiscs,
    places: FloatArray,
    pose: Pose = POSE,
    lost: Sequence[int] = (),
    hidden: Sequence[int] = (),
    height: float = 0.0,
) -> Image:
    """Markers at places, nearer by `height`, but for the lost ones; fiducials but for the hidden ones."""
    markers, corners = np.delete(places, lost, axis=0), np.delete(SPACE.points, hidden, axis=0)
    scale, nearer = CAMERA.fx / POSE.translation[2], 1 / (1 - height / POSE.translation[2])
    return listed.picture(
        (RED, middles(markers, 0.8, CAMERA, pose, height), 0.8 * scale * nearer, 100.0),
        (DARK, middles(corners, 2.0, CAMERA, pose), 2 * scale, 100.0),
    )


def film(pictures: Sequence[Image], *, live: bool = False, simulated: bool = False, stop: int = 99) -> Frames:
    """Pictures ten a second; a person stops it after some of them."""

    def shots() -> Iterator[CapturedImage]:
        for number, image in enumerate(pictures):
            if number == stop:
                raise KeyboardInterrupt
            yield CapturedImage(image, 0.1 * number, f"picture {number}", simulated)

    return Frames("the film", shots(), rate=10.0, count=None if live else len(pictures))


def pressed(listed: ListedDiscs, **end: Any) -> list[Image]:
    """The frames of a film; those at the end with changes."""
    return [
        picture(listed, MARKERS + share * PRESSED, **(end if number >= 5 else {}))
        for number, share in enumerate(SHARES)
    ]


def test_displacements_are_differences_of_the_means_at_rest(listed: ListedDiscs) -> None:
    watched: list[tuple[float, FloatArray]] = []
    tracking = track(
        film(pressed(listed)), SCENE, lambda frame, found: watched.append((frame.time, found.places))
    )
    assert tracking.rest == RestIntervals(range(3), range(5, 8))
    assert tracking.times == pytest.approx(0.1 * np.arange(8))
    assert tracking.pixels.shape == (8, 7, 2)
    assert tracking.covariances.shape == (8, 7, 2, 2)
    np.testing.assert_allclose(tracking.covariances[3, 2], NOISE**2 * np.eye(2))
    np.testing.assert_allclose(
        tracking.positions, MARKERS + np.array(SHARES)[:, None, None] * PRESSED, atol=1e-3
    )
    observed = tracking.observations("a film")
    np.testing.assert_allclose(observed.displacements, PRESSED, atol=1e-3)
    np.testing.assert_allclose(observed.points, MARKERS, atol=1e-3)
    assert [time for time, _ in watched] == tracking.times.tolist()
    np.testing.assert_allclose([places for _, places in watched], tracking.positions, atol=0.05)
    assert tracking.final_plane is None
    assert tracking.method == "precise"
    assert (tracking.design, tracking.simulated) == (FINGER, False)
    np.testing.assert_array_equal(tracking.expected, MARKERS)
    assert len(tracking.warnings) == 1
    assert "the camera file has no covariance" in tracking.warnings[0]


def test_markers_at_the_fiducials_height_are_told_from_those_nearer_by_their_scale(listed) -> None:
    high = Workspace(fiducials=SPACE.fiducials, marker_plane=0.5)
    known = replace(CAMERA, covariance=tuple(map(tuple, (1e-6 * np.eye(9)).tolist())))
    (said,) = track(film(pressed(listed)), replace(SCENE, camera=known, workspace=high)).warnings
    assert "0.40% smaller in the film than in the drawing" in said


def test_hough_takes_the_sheet_with_a_camera(listed: ListedDiscs) -> None:
    high = SPACE.model_copy(update={"marker_plane": 20.0})
    pictures = [picture(listed, MARKERS + share * PRESSED, height=20.0) for share in SHARES]
    tracking = track(film(pictures), replace(SCENE, workspace=high, method="hough"))
    np.testing.assert_allclose(tracking.observations("a film").displacements, PRESSED, atol=0.15)


def test_a_person_ends_a_camera_and_breaks_off_a_film(listed: ListedDiscs) -> None:
    pictures = [*pressed(listed), picture(listed, MARKERS)]
    tracking = track(film(pictures, live=True, stop=8), SCENE)
    assert len(tracking.times) == 8
    np.testing.assert_allclose(tracking.observations("a film").displacements, PRESSED, atol=2e-3)
    with pytest.raises(KeyboardInterrupt):
        track(film(pictures, stop=8), SCENE)


def test_a_camera_that_moved_is_undone_with_a_warning(listed: ListedDiscs) -> None:
    tracking = track(film(pressed(listed, pose=NUDGED)), SCENE)
    np.testing.assert_allclose(tracking.observations("a film").displacements, PRESSED, atol=5e-3)
    assert tracking.final_plane is not None
    np.testing.assert_allclose(tracking.final_plane.pixels(MARKERS), seen(MARKERS, CAMERA, NUDGED), atol=0.02)
    np.testing.assert_allclose(tracking.plane.pixels(MARKERS), seen(MARKERS, CAMERA, POSE), atol=0.02)
    shift = np.median(
        np.linalg.norm(seen(SPACE.points, CAMERA, NUDGED) - seen(SPACE.points, CAMERA, POSE), axis=1)
    )
    assert shift > 0.5
    assert f"moved by {shift:.2f} pixels" in tracking.warnings[1]


def test_a_motion_that_too_few_fiducials_show_is_told(listed: ListedDiscs) -> None:
    tracking = track(film(pressed(listed, pose=NUDGED, hidden=(0, 2, 4))), SCENE)
    assert tracking.final_plane is None
    assert "3 of 6 fiducials" in tracking.warnings[1]
    assert "the camera was not at rest" in tracking.warnings[2]


def test_what_a_bumped_fiducial_leaves_of_a_motion_is_told(listed: ListedDiscs) -> None:
    pictures = pressed(listed, pose=NUDGED)
    for number in (5, 6, 7):
        for _, discs in listed.pictures[number]:
            if len(discs.radii) == len(SPACE.points):
                discs.centres[0] += 3.0
    said = " ".join(track(film(pictures), SCENE).warnings)
    assert re.search(r"the camera was not at rest, which they undo but for 0\.\d+ mm", said)


def test_a_zoom_is_not_told_as_a_camera_that_moved(listed: ListedDiscs) -> None:
    pictures = pressed(listed)
    for number in (5, 6, 7):
        for _, discs in listed.pictures[number]:
            discs.centres[:] = discs.centres * 1.01
    said = " ".join(track(film(pictures), SCENE).warnings)
    assert "% larger at the end than at the start: the zoom changed" in said
    assert "the camera was not at rest" not in said


@pytest.mark.parametrize(("shift", "told"), [(0.28, False), (0.32, True)])
def test_a_shift_of_three_tenths_of_a_pixel_is_worth_a_warning(listed, shift, told):
    pictures = pressed(listed)
    for number in (5, 6, 7):
        for _, discs in listed.pictures[number]:
            discs.centres[:] += (shift, 0)
    said = " ".join(track(film(pictures), SCENE).warnings)
    assert ("the camera was not at rest" in said) == told


@pytest.mark.parametrize(("off", "told"), [(0.48, False), (0.52, True)])
def test_markers_half_a_millimetre_from_the_design_are_worth_a_warning(listed, off, told):
    places = MARKERS + off * np.array([0.6, -0.8])
    tracking = track(film([picture(listed, places + share * PRESSED) for share in SHARES]), SCENE)
    assert any(f"{off:.2f} mm (rms) from where" in said for said in tracking.warnings) == told
    # Beside its outline or not, the finger is where it is drawn once it is aligned.
    np.testing.assert_allclose(tracking.observations("a film").points, MARKERS, atol=1e-3)


def test_a_sheet_at_another_scale_is_found_and_undone(listed: ListedDiscs) -> None:
    """Printed at 99 %, 0.4 mm beside the finger: displacements were off by a hundredth, and nothing said."""
    pictures = [picture(listed, 1.01 * (MARKERS + share * PRESSED) + [0.3, -0.2]) for share in SHARES]
    tracking = track(film(pictures), SCENE)
    observed = tracking.observations("a film")
    np.testing.assert_allclose(observed.points, MARKERS, atol=1e-3)
    np.testing.assert_allclose(observed.displacements, PRESSED, atol=2e-3)
    assert observed.pressed.fixed
    assert observed.drawn.fixed
    assert any("1.00% larger in the film than in the drawing" in said for said in tracking.warnings)
    assert tracking.plane.pixels(MARKERS) == pytest.approx(tracking.initial.centres, abs=0.05)


def test_markers_that_are_not_where_they_are_drawn_leave_the_frame_in_doubt(listed: ListedDiscs) -> None:
    """Painted by hand: each is where it was seen, and the drawing's frame is known as well as their mean."""
    random = np.random.default_rng(3)
    painted = MARKERS + random.normal(0, 0.25, MARKERS.shape)
    tracking = track(film([picture(listed, painted + share * PRESSED) for share in SHARES]), SCENE)
    observed = tracking.observations("a film")
    assert tracking.alignment is not None
    assert tracking.alignment.after > 0.2
    assert 0.05 < observed.drawn.shift < 0.2
    assert 0.001 < observed.drawn.scale < 0.005
    off = (observed.points - painted).mean(axis=0)
    assert np.abs(off).max() < 3 * observed.drawn.shift


def test_markers_that_one_end_does_not_show_are_named(listed: ListedDiscs) -> None:
    tracking = track(film(pressed(listed, lost=(1, 5), hidden=(2,))), SCENE)
    assert "marker 2, 6" in tracking.warnings[-1]
    assert np.nonzero(~tracking.visible)[0].tolist() == [1, 5]
    assert np.isnan(tracking.pixels[6, 1]).all()


@pytest.mark.parametrize(("by_film", "by_space"), [(True, False), (False, True), (True, True)])
def test_what_is_simulated_is_so_by_the_film_or_the_workspace(listed, by_film, by_space) -> None:
    space = Workspace(fiducials=SPACE.fiducials, simulated=by_space)
    tracking = track(film(pressed(listed), simulated=by_film), replace(SCENE, workspace=space))
    assert tracking.simulated
    assert any("simulated" in line for line in tracking.warnings) == (not by_film)
