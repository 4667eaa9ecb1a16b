"""The certificate in words."""

from dataclasses import replace

import numpy as np
import pytest

from pinnray.comparison.evaluation.certificate import Certificate, Region
from pinnray.comparison.evaluation.certification import with_certificate
from pinnray.comparison.evaluation.evaluation import Evaluation
from pinnray.comparison.report.text import certificate_sentences
from tests.compare.evaluation.test_certificate_limits import GOOD


@pytest.fixture
def certificate() -> Certificate:
    """An excess of 1 % of the energy, most of it at the corners."""
    return replace(
        GOOD,
        violation=0.0,
        missed=0.0,
        weak_residual=0.05,
        base=0.0,
        load=np.array([np.nan, 2e-6]),
        regions={
            "corners": Region(area=0.1, excess=0.9, rel_l2_displacement=0.001, rel_l2_von_mises=0.02),
            "walls": Region(area=0.9, excess=0.1, rel_l2_displacement=0.002, rel_l2_von_mises=0.01),
        },
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
