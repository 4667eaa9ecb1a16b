"""TOML and JSON files as people and editors leave them."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from geometry.drawing.description import load_description
from geometry.errors import UserError
from geometry.finger.design import Design
from geometry.finger.presets import load_design
from geometry.text_files import parse_toml, read_json, read_toml


@pytest.mark.parametrize(
    ("read", "text"), [(read_toml, "rib_count = 5"), (read_json, '{"rib_count": 5}')], ids=["toml", "json"]
)
def test_a_byte_order_mark_is_no_fault(read: Callable[[Path, str], Any], text: str, tmp_path: Path) -> None:
    path = tmp_path / "file"
    path.write_bytes(b"\xef\xbb\xbf" + text.encode())
    assert read(path, "file") == {"rib_count": 5}


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (b"height = " + b"9" * 400, "it has a number of 400 digits"),  # no float
        (b"height = " + b"9" * 5000, "Exceeds the limit .4300 digits."),  # of Python
        (b"height = " + b"[" * 3000 + b"]" * 3000, "it is nested too deeply"),
        (b"\xff\xfeh\x00", "it is no text in UTF-8"),
        (b"height 90", "line 1"),
    ],
)
def test_a_toml_file_that_cannot_be_read_is_one_line(content: bytes, said: str, tmp_path: Path) -> None:
    path = tmp_path / "finger.toml"
    path.write_bytes(content)
    for read in (load_design, load_description):
        with pytest.raises(UserError, match=rf"cannot read the .*finger\.toml: .*{said}") as error:
            read(path)
        assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ('{"a": ' + "[" * 100_000 + "]" * 100_000 + "}", "it is nested too deeply"),
        ('{"a": ' + "9" * 400 + "}", "it has a number of 400 digits"),
        ('{"a": [', "it is not JSON .*line 1"),
    ],
)
def test_a_json_file_that_cannot_be_read_is_one_line(content: str, said: str, tmp_path: Path) -> None:
    path = tmp_path / "workspace.json"
    path.write_text(content)
    with pytest.raises(UserError, match=rf"cannot read the workspace .*workspace\.json: {said}"):
        read_json(path, "workspace")


def test_a_text_may_have_lists_and_tables() -> None:
    assert parse_toml("a = [[1, 2.5], [3, 4]]\n[b]\nc = true") == {"a": [[1, 2.5], [3, 4]], "b": {"c": True}}


@pytest.mark.parametrize(
    ("values", "said"),
    [
        ({"rib_count": True}, "rib_count .N. = 'true' is not a whole number"),
        ({"height": False}, "height .H. = 'false' is not a finite number"),
        ({"contact_position": True}, "contact_position = 'true' is not a finite number"),
    ],
)
def test_true_is_no_number(values: dict[str, bool], said: str) -> None:
    with pytest.raises(UserError, match=said):
        Design(**values)
