"""The list of every installed package that `make sbom` writes."""

import json
import re
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from urllib.error import HTTPError
from urllib.request import urlopen

import pytest

ROOT = Path(__file__).parents[1]
MAKEFILE = ROOT / "Makefile"

CLOSED = re.compile(r"AGPL|Affero|SSPL|Commons Clause|Proprietary|NonCommercial|CC-BY-NC", re.IGNORECASE)
"""Licences under which the container could not be passed on."""

UNSTATED = {"fenics-dolfinx", "graphemeu", "partd", "perf", "ply", "python-apt"}
"""Packages whose metadata have no licence; their licence files have: LGPL, MIT, BSD, GPL, BSD, GPL."""


INSTALLED = """
import json
from importlib.metadata import distributions, version
names = {each.metadata["Name"] for each in distributions()}
canonical = lambda name: name.lower().replace("_", "-").replace(".", "-")
print(json.dumps({canonical(name): version(name) for name in names}))
"""
"""Prints what a fresh process can import, of two versions the one that it does."""


@pytest.mark.release
def test_the_list_has_every_installed_package_and_no_licence_that_forbids_its_use(tmp_path):
    recipe = re.search(r"cyclonedx-bom==\S+", MAKEFILE.read_text(encoding="utf-8"))
    assert recipe
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", tmp_path / "venv"], check=True)
    pip = [sys.executable, "-m", "pip", "--python", tmp_path / "venv", "-qq", "install", "--no-compile"]
    subprocess.run([*pip, recipe.group()], check=True)
    listed = tmp_path / "sbom.json"
    maker = tmp_path / "venv" / "bin" / "cyclonedx-py"
    subprocess.run([maker, "environment", sys.executable, "--output-reproducible", "-o", listed], check=True)
    components = json.loads(listed.read_text(encoding="utf-8"))["components"]
    found = {canonical(each["name"]): each for each in components}
    installed = json.loads(subprocess.check_output([sys.executable, "-c", INSTALLED], cwd=tmp_path))
    assert {name: found[name]["version"] for name in installed if name != "pinn-ray"} == {
        name: version for name, version in installed.items() if name != "pinn-ray"
    }
    licences = {name: json.dumps(each.get("licenses", [])) for name, each in found.items()}
    assert not {name: text for name, text in licences.items() if CLOSED.search(text)}
    assert {name for name, text in licences.items() if text == "[]"} <= UNSTATED


JUDGED: set[str] = set()
"""Advisories that do not concern what this project does with the package, each with a reason here."""


@pytest.mark.release
def test_no_locked_release_has_an_advisory_or_was_withdrawn():
    locks = [path.read_text(encoding="utf-8") for path in (ROOT / "requirements").glob("debian*.txt")]
    locked = {pair for text in locks for pair in re.findall(r"^([\w.-]+)==([^\s;+]+)", text, re.MULTILINE)}
    try:
        with ThreadPoolExecutor(6) as pool:
            found = dict(zip(locked, pool.map(lambda pair: weaknesses(*pair), locked), strict=True))
    except OSError as error:
        pytest.skip(f"PyPI does not answer: {error}")
    known = {pair: weak for pair, weak in found.items() if weak is not None}
    print(f"{len(known)} of {len(found)} are known; not judged: {sorted(found.keys() - known.keys())}")
    assert known
    assert not {pair: weak for pair, weak in known.items() if not JUDGED.issuperset(weak)}


def weaknesses(name: str, version: str) -> list[str] | None:
    """Advisories of a release, and whether it was withdrawn.

    PyPI's page of a release has them; where only the page of the project can be reached, they are known
    of its newest release alone, and None of any other that was not withdrawn.
    """
    try:
        page = about(f"{name}/{version}")
        files, newest = page["urls"], version
    except HTTPError:
        page = about(name)
        files, newest = page["releases"].get(version, []), page["info"]["version"]
    withdrawn = ["withdrawn"] if files and all(file["yanked"] for file in files) else []
    if newest != version:
        return withdrawn or None
    return withdrawn + [each["id"] for each in page["vulnerabilities"] if not each.get("withdrawn")]


def about(project: str) -> dict:
    with urlopen(f"https://pypi.org/pypi/{project}/json", timeout=60.0) as answer:
        return json.load(answer)


def canonical(name: str) -> str:
    """A package's name as PEP 503 writes it."""
    return re.sub(r"[-_.]+", "-", name).lower()
