"""The report as a reader has it: opened in Chromium, at the sizes of a desk and of a phone."""

import csv
import io
import re
from pathlib import Path

import numpy as np
import pytest
from playwright.sync_api import Browser, Page, expect

from pinnray.comparison.evaluation.evaluation import Evaluation
from pinnray.geometry.mesh.triangle_mesh import TriangleMesh
from pinnray.runtime.html import write_html
from pinnray.runtime.tables import TextTable
from tests.compare.report.browser import TIMEOUT, Opened, opened

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def desk(browser: Browser, written: Path) -> Opened:
    return opened(browser, written)


@pytest.fixture(scope="module")
def viewer(desk: Opened) -> Page:
    """The page with its field viewer ready."""
    desk.page.evaluate("document.getElementById('viewer').scrollIntoView()")
    desk.page.locator("#viewer[data-ready]").wait_for()
    return desk.page


def test_the_middle_is_read_by_the_keyboard(viewer: Page, pinn: Evaluation, mesh: TriangleMesh) -> None:
    """The value is that of the triangle that is named, to the three digits shown."""
    viewer.select_option("#viewer-solver", label="pinn-std")
    viewer.select_option("#viewer-quantity", label="Displacement magnitude")
    viewer.select_option("#viewer-show", label="field")
    viewer.locator("#viewer-canvas").focus()
    viewer.keyboard.press("0")
    said = viewer.inner_text("#viewer-probe").replace("−", "-")
    x, y, value = (float(text) for text in re.findall(r"-?\d+\.?\d*", said))
    near = np.linalg.norm(mesh.points[mesh.triangles].mean(axis=1) - [x, y], axis=1).argmin()
    expected = pinn.per_triangle(np.hypot(*pinn.displacement.T))[near]
    assert value == pytest.approx(expected, rel=5e-3)


def test_the_body_moves_along_the_path_that_the_solver_found(viewer: Page) -> None:
    half = "pinnrayFields.displacement(pinnrayFields.manifest.solvers[%d], 0.5)"
    end = "pinnrayFields.displacement(pinnrayFields.manifest.solvers[%d], 1)"
    for solver, share in ((0, 0.5), (2, 0.1)):  # linear; recorded
        shares = np.array(viewer.evaluate(f"[...{half}]" % solver)) / np.array(
            viewer.evaluate(f"[...{end}]" % solver)
        )
        assert np.nanmedian(shares) == pytest.approx(share, abs=1e-2)
    viewer.select_option("#viewer-solver", index=0)
    expect(viewer.locator("#viewer-note")).to_contain_text("as the linear law implies")
    viewer.select_option("#viewer-solver", index=2)
    expect(viewer.locator("#viewer-note")).to_contain_text("load path of 2 equilibria")


def test_the_load_is_played_until_it_is_stopped(viewer: Page) -> None:
    viewer.evaluate("document.getElementById('viewer-play').click()")
    viewer.wait_for_function("document.getElementById('viewer-load').value < 90")
    viewer.evaluate("document.getElementById('viewer-play').click()")
    assert viewer.inner_text("#viewer-play") == "Play"


def test_nothing_moves_for_a_reader_who_wants_no_motion(viewer: Page) -> None:
    viewer.evaluate("document.getElementById('viewer-play').click()")
    viewer.emulate_media(reduced_motion="reduce")
    viewer.locator("#viewer-play").wait_for(state="hidden")
    assert viewer.get_attribute("#viewer-play", "aria-pressed") == "false"
    viewer.emulate_media(reduced_motion="no-preference")


@pytest.mark.parametrize("without", ["scripts", "a canvas"])
def test_still_pictures_stand_in_for_the_viewer(browser: Browser, written: Path, without: str) -> None:
    page = browser.new_page(java_script_enabled=without != "scripts")
    page.set_default_timeout(TIMEOUT)
    page.add_init_script("HTMLCanvasElement.prototype.getContext = () => null")
    page.goto(written.as_uri())
    assert page.locator("#viewer").is_hidden()
    assert "as still pictures" in page.inner_text("#viewer-absent")
    assert page.locator("#stills img").first.is_visible()
    page.close()


