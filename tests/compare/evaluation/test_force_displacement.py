"""Force over displacement: the curve, its file and its picture."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from pinnray.comparison.evaluation.evaluation import Evaluation
from pinnray.comparison.evaluation.force_curves import ForceCurve, force_curves, write_force_displacement
from pinnray.comparison.figures.force_charts import draw_force_displacement
from pinnray.runtime.figure import MEASURED
from pinnray.solvers.problem import Load
from pinnray.solvers.solution import Estimated, IdentifiedForce
from tests.compare.figures.drawn_pages import page_of
from tests.compare.tables import rows_of

STEPS = np.array([0.0, 0.5, 1.0])


@pytest.fixture
def followed(evaluate: Callable[..., Evaluation]) -> Evaluation:
    """A solver that followed the load and stiffened."""
    record = {"load_fraction": STEPS, "reaction_x": 0.2 * STEPS, "reaction_y": -3.0 * STEPS**2}
    return replace(evaluate("fem-nonlinear", history=record), law="neo-hookean")


def test_force_is_the_component_along_the_stroke(followed):
    oblique = ForceCurve.of(followed, Load(displacement=(6.0, -8.0)))
    np.testing.assert_allclose(oblique.stroke, 10.0 * STEPS)
    np.testing.assert_allclose(oblique.force, 0.6 * 0.2 * STEPS + 0.8 * 3.0 * STEPS**2)
    np.testing.assert_allclose(oblique.tangential_force, 0.8 * 0.2 * STEPS - 0.6 * 3.0 * STEPS**2)


def test_linear_solvers_are_straight_lines_beside_one_that_follows_the_load(followed, fem, evaluate):
    end_only = replace(evaluate("pinn-std"), law="neo-hookean")
    curves = force_curves([fem, followed, end_only], Load())
    assert [curve.evaluation.solver for curve in curves] == ["fem", "fem-nonlinear", "pinn-std"]
    np.testing.assert_allclose([curves[0].stroke, curves[0].force], [[0, 10], [0, 0.5]])
    np.testing.assert_allclose([curves[2].stroke, curves[2].force], [[10], [0.5]])


def test_without_a_solver_that_follows_the_load_there_is_no_curve(fem, pinn):
    assert force_curves([fem, pinn], Load()) == []


def test_a_solver_that_was_given_markers_has_no_curve(followed, fem):
    curves = force_curves([replace(fem, in_sample=True), followed], Load())
    assert [curve.evaluation.solver for curve in curves] == ["fem-nonlinear"]


def test_file_has_the_forces_for_the_depth(followed, tmp_path):
    load = Load(kind="patch", displacement=(None, -4.0))
    path = tmp_path / "force_displacement.csv"
    write_force_displacement(path, force_curves([followed], load), depth=20.0)
    rows = rows_of(path)
    assert list(rows[-1].values()) == ["fem-nonlinear", "neo-hookean", "1", "1.0", "4.0", "60.0", "4.0"]
    assert all(name.split("_")[-1] in ("solver", "law", "converged", "1", "mm", "N") for name in rows[0])


def test_picture_has_both_scales_and_the_end_of_every_curve(followed, fem):
    stopped = replace(followed, converged=False)
    page = page_of(draw_force_displacement(force_curves([fem, stopped], Load()), depth=20.0))
    assert "fem, 10.0 N" in page.text
    assert "fem-nonlinear (not converged), 60.0 N" in page.text
    assert "force for 20 mm of depth, N" in page.text
    assert "truth" not in page.text
    left, right = page.figure.axes[0], page.figure.axes[0].child_axes[0]
    assert right.get_ylim() == pytest.approx([20 * end for end in left.get_ylim()])


def test_the_force_on_the_simulated_finger_is_a_cross(followed, fem):
    (curve,) = force_curves([followed], Load())
    page = page_of(draw_force_displacement([curve], depth=20.0, truth=ForceCurve.of(fem, Load())))
    assert "truth, simulated, 10.0 N" in page.text
    (cross,) = [line for line in page.figure.axes[0].lines if line.get_marker() == "x"]
    assert (cross.get_xdata(), cross.get_ydata()) == (pytest.approx([10.0]), pytest.approx([0.5]))


def test_the_whole_curve_of_the_simulated_finger_and_an_identified_force_are_drawn(followed, fem):
    force = IdentifiedForce(Estimated(0.6, 0.5, 0.8), Estimated(0.3, 0.2, 0.4), None)
    found = replace(fem, solver="fem-id", in_sample=True, identified=force)
    truth = replace(followed, solver="truth")
    curves = force_curves([fem, followed], Load())
    page = page_of(
        draw_force_displacement(curves, depth=20.0, truth=ForceCurve.of(truth, Load()), identified=[found])
    )
    axes = page.figure.axes[0]
    pink = [line for line in axes.lines if line.get_color() == MEASURED and line.get_marker() == "None"]
    np.testing.assert_allclose(pink[0].get_ydata(), 3.0 * STEPS**2)
    assert "fem-id, 12.0 N, identified" in page.text
    (interval,) = axes.containers[0].lines[2]  # type: ignore[attr-defined]
    np.testing.assert_allclose(interval.get_segments()[0][:, 1], [0.5, 0.8])
    assert (page.cut_off(), page.overlaps()) == ([], [])
