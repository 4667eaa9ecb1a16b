"""Files for people who install, cite or package: they agree with the project's metadata and figures."""

import os
import re
import shutil
import subprocess
import tomllib
from pathlib import Path

import pytest
import yaml  # type: ignore[import-untyped]

from benchmarks.results.default_run import PAGES, TABLES, Figures, kept_figures
from benchmarks.tables import table_of

ROOT = Path(__file__).parent.parent
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]


@pytest.mark.parametrize(
    ("page", "name"),
    [(page, name) for page, tables in PAGES.items() for name in tables],
    ids=lambda value: getattr(value, "name", value),
)
def test_the_page_has_the_table_of_the_default_run(page, name):
    assert table_of(page, name) == TABLES[name](kept_figures())


@pytest.mark.slow
def test_the_figures_of_the_default_run_are_those_of_the_program():
    from pinnray import compare

    comparison = compare("default", ["fem", "fem-asm", "gp"])
    kept = {each.solver: each for each in kept_figures()}
    for evaluation in comparison.evaluations:
        own, expected = comparison.scores[evaluation.solver], kept[evaluation.solver]
        figures = own.to_truth.displacement.rel_l2, own.to_truth.von_mises.rel_l2, own.force_to_truth_rel
        assert figures == pytest.approx((expected.displacement, expected.von_mises, expected.force), rel=1e-3)


def test_the_readme_says_what_its_table_says():
    kept = {each.solver: each for each in kept_figures()}
    assert kept["pinn-asm"].displacement < kept["pinn-std"].displacement / 4  # "gets better"
    assert kept["pinn-asm"].von_mises > 4 * kept["pinn-std"].von_mises  # "much worse"
    assert all(abs(value) < 0.05 for value in kept["fem-id"][8:11])  # "finding the load helps"
    assert Figures._fields[8:11] == ("displacement", "von_mises", "force")


def test_pip_meets_the_wheel_of_dolfinx_first():
    """So that it ends before it loads gigabytes, where the extra is asked for and has no wheel."""
    first, *others = PROJECT["dependencies"]
    assert first.startswith("dolfinx-solver-real")
    assert first.endswith("; extra == 'fem'")
    assert "fem" in PROJECT["optional-dependencies"]
    assert not any("extra" in each for each in others)


def test_make_leaves_an_environment_that_it_has_not_made(tmp_path):
    """Before it installs anything: the message says how to go on with it, or without it."""
    for name in ("tools", "requirements"):
        shutil.copytree(ROOT / name, tmp_path / name)
    (tmp_path / ".venv").mkdir()
    (tmp_path / "os-release").write_text("ID=debian\nVERSION_ID=12\n")
    environment = {**os.environ, "OS_RELEASE": str(tmp_path / "os-release")}
    done = subprocess.run(
        [tmp_path / "tools/setup.sh"], env=environment, capture_output=True, text=True, check=False
    )
    assert done.returncode == 1
    assert "setup: cannot go on: the folder .venv was not made by make" in done.stderr
    assert ". .venv/bin/activate && pinnray compare" in done.stderr
    assert list((tmp_path / ".venv").iterdir()) == []


def test_the_version_is_the_same_everywhere():
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    assert citation["version"] == PROJECT["version"]
    assert citation["license"] == PROJECT["license"]
    dockerfile = (ROOT / "Dockerfile").read_text(encoding="utf-8")
    assert re.findall(r"^ARG VERSION=(.+)$", dockerfile, re.MULTILINE) == [PROJECT["version"]]
    cited = (ROOT / "docs" / "cite.md").read_text(encoding="utf-8")
    assert set(re.findall(r"\d+\.\d+\.\d+", cited)) == {PROJECT["version"]}
    assert f"year = {{{citation['date-released'].year}}}" in cited
    released = re.findall(
        r"^## \[([\d.]+)\] - (.+)$", (ROOT / "CHANGELOG.md").read_text("utf-8"), re.MULTILINE
    )
    assert released[0] == (PROJECT["version"], str(citation["date-released"]))


def test_every_citation_of_the_paper_has_an_entry():
    text, entries = (
        (ROOT / "paper" / name).read_text(encoding="utf-8") for name in ("paper.md", "paper.bib")
    )
    cited = set(re.findall(r"(?<!\w)@(\w+)", text))
    assert cited == set(re.findall(r"^@\w+\{(\w+),$", entries, re.MULTILINE))
