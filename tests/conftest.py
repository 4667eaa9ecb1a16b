"""What the tests of several folders share."""

import subprocess
import sys
from pathlib import Path

import pytest

from geometry.cache import finger_mesh
from geometry.design import Design
from geometry.mesh import TriangleMesh
from geometry.settings import MeshSettings

PLUGIN = Path(__file__).parent / "solvers" / "plugin"


@pytest.fixture(scope="session")
def plugin_folder(tmp_path_factory) -> Path:
    """A folder where pip has installed the solver package that lives in the tests."""
    folder = tmp_path_factory.mktemp("site")
    subprocess.run(
        [
            *(sys.executable, "-m", "pip", "install", "-q", "--no-deps", "--no-build-isolation"),
            *("--target", str(folder), str(PLUGIN)),
        ],
        check=True,
        capture_output=True,
    )
    return folder


@pytest.fixture(scope="session")
def coarse_mesh() -> TriangleMesh:
    """The default finger with elements of 1 mm."""
    return finger_mesh(Design(), settings=MeshSettings(size=1.0))
