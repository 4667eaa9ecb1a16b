"""The explorer as a reader has it: its numbers against the emulator's, its sliders, files and faults."""

import json
import shlex
from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Page

import pinnray as pr
from pinnray.cli import main
from pinnray.solvers.finger_figures import figures_of
from pinnray.studies.fields import explorer
from pinnray.studies.fields.emulator import FieldEmulator, fitted_fields
from pinnray.studies.fields.explorer import write_explorer
from tests.compare.report.browser import chromium, opened
from tests.studies.fields.synthetic import known, snapshots, study

pytestmark = pytest.mark.slow

DOCS = Path(__file__).parents[3] / "docs"
SCRIPTS = Path(explorer.__file__).parents[1] / "templates"

VARIED = {
    "contact_position": {"from": 30, "to": 60},
    "radius": {"from": 4, "to": 16},
    "direction": {"from": -10, "to": 10},
}


@pytest.fixture(scope="module")
def emulator() -> FieldEmulator:
    given = study(VARIED, 24)
    lost = [{"contact_position": 59.9, "radius": 15.9, "direction": 9.9}]
    assert known(given, lost).lost == lost
    return fitted_fields(snapshots(given, lost))


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    with chromium() as started:
        yield started


@pytest.fixture(scope="module")
def written(emulator: FieldEmulator, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_explorer(emulator, tmp_path_factory.mktemp("explorer") / "explore.html")


@pytest.fixture
def page(browser: Browser, written: Path) -> Iterator[Page]:
    found = opened(browser, written)
    found.page.wait_for_selector("#explorer:not([hidden])")
    yield found.page
    assert (found.complaints, found.asked) == ([], [])
    found.page.close()


def give(page: Page, **values: float) -> None:
    for name, value in values.items():
        page.fill(f"#value-{name}", str(value))
        page.press(f"#value-{name}", "Tab")
    page.evaluate("pinnrayExplorer.draw()")


@pytest.mark.parametrize("width", [1400, 390])
def test_moved_values_change_the_picture_and_give_the_emulators_numbers(browser, written, emulator, width):
    found = opened(browser, written, width=width)
    page = found.page
    page.wait_for_selector("#explorer:not([hidden])")
    before = page.evaluate("document.getElementById('explorer-canvas').toDataURL()")
    give(page, stroke=6.5, contact_position=41, radius=9, direction=-4, young=3, depth=12)
    assert page.evaluate("document.getElementById('explorer-canvas').toDataURL()") != before
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    shown = page.evaluate("pinnrayExplorer.state().figures")
    wanted = emulator.predict({"contact_position": 41.0, "radius": 9.0, "direction": -4.0}, 6.5)
    force, stress = 3 / 11.4 * 12 / 20, 3 / 11.4
    factors = {"force": force, "von_mises": stress}
    for each in shown:
        factor = factors.get(each["name"], 1.0)
        assert each["value"] == pytest.approx(factor * wanted.figures[each["name"]], rel=1e-3, abs=1e-4)
        half = factor * (wanted.intervals[each["name"]][1] - wanted.figures[each["name"]])
        assert each["half"] == pytest.approx(half, rel=5e-3, abs=1e-9)
    assert page.evaluate("pinnrayExplorer.state().error") == pytest.approx(wanted.error, rel=5e-3)
    moved = page.evaluate("Array.from(pinnrayExplorer.state().moved)")
    assert moved == pytest.approx(wanted.nodal.ravel(), abs=2e-3)  # steps of 16 bits of 8 mm, in each mode
    assert (found.complaints, found.asked) == ([], [])
    page.close()


def test_the_keyboard_moves_a_slider(page):
    before = page.inner_text("#figure-force")
    page.focus("#slider-stroke")
    for _ in range(40):
        page.keyboard.press("PageDown")
    page.evaluate("pinnrayExplorer.draw()")
    assert page.inner_text("#figure-force") != before


def test_out_of_range_says_why_and_gives_no_number(page):
    give(page, radius=30)
    assert "Radius of a cylinder of 30 mm is outside the study" in page.inner_text("#explorer-fault")
    assert page.inner_text("#figure-force") == "not known"
    give(page, radius=16, contact_position=60, direction=10)
    assert "no equilibrium" in page.inner_text("#explorer-fault")
    page.click("#explorer-reset")
    assert page.is_hidden("#explorer-fault")


def test_markers_that_lie_where_the_finger_is_have_no_error(page, emulator, tmp_path):
    middle = {"contact_position": 45.0, "radius": 10.0, "direction": 0.0}
    solution = emulator.predict(middle, 10.0).solution()
    places = solution.problem.mesh.points[[20, 60, 90]]
    rows = [",".join(map(str, [*place, *solution.displacement(place[None])[0]])) for place in places]
    file = tmp_path / "markers.csv"
    file.write_text("\n".join(["x_mm,y_mm,u_mm,v_mm", *rows]), encoding="utf-8")
    page.set_input_files("#explorer-csv", file)
    page.wait_for_function("document.getElementById('explorer-markers').textContent")
    said = page.inner_text("#explorer-markers")
    assert said.startswith("3 markers")
    assert float(said.partition("| ")[2].partition("| ")[2].split()[0]) < 2e-3
    file.write_text("x,y\n1,2\n", encoding="utf-8")
    page.set_input_files("#explorer-csv", [])
    page.set_input_files("#explorer-csv", file)
    page.wait_for_function("document.getElementById('explorer-said').textContent")
    assert "lacks the column x_mm" in page.inner_text("#explorer-said")


@pytest.fixture
def copied(page: Page) -> dict[str, str]:
    """What the page offers to copy of a finger."""
    give(page, radius=7, stroke=4)
    found = {}
    for kind in ("command", "toml", "python"):
        page.click(f"[data-copy={kind}]")
        found[kind] = page.inner_text("#explorer-copied")
    return found


def test_what_is_copied_runs_and_is_the_same_finger(copied, tmp_path, capsys):
    solution = eval(copied["python"], {"pr": pr})
    load = solution.problem.load
    assert (load.kind, load.radius, load.displacement) == ("cylinder", 7.0, (0.0, -4.0))
    assert solution.problem.finger.contact_abscissa == 45.0
    force = f"{figures_of(solution, {}).force:.4g} N"
    assert main([*shlex.split(copied["command"])[1:], "--out", str(tmp_path / "finger.vtu")]) == 0
    assert force in capsys.readouterr().out
    (tmp_path / "finger.toml").write_text(copied["toml"], encoding="utf-8")
    options = ["--from", str(tmp_path / "finger.toml"), "--out", str(tmp_path / "out")]
    assert main(["compare", *options]) == 0
    metrics = json.loads((tmp_path / "out/metrics.json").read_text(encoding="utf-8"))["solvers"]
    assert metrics["fem-nonlinear"]["reaction"] == pytest.approx(solution.reaction.tolist(), rel=1e-9)


def test_the_colour_bar_ends_at_no_less_than_the_largest_stress(page):
    page.evaluate(
        """() => { window.words = []; const old = CanvasRenderingContext2D.prototype.fillText;
        CanvasRenderingContext2D.prototype.fillText = function (text, ...rest) {
            window.words.push(text); old.call(this, text, ...rest); }; }"""
    )
    for stroke in (2, 10):
        give(page, stroke=stroke)
        end = page.evaluate("window.words.filter((text) => text.endsWith('MPa')).pop()")
        figures = page.evaluate("pinnrayExplorer.state().figures")
        largest = next(each["value"] for each in figures if each["name"] == "von_mises")
        assert end.startswith("≥ ")
        assert float(end.split()[1]) >= float(f"{largest:.3g}")


@pytest.mark.parametrize("width", [320, 390, 520, 1400])
def test_the_words_below_the_colour_bar_stay_apart(page, width):
    """The bar is as long as its three words, each with a letter of space, need."""
    page.set_viewport_size({"width": width, "height": 900})
    page.evaluate(
        """() => { window.ends = []; const old = CanvasRenderingContext2D.prototype.fillText;
        CanvasRenderingContext2D.prototype.fillText = function (text, x, ...rest) {
            const wide = this.measureText(text).width * { left: 0, center: 0.5, right: 1 }[this.textAlign];
            window.ends.push([text, x - wide, x - wide + this.measureText(text).width]);
            old.call(this, text, x, ...rest); }; }"""
    )
    give(page, stroke=3)
    give(page, stroke=9)
    _, title, end, _ = sorted(page.evaluate("window.ends.slice(-4)"), key=lambda each: each[1])
    assert title[0].endswith("stress")
    assert title[2] + 4 <= end[1]


def test_the_shipped_page_has_the_scripts_of_today():
    shipped = (DOCS / "static" / "explore-default.html").read_text(encoding="utf-8")
    for name in ("explorer.js", "explorer_model.js"):
        assert (SCRIPTS / name).read_text(encoding="utf-8").strip() in shipped