def test_the_page_complains_of_nothing_and_asks_for_nothing(desk: Opened, viewer: Page) -> None:
    assert desk.complaints == []
    assert desk.asked == []


def test_nothing_is_wider_than_a_phone(desk: Opened) -> None:
    desk.page.set_viewport_size({"width": 390, "height": 900})
    assert desk.page.evaluate("document.documentElement.scrollWidth") == 390
    desk.page.set_viewport_size({"width": 1400, "height": 900})
    assert desk.page.evaluate("document.documentElement.scrollWidth") == 1400


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


def test_rows_are_sorted_below_the_name_of_their_group(browser: Browser, tmp_path: Path) -> None:
    rows = [["front", ""], ["gp", "2"], ["fem", "1"], ["joints", ""], ["gp", "4"], ["fem", "3"]]
    table = TextTable("Errors", ["solver", "error"], rows)
    page = write_html(
        tmp_path / "page.html",
        "designs.html.j2",
        title="",
        sentences=[],
        tables=[table],
        pictures={},
        note="",
    )
    shown = opened(browser, page).page
    shown.locator("th .sort").nth(1).click()
    names = [text.strip() for text in shown.locator("tbody th").all_inner_texts()]
    assert names == ["front", "fem", "gp", "joints", "fem", "gp"]
    shown.close()


def test_a_table_is_copied_as_csv_and_latex(desk: Opened) -> None:
    found = desk.page.evaluate("pinnrayTables.csv(document.getElementById('differences'))")
    rows = list(csv.DictReader(io.StringIO(found)))
    assert [row["Solver"] for row in rows[:2]] == ["fem", "pinn-std"]
    assert rows[1]["displacement rel. L²"] == "10 %"
    assert float(rows[0]["displacement rel. L² ±"].removesuffix("%")) == pytest.approx(1, rel=1e-3)
    latex = desk.page.evaluate("pinnrayTables.latex(document.getElementById('differences'))")
    assert r"\begin{tabular}{lrrrr}" in latex
    assert r"pinn-std & 10 \% & " in latex


def height(page: Page) -> int:
    return int(page.evaluate("document.documentElement.scrollHeight"))


def test_a_table_that_goes_on_says_so_and_no_name_breaks(desk: Opened) -> None:
    page = desk.page
    page.emulate_media(media="screen")
    page.set_viewport_size({"width": 390, "height": 900})
    page.evaluate("document.querySelectorAll('details').forEach((part) => (part.open = true))")
    page.locator(".scroll.cut").first.wait_for()
    hint = "(box) => getComputedStyle(box.nextElementSibling, '::before').content"
    boxes = page.locator(".scroll:has(> #table-one), .scroll:has(> #differences)").all()
    assert all("scroll it sideways" in box.evaluate(hint) for box in boxes)
    assert all(box.get_attribute("tabindex") == "0" for box in boxes)
    names = page.locator("#table-one tbody:first-of-type th")
    count = "(cell) => [...cell.querySelectorAll('.word')].map((word) => word.getClientRects().length)"
    assert [lines for name in names.all() for lines in name.evaluate(count)] == [
        1
    ] * 3  # the names with hyphens
    page.set_viewport_size({"width": 1400, "height": 900})
    page.wait_for_function("!document.querySelector('#table-one').parentElement.matches('.cut')")


def test_a_whole_report_is_short_and_prints_on_few_pages(browser: Browser, finished: Path) -> None:
    page = opened(browser, finished / "report.html").page
    assert height(page) < 8_000
    printed = page.pdf(format="A4")
    assert 3 < len(re.findall(rb"/Type\s*/Page\b", printed)) <= 7
    page.close()
