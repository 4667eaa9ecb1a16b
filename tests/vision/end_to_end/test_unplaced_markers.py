"""Markers in another plane than assumed: the message names the plane, its height and the remedy."""

from dataclasses import replace

import numpy as np
import pytest

from pinnray.runtime.errors import UserError
from pinnray.vision.tracking.scene import FilmedScene
from pinnray.vision.tracking.tracker import track
from tests.vision.end_to_end.test_track import (
    CAMERA,
    MARKERS,
    PRESSED,
    RED,
    SCENE,
    SHARES,
    SPACE,
    film,
    picture,
)
from tests.vision.tracking.listed_discs import ListedDiscs

COVARIANCE = tuple(map(tuple, (1e-8 * np.eye(9)).tolist()))


def at_height(listed: ListedDiscs, height: float, *, moved: float = 0.0):
    """A film of markers that are so much nearer to the camera than the fiducials, mm."""
    return film([picture(listed, MARKERS + share * PRESSED + moved, height=height) for share in SHARES])


def sheet(height: float) -> FilmedScene:
    return replace(SCENE, workspace=SPACE.model_copy(update={"marker_plane": height}))


@pytest.mark.parametrize(
    ("height", "moved", "scene", "said"),
    [
        # the workspace has the sheet below the markers, and no camera is known
        (12.0, 0.0, replace(sheet(12.0), camera=None), "12 mm nearer to the camera"),
        # the sheet was forgotten
        (12.0, 0.0, SCENE, "nearer to the camera than the fiducials by about 12 mm"),
        (-15.0, 0.0, SCENE, "farther from the camera than the fiducials by about -15 mm"),
        (20.0, 0.0, replace(SCENE, camera=None), "times as far apart"),
        (25.0, 0.0, sheet(5.0), "by about 25 mm, not 5 mm above them"),
        (0.0, 11.0, SCENE, "beside them"),
        (0.0, 0.0, replace(SCENE, colour=replace(RED, low=(0.0, 0.0, 0.0))), "colour"),  # no marker is found
    ],
)
def test_markers_that_are_not_where_they_are_expected_are_told_their_plane(
    listed: ListedDiscs, height, moved, scene, said
) -> None:
    with pytest.raises(UserError, match=said):
        track(at_height(listed, height, moved=moved), scene)


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
