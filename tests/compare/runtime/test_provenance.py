"""Provenance of a result: versions, machine, hashes."""

import hashlib
import importlib
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from compare.runtime.provenance import PACKAGES, machine, package_versions, sources_digest
from geometry.content_hash import file_digest


@pytest.fixture
def package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A loaded package with a subpackage, and a module beside it."""
    folder = tmp_path / "researchers"
    (folder / "deep").mkdir(parents=True)
    for name in ("__init__.py", "solver.py", "deep/__init__.py", "deep/law.py", "../single.py"):
        (folder / name).write_text("number = 1\n")
    monkeypatch.syspath_prepend(str(tmp_path))
    for name in ("researchers", "single"):
        importlib.import_module(name)
    yield folder
    for name in ("researchers", "single"):
        del sys.modules[name]


@pytest.mark.parametrize("changed", ["__init__.py", "solver.py", "deep/law.py"])
def test_every_source_of_a_package_counts(package, changed):
    """Also those that are not loaded yet, so that the order of loading has no part in it."""
    before = sources_digest(["researchers"])
    (package / changed).write_text("number = 2\n")
    assert sources_digest(["researchers"]) != before


def test_of_a_single_module_only_its_own_file_counts(package):
    before = sources_digest(["single"])
    (package / "solver.py").write_text("number = 2\n")
    assert sources_digest(["single"]) == before
    package.with_name("single.py").write_text("number = 2\n")
    assert sources_digest(["single"]) != before


def test_a_source_that_is_renamed_counts(package):
    before = sources_digest(["researchers"])
    (package / "solver.py").rename(package / "other.py")
    assert sources_digest(["researchers"]) != before


def test_order_and_repetition_do_not_count(package):
    assert sources_digest(["single", "researchers"]) == sources_digest(["researchers", "single", "single"])


def test_what_has_no_file_is_passed_over(package):
    """A solver that was typed into a notebook."""
    assert sources_digest(["single", "builtins", "absent"]) == sources_digest(["single"])


def test_versions_of_python_and_of_every_package():
    versions = package_versions()
    assert versions["python"] == ".".join(str(number) for number in sys.version_info[:3])
    assert set(versions) == {"python", *PACKAGES}
    assert versions["numpy"] == importlib.import_module("numpy").__version__


def test_a_package_that_is_not_there_has_no_version(monkeypatch):
    monkeypatch.setattr("compare.runtime.provenance.PACKAGES", ("no-such-package",))
    assert package_versions()["no-such-package"] == "unknown"


def test_the_machine_and_the_digest_of_a_file(tmp_path):
    (tmp_path / "file").write_bytes(b"abc")
    assert file_digest(tmp_path / "file") == hashlib.sha256(b"abc").hexdigest()
    assert machine()["cores"] >= 1
