import re
from collections.abc import Sequence
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path

import pytest
import yaml  # type: ignore[import-untyped]
from PIL import Image

from pinnray.comparison.evaluation.certifier import with_certificates
from pinnray.comparison.evaluation.comparison import Results
from pinnray.comparison.evaluation.evaluation import Evaluation
from pinnray.comparison.figures import Picture
from pinnray.comparison.report.html_report import report_html
from pinnray.comparison.report.numbers import share
from pinnray.comparison.report.text import ending, found_numbers, sentence
from pinnray.geometry.mesh.triangle_mesh import TriangleMesh
from pinnray.solvers.fem.adaptive_refinement import Adaptation, RefinementRound
from pinnray.solvers.problem import Load, Problem

ROOT = Path(__file__).parents[3]
VOID = {"meta", "img", "br", "link", "hr", "input"}


class Page(HTMLParser):
    """Text, attributes and unbalanced tags of an HTML page."""

    def __init__(self, html: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.unbalanced: list[str] = []
        self.attributes: list[tuple[str, str, str]] = []
        self.pieces: list[str] = []
        self.feed(html)
        self.close()
        self.text = re.sub(r"\s+", " ", " ".join(self.pieces))

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.attributes += [(tag, name, value or "") for name, value in attrs]
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        if not self.open or self.open.pop() != tag:
            self.unbalanced.append(tag)

    def handle_data(self, data: str) -> None:
        if self.open and self.open[-1] not in ("style", "script"):
            self.pieces.append(data)

    def values(self, wanted: str) -> list[str]:
        return [value for _, name, value in self.attributes if name == wanted]


@pytest.fixture(scope="module")
def content(fem, pinn, compared) -> Results:
    return compared(fem, pinn)


@pytest.fixture(scope="module")
def html(content) -> str:
    return render(content)


def render(comparison: Results, pictures: Sequence[Picture] = ()) -> str:
    return report_html(comparison, pictures, {"seed": 17, "versions": {"numpy": "1.26.4"}})


def page_of(comparison: Results, **changes: object) -> Page:
    """The page of a comparison with other attributes: its tags are balanced, its links lead somewhere."""
    page = Page(render(replace(comparison, **changes)).replace("\N{NO-BREAK SPACE}", " "))
    assert (page.unbalanced, page.open) == ([], [])
    assert {link[1:] for link in page.values("href")} <= set(page.values("id"))
    return page


def test_it_asks_for_nothing_from_outside(content: Results, tmp_path: Path) -> None:
    Image.new("RGB", (4, 3), "red").save(tmp_path / "overlay.png")
    html = render(content, [Picture(tmp_path / "overlay.png", "Deformed finger", "Two fingers.")])
    assert "<link" not in html
    packed = r'(?<=id="viewer-data">)[^<]*'
    assert re.findall(r"url\(|@import|https?://", re.sub(packed, "", html)) == []
    assert [source[:22] for source in Page(html).values("src")] == ["data:image/png;base64,"]
    assert {link[0] for link in Page(html).values("href")} == {"#"}


@pytest.mark.parametrize(("kind", "warned"), [("point", True), ("mean", False)])
def test_a_point_load_is_said_to_have_no_limit(content: Results, kind: str, warned: bool) -> None:
    assert ("point-load" in page_of(content, load=Load(kind=kind)).values("id")) is warned


@pytest.mark.parametrize("given", [True, False])
def test_errors_on_assimilated_markers_are_training_errors(content: Results, given: bool) -> None:
    fem, pinn = content.evaluations
    page = page_of(content, evaluations=[fem, replace(pinn, in_sample=given)])
    assert ("in-sample" in page.values("id")) is given
    numbers, none = [r" \d\.\d{3}" * 4, " –" * 4]
    assert re.search(f"pinn-std{none}{numbers}" if given else f"pinn-std{numbers}{none}", page.text)
    told = replace(pinn, in_sample=given, left_out=pinn.marker_displacement if given else None)
    page = page_of(content, evaluations=[fem, told])
    assert bool(re.search(f"pinn-std{numbers}{numbers}", page.text)) is given


@pytest.mark.parametrize("simulated", [True, False])
def test_stress_is_held_against_the_truth_only_where_that_is_known(content, simulated):
    """The truth is the network's field, from which the reference is 9.09 % away."""
    fem, pinn = content.evaluations
    truth = pinn if simulated else None
    told = replace(pinn, in_sample=True, left_out=pinn.marker_displacement)
    text = page_of(content, evaluations=[fem, told], truth=truth).text
    assert ("fem 0.700 9.1 % 9.1 % −9.1 % pinn-std 0.606 0 % 0 % 0 %" in text) is simulated


def test_a_solver_that_failed_is_marked_everywhere(content: Results, failed: Evaluation) -> None:
    page = page_of(content, evaluations=[*content.evaluations, failed])
    assert failed.message.capitalize() in page.text
    assert re.findall(r"fem-nonlinear(?! \(not converged\)| did not converge)", page.text) == []


def test_the_certificate_has_its_numbers(content: Results, mesh: TriangleMesh) -> None:
    """A network with the energy of fem times 1.21 at the same places: a given field, and far from balance."""
    assert "certificate" not in page_of(content).values("id")
    evaluations = with_certificates(content.evaluations, Problem(mesh))
    page = page_of(content, evaluations=evaluations, reference=evaluations[0])
    assert "pinn-std (not converged): " in page.text
    assert "certificate" in page.values("id")
    certificate = evaluations[1].certificate
    assert certificate is not None
    shown = [certificate.rel_excess, certificate.energy_norm_error, certificate.weak_residual]
    assert [value for value in shown if share(value).replace("\xa0", " ") not in page.text] == []


def test_the_own_error_of_the_reference_stands_above_the_differences(content, estimated, evaluate):
    assert "±" not in page_of(content).text
    page = page_of(content, evaluations=[estimated, evaluate("pinn-std", 1.005)], reference=estimated)
    assert "fem ± 1.0 % ± 1.0 %" in page.text
    assert "pinn-std 0.50 % 0.50 %" in page.text


@pytest.mark.parametrize(("tolerance", "warned"), [(1e-3, False), (1e-6, True)])
def test_refinement_is_told_round_by_round(content, mesh, tolerance, warned):
    rounds = (RefinementRound(100, 70, 0.0123, 0.2), RefinementRound(250, 160, 0.00045, 0.1))
    page = page_of(content, adaptation=Adaptation(tolerance, rounds, mesh))
    assert {"adapt"} <= set(page.values("id"))
    assert ("not-adapted" in page.values("id")) is warned
    assert "1 250 160 0.00045 10 %" in page.text


def test_what_a_solver_found_is_told_apart_from_its_other_numbers() -> None:
    force = {"force": 0.25, "force_low": 0.2, "force_high": 0.3}
    stats = {"seconds": 3.0, **force, "young_modulus": 2, "law": "gent"}
    assert found_numbers(stats) == [("force", ["0.2500", "–", "0.2000", "0.3000", "–"])]
    message = "force 0.25 (0.2 to 0.3) N/mm; law gent; markers missed"
    assert ending(message, force) == "Law gent; markers missed."


def test_sentences_are_set() -> None:
    assert sentence("solved directly; no more.") == "Solved directly; no more."


def test_every_heading_says_what_it_heads(html) -> None:
    heads = re.findall(r"<thead>.*?</thead>", html, flags=re.DOTALL)
    cells = [cell for head in heads for cell in re.findall(r"<th\b[^>]*>", head)]
    assert len(cells) > 15
    assert [cell for cell in cells if 'scope="col' not in cell] == []


def test_held_out_errors_come_first_as_a_phone_shows_no_more(html) -> None:
    table = html[html.index('<table id="table-one">') :]
    table = table[: table.index("</table>")]
    assert table.index(">held out<") < table.index(">given<")
    body = table[table.index("<tbody>") :]
    cells = re.findall(r"<td>(.*?)</td>", body[: body.index("</tr>")])
    assert "–" not in cells[:4]
    assert cells[4:] == 4 * ["–"]  # fem is given no markers


def test_a_reader_who_wants_it_dark_has_it_dark_but_not_on_paper(html) -> None:
    style = html[html.index("<style>") : html.index("</style>")]
    assert "@media screen and (prefers-color-scheme: dark)" in style
    named = set(re.findall(r"var\((--[a-z-]+)\)", style))
    light, dark = (set(re.findall(r"(--[a-z-]+):", part)) for part in re.findall(r":root \{(.*?)\}", style))
    assert named == light == dark
    assert re.findall(r"(?<!-)color: #", style) == []  # every colour of type can change


def _luminance(colour: str) -> float:
    """Relative luminance of a colour such as #fff or #d0d4d9, by WCAG 2.2."""
    digits = colour.removeprefix("#")
    digits = "".join(2 * digit for digit in digits) if len(digits) == 3 else digits
    shares = [int(digits[place : place + 2], 16) / 255 for place in (0, 2, 4)]
    red, green, blue = (
        share / 12.92 if share <= 0.04045 else ((share + 0.055) / 1.055) ** 2.4 for share in shares
    )
    return 0.2126 * red + 0.7152 * green + 0.0722 * blue


@pytest.mark.parametrize("number", [0, 1])  # light, dark
def test_type_stands_out_from_what_it_stands_on(html, number) -> None:
    """WCAG 2.2, level AA: 4.5 for type, 3 for the edges of what can be pressed."""
    style = html[html.index("<style>") : html.index("</style>")]
    block = re.findall(r":root \{(.*?)\}", style)[number]
    colours = dict(re.findall(r"(--[a-z-]+): (#[0-9a-f]+)", block))
    pairs = [(type_, "--paper", 4.5) for type_ in ("--ink", "--muted", "--link", "--bad")]
    pairs += [("--warn", "--warn-soft", 4.5), ("--ink", "--soft", 4.5), ("--edge", "--paper", 3.0)]
    for first, second, least in pairs:
        low, high = sorted(_luminance(colours[name]) for name in (first, second))
        assert (high + 0.05) / (low + 0.05) >= least, (first, second)


def test_the_report_can_be_cited_as_the_citation_file_says(content: Results) -> None:
    """The same title, version, years and paper."""
    cited = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    text = report_html(content, [], {})
    bibtex = text[text.index("@software") : text.index("</pre>")]
    plain = " ".join(bibtex.replace("{", "").replace("}", "").split())
    paper = cited["references"][0]
    assert f"title = {cited['title']}," in plain
    assert f"version = {cited['version']}," in plain
    assert f"year = {str(cited['date-released'])[:4]}" in plain
    assert f"author = {cited['authors'][0]['name']}," in plain
    assert f"title = {paper['title']}," in plain
    assert f"year = {paper['year']}," in plain
    assert " and ".join(each["name"] for each in paper["authors"]) in plain
    assert paper["url"].endswith("2407.08222")
    assert bibtex.count("{") == bibtex.count("}")
