"""Provenance of a result: versions, machine, hashes."""

import importlib
import sys

from compare.runtime.provenance import PACKAGES, machine, package_versions


def test_versions_of_python_and_of_every_package():
    versions = package_versions()
    assert versions["python"] == ".".join(str(number) for number in sys.version_info[:3])
    assert set(versions) == {"python", *PACKAGES}
    assert versions["numpy"] == importlib.import_module("numpy").__version__


def test_a_package_that_is_not_there_has_no_version(monkeypatch):
    monkeypatch.setattr("compare.runtime.provenance.PACKAGES", ("no-such-package",))
    assert package_versions()["no-such-package"] == "unknown"


def test_the_machine_has_a_core():
    assert machine()["cores"] >= 1
