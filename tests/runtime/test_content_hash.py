"""The digest of the sources that a result depends on."""

import importlib
import sys
from collections.abc import Iterator
from hashlib import sha256
from pathlib import Path

import pytest

from pinnray.geometry import content_hash
from pinnray.runtime.content_hash import file_digest, sources_digest


@pytest.fixture
def program(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """The folder of a program, and packages of others that use it."""
    for package in ("geometry", "solvers", "compare", "researchers", "researchers/deep"):
        (tmp_path / package).mkdir()
        (tmp_path / package / "__init__.py").write_text("")
        (tmp_path / package / "law.py").write_text("")
    (tmp_path / "single.py").write_text("")
    monkeypatch.setattr(content_hash, "_ROOT", tmp_path)
    monkeypatch.syspath_prepend(str(tmp_path))
    for name in ("researchers", "single"):
        importlib.import_module(name)
    yield tmp_path
    for name in ("researchers", "single"):
        del sys.modules[name]


@pytest.mark.parametrize(
    ("modules", "changed", "counts"),
    [
        (["pinnray.solvers.fem"], "solvers/law.py", True),  # its own package
        (["pinnray.solvers.fem"], "geometry/law.py", True),  # one that it may import
        (["pinnray.solvers.fem"], "compare/law.py", False),  # one that imports it
        (["researchers.solver"], "researchers/deep/law.py", True),  # any module of others, loaded or not
        (["researchers.solver", "compare.metrics"], "geometry/law.py", True),
        (["single"], "single.py", True),  # a module without a package
        (["single"], "researchers/law.py", False),
    ],
)
def test_sources_that_count(program, modules, changed, counts):
    before = sources_digest(*modules)
    (program / changed).write_text("number = 2\n")
    assert (sources_digest(*modules) != before) == counts


def test_a_source_that_is_renamed_counts(program):
    before = sources_digest("researchers")
    (program / "researchers/law.py").rename(program / "researchers/other.py")
    assert sources_digest("researchers") != before


def test_order_and_repetition_do_not_count(program):
    assert sources_digest("single", "researchers") == sources_digest("researchers", "single", "single")


def test_code_of_a_notebook_has_no_source(program):
    assert sources_digest("builtins", "absent") == sha256().hexdigest()


def test_the_digest_of_a_file(tmp_path):
    (tmp_path / "file").write_bytes(b"abc")
    assert file_digest(tmp_path / "file") == sha256(b"abc").hexdigest()
