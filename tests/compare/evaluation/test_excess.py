"""The picture of the excess energy and the certificate in words."""

from dataclasses import replace

import numpy as np
import pytest

from pinnray.comparison.evaluation.certificate import Certificate, Region
from pinnray.comparison.evaluation.certification import with_certificate
from pinnray.comparison.evaluation.evaluation import Evaluation
from pinnray.comparison.figures.fields import DECADES, draw_excess, excess_scale
from pinnray.comparison.report.text import certificate_sentences
from pinnray.geometry.mesh.triangle_mesh import TriangleMesh
from tests.compare.evaluation.test_certificate_limits import GOOD


@pytest.fixture
def certificate(mesh: TriangleMesh) -> Certificate:
    """An excess of 1 % of the energy, most of it at the corners."""
    return replace(
        GOOD,
        violation=0.0,
        missed=0.0,
        weak_residual=0.05,
        base=0.0,
        load=np.array([np.nan, 2e-6]),
        regions={"corners": Region(0.1, 0.9, 0.001, 0.02), "walls": Region(0.9, 0.1, 0.002, 0.01)},
        density=np.linspace(0.0, 1.0, len(mesh.triangles)),
    )


def words(evaluation: Evaluation, certificate: Certificate) -> str:
    return certificate_sentences(with_certificate(evaluation, certificate)).replace("\N{NO-BREAK SPACE}", " ")


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        ({"excess": 0.4}, "pinn-std (not converged) is not to be relied on"),
        ({"excess": 0.0, "weak_residual": 0.0}, "is the finite-element solution itself"),
        ({"missed": 0.1}, "It reports 2.50 % less energy than that least: its quadrature misses energy."),
        ({"missed": 0.01}, "0.250 % less energy than that least: it is nearer to the exact solution than"),
    ],
    ids=["too much energy", "fem", "much less energy", "a little less energy"],
)
def test_words_for_other_results(pinn, certificate, changes, expected):
    assert expected in words(pinn, replace(certificate, **changes))


def test_one_scale_for_all_that_ends_at_the_larger_excess(mesh):
    flat = np.ones(len(mesh.triangles))
    scale = excess_scale(mesh, [flat, 5 * flat])
    assert (scale.low, scale.high) == (pytest.approx(5 / 10**DECADES), 5.0)
    low, middle, high = scale.paint(scale.low * np.array([1.0, 10 ** (DECADES / 2), 10.0**DECADES]))
    np.testing.assert_allclose(middle, scale.colours(0.5, bytes=True)[:3], atol=1)
    assert (low.tolist(), high.tolist()) == ([68, 1, 84], [253, 231, 36])  # the ends of viridis


def test_without_an_excess_there_is_no_picture(fem, certificate, compared):
    exact = with_certificate(fem, replace(certificate, excess=0.0))
    assert draw_excess(compared(fem, exact)) is None
    assert draw_excess(compared(fem, with_certificate(fem, certificate))) is not None
