"""The fiducials around the finger."""

import json

import numpy as np
import pytest

from geometry.errors import UserError
from geometry.finger.design import Design
from vision.tracking.workspace import Workspace, default_workspace, load_workspace


def test_the_default_layout_surrounds_the_finger_and_leaves_the_indenter_room():
    points = default_workspace(Design()).points
    assert (points.min(axis=0) < (0, -30)).all()
    assert (points.max(axis=0) > (90, 0)).all()
    assert np.abs(points[points[:, 1] > 0, 0] - Design().contact_abscissa).min() > 15


@pytest.mark.parametrize("turn", [np.diag([-1, -1]), np.diag([-1, 1]), np.diag([1, -1])])
def test_the_default_layout_is_no_turned_or_mirrored_copy_of_itself(turn):
    points = default_workspace(Design()).points
    middle = 0.5 * (points.min(axis=0) + points.max(axis=0))
    turned = (points - middle) @ turn + middle
    missed = np.linalg.norm(turned[:, None] - points, axis=2).min(axis=1)
    assert missed.max() > 4


@pytest.mark.parametrize(
    ("fiducials", "said"),
    [
        (((0, 0), (1, 0), (0, 1)), "3 fiducials; at least 4"),  # a homography needs four
        (((0, 0), (1, 0), (2, 0), (3, 0.01)), "on a line"),
        (((0, 0), (1, 0), (0, 1), (1, float("nan"))), "fiducials.3.1"),
    ],
)
def test_a_layout_that_does_not_determine_the_plane_is_refused(fiducials, said):
    with pytest.raises(UserError, match=said):
        Workspace(fiducials=fiducials)


def test_an_unknown_key_is_refused_in_one_line(tmp_path):
    path = tmp_path / "workspace.json"
    path.write_text(json.dumps(default_workspace(Design()).model_dump(mode="json") | {"marker\nplane": 0}))
    with pytest.raises(UserError, match="marker plane") as caught:
        load_workspace(path)
    assert "\n" not in str(caught.value)
