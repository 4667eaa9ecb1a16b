"""The lines of docs/notebook.md, and the output that the page shows."""

from pathlib import Path
from typing import Any

import pytest
from PIL import Image

from tests.test_docs import DOCS, blocks

pytestmark = pytest.mark.slow

PAGE = DOCS / "notebook.md"


@pytest.fixture(scope="module")
def names() -> dict[str, Any]:
    """What the page's lines define."""
    (block,) = [block for block in blocks(PAGE) if block.language == "python"]
    assert len([line for line in block.text.splitlines() if line]) <= 12
    defined: dict[str, Any] = {}
    exec(compile("\n" * block.line + block.text, str(PAGE), "exec"), defined)
    return defined


def test_the_table_is_the_one_on_the_page(names):
    (shown,) = [block for block in blocks(PAGE) if block.language == "text"]
    rows = [line.split()[-3:] for line in shown.text.splitlines()[2:]]
    errors = names["errors"]
    assert errors.shape == (4, 3)
    for row, (_, found) in zip(rows, errors.iterrows(), strict=True):
        assert found.tolist() == pytest.approx([float(cell) for cell in row], rel=0.01, abs=5e-4, nan_ok=True)


@pytest.mark.parametrize("name", ["bars", "field"])
def test_the_pictures_show_themselves(names, name):
    assert names[name]._repr_png_()[:8] == b"\x89PNG\r\n\x1a\n"


def test_the_picture_on_the_page_is_the_field(names, tmp_path: Path):
    names["field"].save(tmp_path / "field.png")
    with Image.open(tmp_path / "field.png") as drawn, Image.open(DOCS / "pictures" / "notebook.png") as shown:
        assert drawn.size == shown.size
