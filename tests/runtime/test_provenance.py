"""Provenance of a result: versions, machine, hashes."""

import importlib
import sys

from pinnray.runtime.machine import PACKAGES, package_versions


def test_versions_of_python_and_of_every_package(monkeypatch):
    versions = package_versions()
    assert versions["python"] == ".".join(str(number) for number in sys.version_info[:3])
    assert set(versions) == {"python", *PACKAGES}
    assert versions["numpy"] == importlib.import_module("numpy").__version__
    monkeypatch.setattr("pinnray.runtime.machine.PACKAGES", ("no-such-package",))
    assert package_versions()["no-such-package"] == "unknown"
