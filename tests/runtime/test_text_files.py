"""TOML and JSON files as people and editors leave them."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from pinnray.runtime.text_files import read_json, read_toml


@pytest.mark.parametrize(
    ("read", "text"), [(read_toml, "rib_count = 5"), (read_json, '{"rib_count": 5}')], ids=["toml", "json"]
)
def test_a_byte_order_mark_is_no_fault(read: Callable[[Path, str], Any], text: str, tmp_path: Path) -> None:
    path = tmp_path / "file"
    path.write_bytes(b"\xef\xbb\xbf" + text.encode())
    assert read(path, "file") == {"rib_count": 5}
