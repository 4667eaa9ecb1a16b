"""The digest of the sources that a result depends on."""

import importlib
import sys
from collections.abc import Iterator
from hashlib import sha256
from pathlib import Path
from types import FunctionType

import pytest

from geometry import content_hash
from geometry.content_hash import file_digest, source_files, sources_digest


@pytest.fixture
def program(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """The folder of a program, and a package of others that uses it."""
    sources = {
        "geometry/__init__.py": "number = 1\n",
        "geometry/hall.py": "from geometry.room import (\n    chair,\n)\n",
        "geometry/room/__init__.py": "",
        "geometry/room/chair.py": "def sit():\n    import geometry.shelf as shelf\n",
        "geometry/shelf.py": "TABLE = {'book': 'geometry.book:Book'}\n",
        "geometry/book.py": "",
        "geometry/cellar.py": "from geometry.hall import door\n",
        "researchers/__init__.py": "",
        "researchers/solver.py": "from geometry.shelf import TABLE\n",
        "researchers/deep/law.py": "",
        "single.py": "",
    }
    for name, text in sources.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text)
    monkeypatch.setattr(content_hash, "_ROOT", tmp_path)
    monkeypatch.syspath_prepend(str(tmp_path))
    for name in ("researchers", "single"):
        importlib.import_module(name)
    yield tmp_path
    for name in ("researchers", "single"):
        del sys.modules[name]


def maker(module: str) -> FunctionType:
    """A function of a module."""
    return FunctionType((lambda: None).__code__, {"__name__": module})


@pytest.mark.parametrize(
    ("module", "changed"),
    [
        ("geometry.hall", "geometry/hall.py"),  # its own
        ("geometry.hall", "geometry/__init__.py"),  # runs before it
        ("geometry.hall", "geometry/room/chair.py"),  # a module named as a part of its package
        ("geometry.hall", "geometry/shelf.py"),  # imported inside a function
        ("geometry.hall", "geometry/book.py"),  # named in a table
        ("researchers.solver", "researchers/deep/law.py"),  # any module of others, loaded or not
        ("researchers.solver", "geometry/book.py"),  # that of the program which they use
        ("single", "single.py"),
    ],
)
def test_a_source_that_counts(program, module, changed):
    before = sources_digest(maker(module))
    (program / changed).write_text("number = 2\n")
    assert sources_digest(maker(module)) != before


@pytest.mark.parametrize(
    ("module", "changed"),
    [
        ("geometry.hall", "geometry/cellar.py"),  # imports it, and not the other way round
        ("single", "researchers/solver.py"),
    ],
)
def test_a_source_that_does_not_count(program, module, changed):
    before = sources_digest(maker(module))
    (program / changed).write_text("number = 2\n")
    assert sources_digest(maker(module)) == before


def test_a_source_that_is_renamed_counts(program):
    before = sources_digest(maker("researchers"))
    (program / "researchers/solver.py").rename(program / "researchers/other.py")
    assert sources_digest(maker("researchers")) != before


def test_order_and_repetition_do_not_count(program):
    one, other = maker("single"), maker("researchers")
    assert sources_digest(one, other) == sources_digest(other, one, one)


def test_code_of_a_notebook_has_no_source(program):
    assert source_files(maker("builtins"), maker("absent")) == {}


def test_the_digest_of_a_file(tmp_path):
    (tmp_path / "file").write_bytes(b"abc")
    assert file_digest(tmp_path / "file") == sha256(b"abc").hexdigest()
