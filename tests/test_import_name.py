"""One import name: what is installed, and modules of the user's called like the program's folders."""

import importlib.util
import os
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

import pinnray as pr
from tests.program import ROOMS, ROOT

SCRIPT = """
import pinnray as pr

import pinnray.comparison.evaluation.metrics

assert len(pr.mesh(size=2.0).points) > 0
assert "fem" in pr.solver_names()
assert callable(pr.compare)
print(pr.__file__)
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A script of the user's beside modules that end every program which imports them."""
    for name in {room.name for room in ROOMS} | {room.resolve().name for room in ROOMS}:
        (tmp_path / f"{name}.py").write_text("raise RuntimeError('the module of the user')\n")
    (tmp_path / "solvers.py").unlink()
    (tmp_path / "solvers").mkdir()
    (tmp_path / "solvers" / "__init__.py").write_text("raise RuntimeError('the package of the user')\n")
    (tmp_path / "script.py").write_text(SCRIPT)
    return tmp_path


def run(folder: Path, **environment: str) -> str:
    """The last line that the script prints."""
    done = subprocess.run(
        [sys.executable, "-W", "ignore", "script.py"],
        cwd=folder,
        env={**os.environ, **environment},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout.splitlines()[-1]


def test_modules_of_the_user_are_in_nobodys_way(folder):
    assert Path(run(folder)) == ROOT / "pinnray" / "__init__.py"


@pytest.mark.release  # builds a wheel and installs it
def test_the_wheel_has_one_name_and_leaves_the_users_modules_alone(folder, tmp_path_factory):
    work = tmp_path_factory.mktemp("wheel")
    listed = subprocess.run(
        ["git", "ls-files", "--cached", "--others", "--exclude-standard"],
        cwd=ROOT,
        capture_output=True,
        text=True,
    )
    source = work / "source"
    for name in listed.stdout.splitlines():
        if (ROOT / name).exists() and not name.startswith(("tests/", "docs/")):
            (source / name).parent.mkdir(parents=True, exist_ok=True)
            (source / name).symlink_to(ROOT / name) if (ROOT / name).is_dir() else os.link(
                ROOT / name, source / name
            )
    pip = [sys.executable, "-m", "pip", "-q", "--disable-pip-version-check"]
    built = ["wheel", "--no-deps", "--no-build-isolation", "-w", str(work), str(source)]
    subprocess.run([*pip, *built], check=True, capture_output=True)
    (wheel,) = work.glob("*.whl")
    names = zipfile.ZipFile(wheel).namelist()
    assert {name.partition("/")[0] for name in names if ".dist-info/" not in name} == {"pinnray"}
    places = {str(Path(name).parent) for name in names}
    assert places >= {f"pinnray/{room.name}" for room in ROOMS}
    site = work / "site"
    subprocess.run([*pip, "install", "--no-deps", "--target", str(site), str(wheel)], check=True)
    assert sorted(path.name for path in site.iterdir() if path.suffix != ".dist-info") == ["bin", "pinnray"]
    assert Path(run(folder, PYTHONPATH=str(site))) == site / "pinnray" / "__init__.py"


def test_no_public_name_is_that_of_a_package_or_module():
    """Importing the one would put it in the place of the other, as `pinnray.compare` once did."""
    found = [name for name in pr.__all__ if importlib.util.find_spec(f"pinnray.{name}") is not None]  # type: ignore[attr-defined]
    assert found == []
