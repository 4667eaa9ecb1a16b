"""Words and roundings of a report: at most so many, and no number in two."""

import re
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest

from pinnray.comparison.evaluation.comparison import Results
from pinnray.comparison.report.html_report import report_html
from pinnray.solvers.finger_figures import FingerFigures
from pinnray.solvers.solution import Estimated, IdentifiedForce
from tests.compare.report.test_report import Page

MOST_WORDS = 1400
"""Of a report of eight solvers without pictures and provenance."""


@pytest.fixture(scope="module")
def eight(estimated, evaluate, compared, observations) -> Results:
    """Eight solvers with a truth, odd scales, figures, and two of them with a force that they found."""
    made = [estimated, evaluate("fem-nonlinear", 1.2371), evaluate("pinn-std", 1.0043)]
    off = np.array([0.1234, -0.0567])
    for number, name in enumerate(("pinn-asm", "fem-asm", "fem-id", "pinn-id", "gp")):
        given = evaluate(name, 1.0321 + 0.0173 * number)
        left_out = observations.displacements + (1 + 0.31 * number) * off
        made.append(replace(given, in_sample=True, left_out=left_out))
        if name.endswith("-id"):
            force = Estimated(0.4567, 0.4123, 0.5012)
            found = IdentifiedForce(force, Estimated(0.0021, -0.0123, 0.0104), Estimated(33.59, 32.52, 34.66))
            made[-1] = replace(made[-1], identified=found)
    made = [
        replace(
            each,
            figures=FingerFigures(
                force=4.3719 + 0.1131 * number,
                tip_u=-0.2337,
                tip_v=0.4891,
                principal_strain=0.0871,
                mass=12.34,
            ),
        )
        for number, each in enumerate(made)
    ]
    return compared(*made, truth=evaluate("truth", 1.0777))


@pytest.fixture(scope="module")
def text(eight) -> str:
    page = Page(report_html(eight, [], {})).text.replace("\N{NO-BREAK SPACE}", " ")
    return page.replace("\N{MINUS SIGN}", "-")


def test_a_report_of_eight_solvers_is_short(text):
    assert len(text.split()) < MOST_WORDS


def numbers(content: object) -> Iterator[float]:
    if isinstance(content, dict | list | tuple):
        for each in content.values() if isinstance(content, dict) else content:
            yield from numbers(each)
    elif isinstance(content, float) and np.isfinite(content) and abs(content) > 1e-3:
        yield abs(content)


def roundings(value: float, said: set[str], least: int) -> set[str]:
    """Those of the texts that are the number rounded to their digits, of which there are so many at least."""

    def digits(each: str) -> int:
        return len(each.replace(".", "").lstrip("0"))

    return {
        each
        for each in said
        if digits(each) >= least and np.isclose(float(f"{value:.{digits(each)}g}"), float(each))
    }


def test_no_number_stands_in_two_roundings(eight, text):
    shares = set(re.findall(r"(?<![\d.])(\d+(?:\.\d+)?) %", text))
    others = set(re.findall(r"(?<![\d.])(\d+\.\d+)(?![\d.]| %)", text))
    assert len(shares) > 15
    assert len(others) > 40
    for value in numbers(eight.scores.content()["solvers"]):
        for factor, said, least in ((100.0, shares, 2), (1.0, others, 3)):
            assert len(roundings(factor * value, said, least)) <= 1, value
