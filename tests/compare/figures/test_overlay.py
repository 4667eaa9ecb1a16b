"""The picture of the deformed finger."""

from dataclasses import replace

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.patches import Circle
from matplotlib.quiver import Quiver
from matplotlib.text import Text

from pinnray.comparison.evaluation.evaluation import Evaluation
from pinnray.comparison.figures.overlay import draw_overlay
from pinnray.geometry.observations import Observations
from pinnray.geometry.picture_frame import Homography, Pictures
from pinnray.solvers.problem import Load
from tests.compare.conftest import BendingField, closed_form
from tests.compare.figures.drawn_pages import page_of


@pytest.mark.slow
@pytest.mark.parametrize("turned", [False, True], ids=["fixed", "the picture's frame was found"])
def test_crosses_are_at_the_observed_points_even_if_they_are_not_the_meshs_markers(
    mesh, compared, monkeypatch, turned
):
    """And on the body: the found frame of the pictures is taken off what was observed, and said."""
    points = np.array([[2.3, -1.1], [7.7, -3.2]])
    solution = closed_form(mesh, BendingField(1.0))
    pressed = Homography(points.mean(axis=0), np.array([3.0, 0.1, 0.2, 0.01, 0.0, 0.0]))
    if turned:
        still = Homography(points.mean(axis=0), np.zeros(6))
        solution = replace(solution, pictures=Pictures(pressed, still))
    field = solution.displacement(points)
    observations = Observations(
        points=points,
        displacements=pressed.moved(points + field) - points if turned else field,
        standard_deviations=np.zeros((2, 2)),
        visible=np.ones(2, dtype=bool),
        source="a test",
        simulated=True,
        marker_radius=0.8,
    )
    drawn: dict[str, list[np.ndarray]] = {"x": [], "o": []}
    plot = Axes.plot

    def watched(axes: Axes, *arguments: object, **options: object) -> object:
        if isinstance(arguments[-1], str) and arguments[-1] in drawn:
            drawn[arguments[-1]].append(np.column_stack(arguments[:2]))
        return plot(axes, *arguments, **options)

    monkeypatch.setattr(Axes, "plot", watched)
    evaluation = Evaluation.of(solution, mesh, points)
    page = page_of(draw_overlay(compared(evaluation, observations=observations)))
    x, y = points.T
    expected = points + np.stack([0.01 * y**2, -0.02 * x**2], axis=1)
    assert len(drawn["x"]) == len(drawn["o"]) > 0
    for places in (*drawn["x"], *drawn["o"]):
        np.testing.assert_allclose(places, expected, rtol=1e-12)
    said = any("the frame it found" in text.get_text() for text in page.figure.findobj(Text))
    assert said == turned


def test_a_cylinder_is_drawn_where_it_ends(mesh, fem, compared):
    load = Load(kind="cylinder", displacement=(1.0, -3.0), radius=2.0)
    page = page_of(draw_overlay(compared(fem, load=load)))
    (circle,) = [patch for patch in page.figure.axes[0].patches if isinstance(patch, Circle)]
    contact = mesh.points[mesh.boundary("contact").ravel(), 0]
    middle = (contact.min() + contact.max()) / 2
    np.testing.assert_allclose(circle.center, (middle + 1.0, -1.0), atol=1e-12)
    assert circle.radius == 2.0
    assert "cylinder’s motion" in page.text


def test_errors_are_magnified_arrows_from_where_the_markers_were_seen(fem, pinn, compared, observations):
    """Errors of 0.3 and -0.4 mm, and of markers that were held out where the solver was given them."""
    left_out = observations.displacements + np.array([0.0, 0.05])
    given = replace(pinn, in_sample=True, left_out=left_out)
    page = page_of(draw_overlay(compared(fem, given)))
    for axes, error in zip(page.figure.axes, [(-0.3, 0.4), (0.0, 0.05)], strict=False):
        (arrows,) = [each for each in axes.collections if isinstance(each, Quiver)]
        factor = float(axes.get_title(loc="right").removeprefix("×"))
        seen = observations.points + observations.displacements
        np.testing.assert_allclose(arrows.get_offsets(), seen)
        np.testing.assert_allclose(np.stack([arrows.U, arrows.V], axis=1), factor * np.tile(error, (3, 1)))
        longest = factor * np.hypot(*error)
        assert 0.035 < longest / np.ptp(axes.get_xlim()) <= 0.1
