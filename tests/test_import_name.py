"""One import name: modules of the user's called like the program's folders."""

import importlib.util
import subprocess
import sys
from pathlib import Path

import pytest

import pinnray as pr
from tests.program import ROOMS, ROOT

SCRIPT = """
import pinnray as pr

import pinnray.comparison.evaluation.metrics

assert len(pr.mesh(size=4.0).points) > 0
assert callable(pr.compare) and "fem" in pr.solver_names()
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


def test_modules_of_the_user_are_in_nobodys_way(folder):
    """`.ci/wheel` has the same of what is installed."""
    done = subprocess.run(
        [sys.executable, "-W", "ignore", "script.py"], cwd=folder, capture_output=True, text=True, check=False
    )
    assert (done.returncode, done.stderr) == (0, "")
    assert Path(done.stdout.splitlines()[-1]) == ROOT / "pinnray" / "__init__.py"


def test_no_public_name_is_that_of_a_package_or_module():
    """Importing the one would put it in the place of the other, as `pinnray.compare` once did."""
    found = [name for name in pr.__all__ if importlib.util.find_spec(f"pinnray.{name}") is not None]  # type: ignore[attr-defined]
    assert found == []
