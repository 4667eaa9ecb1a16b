"""The predicted outline lies in the film where the film shows the finger."""

from dataclasses import replace

import numpy as np
import pytest
from matplotlib.collections import LineCollection

from pinnray.cli import main
from pinnray.comparison.evaluation.comparison import Results
from pinnray.comparison.evaluation.evaluation import Evaluation
from pinnray.film import predicted_frame
from pinnray.geometry.cache import finger_mesh
from pinnray.geometry.finger.design import Design
from pinnray.geometry.mesh.settings import MeshSettings
from pinnray.geometry.picture_frame import Homography
from pinnray.solvers.fem.linear import FemSolver
from pinnray.solvers.problem import Problem
from pinnray.vision.frames.sources import open_frames
from tests.solvers.conftest import observed_at

pytestmark = pytest.mark.usefixtures("few_elements")

FILM = "--mesh-size 1 --rest 3 --moving 0 --held 3 --noise 0 --tilt 8 --turn 15 --seed 1"


@pytest.mark.slow
def test_the_outline_of_the_right_solver_is_the_edge_of_the_finger(tmp_path, monkeypatch, without_pictures):
    """Where the finger ends the image is half as light as beside; a body off by two pixels fails."""
    figures = []
    draw = predicted_frame.draw_predictions

    def kept(*arguments):
        figures.append(draw(*arguments))
        return figures[0]

    monkeypatch.setattr(predicted_frame, "draw_predictions", kept)
    film = tmp_path / "rig"
    assert main(["rig", "--solver", "fem", *FILM.split(), "--quiet", "--out", str(film)]) == 0
    options = ["--camera", str(film / "camera.json"), "--workspace", str(film / "workspace.json"), "--quiet"]
    options += ["--solvers", "fem", "--mesh-size", "1", "--measurements", str(film / "video.mkv")]
    assert main(["compare", *options, "--out", str(tmp_path / "out")]) == 0
    (axes,) = figures[0].axes
    (outline,) = (each for each in axes.collections if isinstance(each, LineCollection))
    edges = np.array(outline.get_segments())
    with open_frames(film / "video.mkv") as frames:
        *_, last = (frame.image for frame in frames)
    grey = last.mean(axis=2) if last.ndim == 3 else last.astype(float)
    middles, along = edges.mean(axis=1), edges[:, 1] - edges[:, 0]
    across = np.stack([along[:, 1], -along[:, 0]], axis=1) / np.linalg.norm(along, axis=1)[:, None]

    def seen(offset: float) -> np.ndarray:
        x, y = np.rint(middles + offset * across).astype(int).T
        return grey[y, x]

    inside, outside = (np.median(seen(offset)) for offset in (-3.0, 3.0))
    if inside < outside:
        inside, outside = outside, inside
    assert inside - outside > 30
    middle = (seen(0.0) - outside) / (inside - outside)
    assert np.median(middle) == pytest.approx(0.5, abs=0.3)  # an edge is one or two pixels wide


def test_an_outline_is_drawn_in_the_picture_whose_frame_was_found():
    """The nodes are turned, shifted and scaled as the markers were."""
    mesh = finger_mesh(Design(), settings=MeshSettings(size=2.0))
    solution = FemSolver(estimate=False).solve(Problem(mesh))
    known = Evaluation.of(solution, mesh)
    picture = Homography(mesh.markers.mean(axis=0), np.array([2.0, 0.4, -0.3, 0.01, 0.0, 0.0]))
    shown = picture.moved(mesh.markers + known.marker_displacement) - mesh.markers
    observed = observed_at(mesh.markers, shown, 0.01)
    moved = mesh.points + known.node_displacement
    for evaluation, expected in ((known, moved), (replace(known, shown=shown), picture.moved(moved))):
        results = Results(Design(), mesh, observed, [evaluation], evaluation)
        np.testing.assert_allclose(predicted_frame._pictured(evaluation, results), expected, atol=1e-9)
