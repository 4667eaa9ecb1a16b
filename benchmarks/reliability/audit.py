"""Known weaknesses of the locked packages, as PyPI lists them, and releases that their makers withdrew.

`python -m benchmarks.reliability.audit` keeps what was found. PyPI's page of a release has its advisories;
where only the page of the project can be reached, those of its newest release are known, and no others.
"""

import json
import re
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, NamedTuple
from urllib.error import HTTPError
from urllib.request import urlopen

from geometry.atomic import write_text

KEPT = Path(__file__).with_name("audit.json")
LOCKS = sorted((Path(__file__).parents[2] / "requirements").glob("debian*.txt"))


class Package(NamedTuple):
    """A locked package and its advisories; None if they cannot be known from here."""

    name: str
    version: str
    advisories: list[str] | None
    withdrawn: bool

    @property
    def reason(self) -> str:
        """Its advisories, or its withdrawal."""
        return ", ".join(self.advisories or ["withdrawn"])


class Audit(NamedTuple):
    """The packages of all lock files, and the day on which PyPI was asked."""

    day: str
    packages: list[Package]

    @property
    def known(self) -> list[Package]:
        """Those whose advisories are known."""
        return [each for each in self.packages if each.advisories is not None]

    @property
    def weak(self) -> list[Package]:
        """Those with an advisory, or withdrawn."""
        return [each for each in self.packages if each.advisories or each.withdrawn]


def locked(files: Sequence[Path] = LOCKS) -> list[tuple[str, str]]:
    """Names and versions in lock files, each once."""
    lines = (line for file in files for line in file.read_text(encoding="utf-8").splitlines())
    return sorted({match.groups() for line in lines if (match := re.match(r"([\w.-]+)==([^\s;+]+)", line))})


def audited(packages: Sequence[tuple[str, str]]) -> Audit:
    """Ask PyPI about packages.

    Raises:
        OSError: If it does not answer.
    """
    with ThreadPoolExecutor(6) as pool:
        found = list(pool.map(_asked, packages))
    return Audit(datetime.now(UTC).date().isoformat(), found)


def kept() -> Audit:
    """The audit as it was kept."""
    day, packages = json.loads(KEPT.read_text(encoding="utf-8"))
    return Audit(day, [Package(*each) for each in packages])


def _asked(package: tuple[str, str]) -> Package:
    name, version = package
    try:
        page = _page(f"{name}/{version}")
        files, newest = page["urls"], version
    except HTTPError:
        page = _page(name)
        files, newest = page["releases"].get(version, []), page["info"]["version"]
    known = [each["id"] for each in page["vulnerabilities"] if not each.get("withdrawn")]
    withdrawn = bool(files) and all(file["yanked"] for file in files)
    return Package(name, version, known if newest == version else None, withdrawn)


def _page(project: str) -> Any:
    with urlopen(f"https://pypi.org/pypi/{project}/json", timeout=60.0) as answer:
        return json.load(answer)


if __name__ == "__main__":
    found = audited(locked())
    write_text(KEPT, json.dumps(found) + "\n")
    print(f"{len(found.packages)} packages, {len(found.known)} known", *found.weak, sep="\n")
