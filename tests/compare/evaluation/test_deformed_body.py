"""Bodies that are not finite, turned inside out, or go through themselves."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from pinnray.comparison.evaluation.deformed_body import DeformedBody, with_body_checks
from pinnray.comparison.evaluation.evaluation import Evaluation
from pinnray.comparison.report.html_report import report_html
from pinnray.geometry.mesh.triangle_mesh import TriangleMesh
from pinnray.runtime.arrays import FloatArray

SELF = "THE BODY GOES THROUGH ITSELF"


def rolled(points: FloatArray, turns: float) -> FloatArray:
    """Displacement of a strip of 12 mm that is bent to a circle's arc of so many turns, shape (n, 2), mm."""
    x, y = points.T
    radius = 12 / (2 * np.pi * turns)
    angle = x / radius
    return np.stack([(radius - y) * np.sin(angle) - x, radius - (radius - y) * np.cos(angle) - y], axis=1)


def moved(
    evaluation: Evaluation, mesh: TriangleMesh, displacement: Callable[[FloatArray], FloatArray]
) -> Evaluation:
    middles = mesh.points[mesh.edges].mean(axis=1)
    return replace(
        evaluation, node_displacement=displacement(mesh.points), edge_displacement=displacement(middles)
    )


@pytest.mark.parametrize(
    ("turns", "through"),
    [(0.0001, False), (0.9, False), (1.2, True)],  # straight; a ring with a gap; its end lies in its start
)
def test_a_strip_rolled_by_more_than_a_turn_goes_through_itself(turns, through, mesh):
    assert bool(len(DeformedBody(mesh).crossings(rolled(mesh.points, turns)))) is through


def test_places_of_crossings_are_where_the_outline_meets(mesh):
    """A node of the upper face is pushed through the lower one, y = -4: its edges of 0.5 mm cross it."""
    pushed = np.zeros_like(mesh.points)
    pushed[np.isclose(mesh.points, [6.0, 0.0]).all(axis=1), 1] = -6.0
    places = DeformedBody(mesh).crossings(pushed)
    np.testing.assert_allclose(places, [[6 - 0.5 / 3, -4.0], [6 + 0.5 / 3, -4.0]], rtol=1e-12)


def test_a_slit_that_is_closed_at_rest_is_no_crossing():
    """Two squares whose facing sides lie on each other but share no node but one."""
    points = np.array([[0, 0], [1, 0], [1, 1], [0, 1], [2, 0], [2, 1], [1, 1]], dtype=float)
    triangles = np.array([[0, 1, 2], [0, 2, 3], [1, 4, 5], [1, 5, 6]])
    slit = TriangleMesh(
        points=points,
        triangles=triangles,
        boundaries={name: np.array([[3, 0]]) for name in ("base", "front", "contact")},
        marker_nodes=np.array([0]),
        contact_node=0,
    )
    assert len(DeformedBody(slit).crossings(np.zeros_like(points))) == 0


@pytest.mark.parametrize(
    ("law", "converged"),
    [
        ("linear", True),  # its equations are those of the body at rest
        ("neo-hookean", False),  # its energy is infinite there
    ],
)
def test_a_body_inside_out_is_said_and_is_no_result_of_finite_strain(law, converged, fem, mesh):
    mirrored = moved(replace(fem, law=law), mesh, lambda points: -2 * points * [0, 1])
    (checked,), remarks = with_body_checks([mirrored], mesh)
    assert "TURNED INSIDE OUT in 384 of 384 triangles" in checked.message
    assert checked.converged is converged
    assert [remark.partition(";")[0] for remark in remarks] == ["fem: TURNED INSIDE OUT"]


def test_one_quarter_of_a_quadratic_triangle_can_be_inside_out(fem, mesh):
    bent = fem.edge_displacement.copy()
    inner = np.flatnonzero(
        np.bincount(mesh.edges.ravel(), minlength=len(mesh.points))[mesh.edges].min(axis=1) >= 6
    )[0]
    bent[inner] += [0.0, 0.6]  # the middle of an edge of 0.5 mm
    assert DeformedBody(mesh).inside_out(np.concatenate([fem.node_displacement, bent])).any()
    assert not DeformedBody(mesh).inside_out(np.zeros((len(mesh.points) + len(mesh.edges), 2))).any()


@pytest.mark.parametrize("field", ["node_displacement", "edge_displacement", "marker_displacement", "stress"])
@pytest.mark.parametrize("law", ["linear", "neo-hookean"])
@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_a_field_that_is_not_finite_is_no_result(field, law, value, fem, mesh):
    broken = getattr(fem, field).copy()
    broken[-1] = value
    (checked,), remarks = with_body_checks([replace(fem, law=law, **{field: broken})], mesh)
    assert not checked.converged
    assert "not finite everywhere" in checked.message
    assert len(remarks) == 1


def test_the_warning_names_all_and_the_simulated_finger(fem, pinn, mesh, compared):
    through = [moved(each, mesh, lambda points: rolled(points, 1.2)) for each in (fem, pinn)]
    checked, remarks = with_body_checks(through, mesh, truth=through[0])
    assert [each.converged for each in checked] == [True, True]  # each solved what it was asked
    named = f"fem, pinn-std, the simulated finger: {SELF}"
    assert [remark.startswith(named) for remark in remarks].count(True) == 1
    comparison = compared(*checked, warnings=remarks)
    assert list(comparison.scores.warnings) == remarks
    assert f"<li>{named};" in report_html(comparison, [], {})
    small = moved(fem, mesh, lambda points: 0.01 * points)
    assert with_body_checks([small], mesh, truth=small) == ([small], [])
