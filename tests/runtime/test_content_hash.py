"""The digest of the sources that a result depends on."""

import importlib
import re
import sys
from collections.abc import Iterator
from hashlib import sha256
from pathlib import Path

import pytest

from pinnray.runtime import content_hash
from pinnray.runtime.content_hash import file_digest, sources_digest


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A program whose packages import one another, and packages of others that use it."""
    for package in (
        "program",
        "program/low",
        "program/middle",
        "program/high",
        "researchers",
        "researchers/deep",
    ):
        (tmp_path / package).mkdir()
        (tmp_path / package / "__init__.py").write_text("")
        (tmp_path / package / "law.py").write_text("")
    (tmp_path / "program/middle/law.py").write_text("def law():\n    from program.low.law import law\n")
    (tmp_path / "program/high/law.py").write_text("import program.middle.law\n")
    (tmp_path / "researchers/deep/law.py").write_text("from program.middle import law\n")
    (tmp_path / "single.py").write_text("")
    monkeypatch.setattr(content_hash, "_PROGRAM", "program")
    pattern = content_hash._IMPORT.pattern.replace(b"pinnray", b"program")
    monkeypatch.setattr(content_hash, "_IMPORT", re.compile(pattern, re.MULTILINE))
    monkeypatch.syspath_prepend(str(tmp_path))
    for name in ("program", "researchers", "single"):
        importlib.import_module(name)
    yield tmp_path
    for name in ("program", "researchers", "single"):
        del sys.modules[name]


@pytest.mark.parametrize(
    ("modules", "changed", "counts"),
    [
        (["program.middle.other"], "program/middle/law.py", True),  # its own package
        (["program.middle.law"], "program/low/law.py", True),  # one that it imports, if only in a function
        (["program.high.law"], "program/low/law.py", True),  # one that an imported one imports
        (["program.middle.law"], "program/high/law.py", False),  # one that imports it
        (["researchers.solver"], "researchers/deep/law.py", True),  # any module of others, loaded or not
        (["researchers.solver"], "program/low/law.py", True),  # what others import of the program
        (["single"], "single.py", True),  # a module without a package
        (["single"], "researchers/law.py", False),
    ],
)
def test_sources_that_count(folder, modules, changed, counts):
    before = sources_digest(*modules)
    (folder / changed).write_text("number = 2\n")
    assert (sources_digest(*modules) != before) == counts


def test_a_source_that_is_renamed_counts(folder):
    before = sources_digest("researchers")
    (folder / "researchers/law.py").rename(folder / "researchers/other.py")
    assert sources_digest("researchers") != before


def test_order_and_repetition_do_not_count(folder):
    assert sources_digest("single", "researchers") == sources_digest("researchers", "single", "single")


def test_code_of_a_notebook_has_no_source(folder):
    assert sources_digest("builtins", "absent") == sha256().hexdigest()


def test_the_digest_of_a_file(tmp_path):
    (tmp_path / "file").write_bytes(b"abc")
    assert file_digest(tmp_path / "file") == sha256(b"abc").hexdigest()
