"""Text and names of others: they stay text in every page, and never lead out of the output folder."""

import ast
import re
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path

import pytest

from pinnray.cli import main
from pinnray.comparison.evaluation.comparison import Results
from pinnray.comparison.figures import Picture
from pinnray.comparison.pipeline.job import Job, checked
from pinnray.comparison.report.html_report import report_html
from pinnray.geometry import Design, UserError
from pinnray.geometry.drawing.description import Description
from pinnray.runtime.atomic import write_json
from pinnray.runtime.html import PNG, template_environment
from pinnray.solvers.registry import make_solver
from tests.program import ROOT, SOURCES

HOSTILE = """</script></table><x-evil onerror="x()">&amp; ' "><img src=x onerror=x()>"""
UP = ["../up", "/tmp/up", "a/../../up", "..", "a/b", "a\x00b", "\N{FULLWIDTH SOLIDUS}up"]


class Elements(HTMLParser):
    """Names of all elements, and all attributes that would run a script."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.names: set[str] = set()
        self.running: list[str] = []
        self.text = ""
        self.feed(page)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.names.add(tag)
        self.running += [name for name, value in attrs if name.startswith("on") or value == "x"]

    def handle_data(self, data: str) -> None:
        self.text += data


@pytest.fixture
def hostile(fem, pinn, observe, compared) -> Results:
    """A comparison in which every text that a solver, a file or a user can set is hostile."""
    said = {"message": HOSTILE, "stats": {HOSTILE: HOSTILE, "seconds": 1.0}}
    evaluations = [replace(each, solver=f"{each.solver}{HOSTILE}", **said) for each in (fem, pinn)]
    evaluations.append(replace(evaluations[1], solver=HOSTILE, converged=False, in_sample=True))
    return compared(
        *evaluations,
        observations=observe(fem.marker_displacement, source=f"simulated {HOSTILE}"),
        truth=replace(fem, solver="truth"),
        design=Design.model_construct(**{**Design().model_dump(), "name": HOSTILE}),
        settings={HOSTILE: {HOSTILE: HOSTILE}},
        unsupported={HOSTILE: HOSTILE},
        failed={HOSTILE: HOSTILE},
        warnings=[HOSTILE],
    )


def test_the_report_escapes_every_text_of_others(hostile: Results, tmp_path: Path) -> None:
    path = tmp_path / 'a <b> & "c".png'
    path.write_bytes(PNG)
    picture = Picture(path, HOSTILE, HOSTILE)
    page = report_html(hostile, [picture], {HOSTILE: HOSTILE, "group": {HOSTILE: HOSTILE}})
    found, plain = Elements(page), Elements(report_html(hostile, [], {}))
    assert "x-evil" not in found.names
    assert found.running == []
    assert page.count("<script") == page.count("</script>") == 3
    assert found.text.count("x-evil") > plain.text.count("x-evil") > 10


def test_a_text_of_others_is_no_command_of_the_terminal(hostile, tmp_path, capsys):
    numbers = hostile.scores.content()
    numbers["solvers"]["fem\x1b[2J"] = numbers["solvers"].pop(numbers["reference"])
    numbers["reference"] = "fem\x1b[2J"
    write_json(tmp_path / "metrics.json", numbers)
    assert main(["report", str(tmp_path)]) == 0
    assert main(["report", str(tmp_path / "\x1b[2J")]) == 2
    said = "".join(capsys.readouterr())
    assert "fem\N{REPLACEMENT CHARACTER}[2J" in said
    assert "\x1b" not in said


def test_no_template_and_no_script_puts_text_in_as_html() -> None:
    assert template_environment("pinnray.comparison").autoescape is True
    for path in sorted(ROOT.glob("*/templates/*")):
        text = path.read_text(encoding="utf-8")
        found = re.findall(
            r"\|\s*safe\b|autoescape|innerHTML|outerHTML|insertAdjacentHTML|document\.write|\beval\(", text
        )
        assert (path.name, found) == (path.name, [])


def test_html_is_made_of_constants_alone() -> None:
    """`Markup` marks a text as safe; texts of others come in by its method `format`, which escapes them."""
    for path in SOURCES:
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "Markup":
                assert all(isinstance(each, ast.Constant) for each in node.args), f"{path}:{node.lineno}"


@pytest.mark.parametrize("name", UP)
def test_no_name_of_a_finger_or_a_solver_is_a_path(name: str, tmp_path: Path) -> None:
    with pytest.raises(UserError):
        Design(name=name)
    with pytest.raises(UserError):
        Description(name=name)
    solver = make_solver("fem")
    named = type("Named", (type(solver),), {"name": name})()
    with pytest.raises(UserError, match="a solver is called"):
        checked(Job(design=Design(), solvers=[named], out=tmp_path / "out"))
