"""The report as a reader has it: opened in Chromium, at the sizes of a desk and of a phone."""

import csv
import io
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import pytest
from playwright.sync_api import Browser

from compare.evaluation.comparison import Comparison
from compare.evaluation.evaluation import Evaluation
from compare.figures import Picture
from compare.figures.gallery import draw
from compare.report.html_report import write_report
from tests.compare.browser import SOFTWARE_WEBGL, Opened, chromium, opened


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    with chromium(*SOFTWARE_WEBGL) as started:
        yield started


@pytest.fixture(scope="module")
def written(
    estimated: Evaluation,
    pinn: Evaluation,
    failed: Evaluation,
    evaluate: Callable[..., Evaluation],
    compared: Callable[..., Comparison],
    tmp_path_factory: pytest.TempPathFactory,
) -> Path:
    """A report with five solvers, a truth, and one picture."""
    folder = tmp_path_factory.mktemp("report")
    given = replace(evaluate("pinn-asm", 1.02), in_sample=True, left_out=estimated.marker_displacement)
    comparison = compared(estimated, pinn, failed, given, truth=evaluate("fem-nonlinear", 1.05))
    drawing = draw(comparison, "marker_errors")
    path = drawing.figure.save(folder / "marker_errors.png")
    pictures = [Picture(path, drawing.title, drawing.caption, drawing.alt)]
    write_report(folder / "report.html", comparison, pictures, {"seed": 17})
    return folder / "report.html"


@pytest.fixture(scope="module")
def desk(browser: Browser, written: Path) -> Opened:
    return opened(browser, written)


def test_the_page_complains_of_nothing_and_asks_for_nothing(desk: Opened) -> None:
    assert desk.complaints == []
    assert desk.asked == []


def test_every_picture_is_drawn(desk: Opened) -> None:
    widths = desk.page.evaluate("[...document.images].map((image) => image.naturalWidth)")
    assert len(widths) > 0
    assert min(widths) > 0


@pytest.mark.parametrize("width", [390, 1400])
def test_nothing_is_wider_than_the_window(browser: Browser, written: Path, width: int) -> None:
    page = opened(browser, written, width=width).page
    assert page.evaluate("document.documentElement.scrollWidth") == width


def column(desk: Opened, number: int) -> list[str]:
    """The cells of a column of Table I, without the paper's rows."""
    cells = desk.page.locator(f"#table-one tbody:nth-of-type(1) tr > :nth-child({number})")
    return [text.strip() for text in cells.all_inner_texts()]


def test_a_table_is_sorted_by_a_key(desk: Opened) -> None:
    before = column(desk, 1)
    head = desk.page.locator("#table-one thead tr:nth-child(2) th").nth(1)
    head.locator("button").focus()
    desk.page.keyboard.press("Enter")
    assert head.get_attribute("aria-sort") == "ascending"
    values = [float(text) for text in column(desk, 2)]
    assert values == sorted(values)
    desk.page.keyboard.press("Enter")
    assert head.get_attribute("aria-sort") == "descending"
    values = [float(text) for text in column(desk, 2)]
    assert values == sorted(values, reverse=True)
    assert sorted(column(desk, 1)) == sorted(before)
    assert column(desk, 1) != before


def test_a_table_is_copied_as_csv_and_latex(desk: Opened) -> None:
    found = desk.page.evaluate("pinnrayTables.csv(document.getElementById('differences'))")
    rows = list(csv.DictReader(io.StringIO(found)))
    assert rows[0]["Solver"] == "pinn-std"
    assert float(rows[0]["displ. rel. L², %"]) == pytest.approx(10, rel=1e-3)
    assert float(rows[0]["displ. rel. L², % ±"]) == pytest.approx(1, rel=1e-3)
    latex = desk.page.evaluate("pinnrayTables.latex(document.getElementById('differences'))")
    assert r"\begin{tabular}{lrrrrrr}" in latex
    assert r"pinn-std & 10.0 $\pm$ 1.0 & " in latex
    assert r", \%" in latex


def test_the_button_puts_the_table_on_the_clipboard(browser: Browser, written: Path) -> None:
    page = opened(browser, written, permissions=["clipboard-read", "clipboard-write"]).page
    page.get_by_role("button", name="Copy as CSV: Mean absolute error").click()
    page.get_by_text("copied as CSV").wait_for()
    assert page.evaluate("navigator.clipboard.readText()").startswith("Solver,")


def test_a_part_is_folded_by_a_key(desk: Opened) -> None:
    part = desk.page.locator("#design")
    assert part.get_attribute("open") is not None
    part.locator("summary").focus()
    desk.page.keyboard.press("Enter")
    assert part.get_attribute("open") is None


def test_paper_has_every_part_unfolded(browser: Browser, written: Path) -> None:
    page = opened(browser, written).page
    page.evaluate("document.querySelectorAll('details').forEach((part) => (part.open = false))")
    page.emulate_media(media="print")
    assert page.locator("#design table").bounding_box()["height"] > 20
