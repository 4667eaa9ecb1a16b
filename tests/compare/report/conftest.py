"""The browser, and a report that it opens."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from playwright.sync_api import Browser

from pinnray.comparison.evaluation.evaluation import Evaluation
from pinnray.comparison.figures import Picture
from pinnray.comparison.figures.gallery import draw
from pinnray.comparison.report.html_report import report_html
from tests.compare.report.browser import chromium

TITLES = {"marker_errors": "Errors at the markers", "von_mises": "Von Mises stress"}
"""Beginnings of the alternative texts of the report's pictures."""


@pytest.fixture(scope="package")
def browser() -> Iterator[Browser]:
    with chromium() as started:
        yield started


@pytest.fixture(scope="package")
def truth(evaluate) -> Evaluation:
    return evaluate("fem-nonlinear", 1.05)


@pytest.fixture(scope="package")
def followed(failed) -> Evaluation:
    """A solver that recorded its path, which is far from linear."""
    end = failed.node_displacement
    path = np.stack([0 * end, 0.1 * end, end])
    return replace(failed, path=path, history={"load_fraction": np.array([0.0, 0.5, 1.0])})


@pytest.fixture(scope="package")
def written(estimated, pinn, followed, evaluate, truth, compared, tmp_path_factory) -> Path:
    """A report with four solvers, one of which followed the load, a truth and two pictures."""
    folder = tmp_path_factory.mktemp("report")
    given = replace(evaluate("pinn-asm", 1.02), in_sample=True, left_out=estimated.marker_displacement)
    comparison = compared(estimated, pinn, followed, given, truth=truth)
    pictures = []
    for name in TITLES:
        drawing = draw(comparison, name)
        picture = drawing.figure.save(folder / f"{name}.png")
        pictures.append(Picture(picture, drawing.title, drawing.caption))
    page = folder / "report.html"
    page.write_text(report_html(comparison, pictures, {"seed": 17}), encoding="utf-8")
    return page
