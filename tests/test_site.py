"""The documentation site: it builds without a warning, and its notebooks run."""

import json
import os
import re
import subprocess
import sys
from html import unescape
from pathlib import Path
from urllib.parse import unquote

import pytest

from tests.test_docs import ALL_BLOCKS, DOCS, blocks, id_of

pytestmark = pytest.mark.usefixtures("few_elements", "discs_fitted_once")

CELL = "{code-cell} python"
NOTEBOOKS = sorted({block.page for block in ALL_BLOCKS if block.language == CELL})


def dead_links(site: Path) -> list[tuple[str, str]]:
    """Links of a built site to places in its pages that are not there, each with its page."""
    texts = {path: path.read_text() for path in site.rglob("*.html") if "_static" not in path.parts}
    places = {path: {*re.findall(r'\b(?:id|name)="([^"]+)"', text)} for path, text in texts.items()}
    return [
        (str(page), link)
        for page, text in texts.items()
        for link in map(unescape, re.findall(r'href="([^":]*#[^":]+)"', text))
        if (other := (page.parent / link.split("#")[0]).resolve() if link[0] != "#" else page) in places
        and unquote(link.split("#")[1]) not in places[other]
    ]


@pytest.mark.release
def test_the_site_builds_without_a_warning(tmp_path):
    """With every page, every command and every public name, but without running the notebooks."""
    built = subprocess.run(
        [sys.executable, "-m", "sphinx", "-M", "html", str(DOCS), str(tmp_path), "-W", "--keep-going", "-q"],
        env={**os.environ, "NOTEBOOKS": "off"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert (built.returncode, built.stderr) == (0, "")
    pages = {path.relative_to(DOCS).with_suffix(".html") for path in DOCS.rglob("*.md")}
    assert {page for page in pages if not (tmp_path / "html" / page).is_file()} == set()
    assert dead_links(tmp_path / "html") == []
    assert "<math" in (tmp_path / "html" / "theory" / "elasticity.html").read_text()
    for page in [DOCS / "gallery.md", *NOTEBOOKS]:
        file = (tmp_path / "html" / page.relative_to(DOCS)).with_suffix(".ipynb")
        code = [cell for cell in json.loads(file.read_text())["cells"] if cell["cell_type"] == "code"]
        assert len(code) == sum(block.language in (CELL, "python") for block in blocks(page)) > 0
        assert "](" not in file.read_text()  # a picture or a page that is not beside it
        for cell in code:
            compile(cell["source"], str(file), "exec")


@pytest.mark.release
@pytest.mark.parametrize("page", NOTEBOOKS, ids=id_of)
def test_notebooks_run(page, tmp_path, monkeypatch, without_pictures, in_line):
    monkeypatch.chdir(tmp_path)
    names: dict[str, object] = {"__name__": "__docs__"}
    for block in blocks(page):
        if block.language == CELL:
            exec(compile("\n" * block.line + block.text, str(page), "exec"), names)
