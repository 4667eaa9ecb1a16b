"""Markers in another plane than assumed: the message names the plane, its height and the remedy."""

from dataclasses import replace

import numpy as np
import pytest

from geometry.errors import UserError
from tests.vision.end_to_end.test_track import (
    CAMERA,
    MARKERS,
    POSE,
    PRESSED,
    RED,
    SCENE,
    SHARES,
    SPACE,
    film,
    middles,
    seen,
)
from tests.vision.tracking.listed_discs import ListedDiscs
from vision.discs.colour import DARK
from vision.tracking.scene import FilmedScene
from vision.tracking.tracker import track

COVARIANCE = tuple(map(tuple, (1e-8 * np.eye(9)).tolist()))


def at_height(listed: ListedDiscs, height: float, *, moved: float = 0.0):
    """A film of markers that are so much nearer to the camera than the fiducials, mm."""
    scale = CAMERA.fx / POSE.translation[2]
    nearer = POSE.translation[2] / (POSE.translation[2] - height)
    return film(
        [
            listed.picture(
                (RED, seen(MARKERS + share * PRESSED + moved, POSE, height), 0.8 * scale * nearer, 100.0),
                (DARK, middles(SPACE.points, 2.0, POSE), 2 * scale, 100.0),
            )
            for share in SHARES
        ]
    )


def sheet(height: float) -> FilmedScene:
    return replace(SCENE, workspace=SPACE.model_copy(update={"marker_plane": height}))


@pytest.mark.parametrize("height", [12.0, 20.0])
@pytest.mark.parametrize("method", ["precise", "hough"])
def test_a_sheet_below_the_markers_needs_a_camera(listed: ListedDiscs, height, method) -> None:
    said = (
        rf"0 of 7 markers .*; the workspace has them {height:g} mm nearer to the camera .*: give its file, or"
    )
    with pytest.raises(UserError, match=said):
        track(at_height(listed, height), replace(sheet(height), camera=None, method=method))


@pytest.mark.parametrize("height", [12.0, 20.0, -15.0])
def test_a_forgotten_sheet_is_guessed_with_its_height(listed: ListedDiscs, height) -> None:
    with pytest.raises(UserError, match=r"give a workspace with that marker_plane") as error:
        track(at_height(listed, height), SCENE)
    side = "nearer to" if height > 0 else "farther from"
    assert f"they seem to be {side} the camera than the fiducials by about {height:.0f} mm" in str(
        error.value
    )
    with pytest.raises(
        UserError, match=r"times as far apart: .* give the camera's file and a workspace with"
    ):
        track(at_height(listed, height), replace(SCENE, camera=None))


def test_a_wrong_height_is_corrected(listed: ListedDiscs) -> None:
    said = r"nearer to the camera than the fiducials by about 25 mm, not 5 mm above them"
    with pytest.raises(UserError, match=said):
        track(at_height(listed, 25.0), sheet(5.0))


def test_markers_beside_their_places_are_no_question_of_the_plane(listed: ListedDiscs) -> None:
    with pytest.raises(UserError, match="discs lie as the markers do, but beside them"):
        track(at_height(listed, 0.0, moved=11.0), SCENE)


def test_without_markers_colour_and_plane_are_named(listed: ListedDiscs) -> None:
    with pytest.raises(
        UserError, match=r"markers' colour; if markers are nearer to the camera .* give the camera"
    ):
        track(at_height(listed, 0.0), replace(SCENE, colour=replace(RED, low=(0.0, 0.0, 0.0))))


def test_hough_takes_the_sheet_with_a_camera(listed: ListedDiscs) -> None:
    tracking = track(at_height(listed, 20.0), replace(sheet(20.0), method="hough"))
    np.testing.assert_allclose(tracking.observations("a film").displacements, PRESSED, atol=0.15)


@pytest.mark.parametrize("zoom", [1.1, 0.85])
def test_another_zoom_than_that_of_the_calibration_is_named_with_its_size(listed: ListedDiscs, zoom) -> None:
    focal = CAMERA.fx / zoom
    camera = replace(CAMERA, fx=focal, fy=focal, covariance=COVARIANCE)
    size = "longer" if zoom > 1 else "shorter"
    try:
        (said,) = track(at_height(listed, 20.0), replace(sheet(20.0), camera=camera)).warnings
    except UserError as error:  # so much that no marker is where it is expected
        said = str(error)
        assert zoom < 0.9
    assert "zoom and focus" in said
    words = said.split("a focal length ")[1].split()
    assert float(words[0].strip("%")) == pytest.approx(100 * abs(zoom - 1), abs=3)
    assert words[1] == size
