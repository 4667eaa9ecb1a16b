"""Fixtures that the tests of several folders share."""

import gc
import hashlib
import os
import pickle
import resource
import signal
import subprocess
import sys
from collections.abc import Callable, Generator, Iterator, Mapping
from functools import partial
from pathlib import Path
from typing import Any

import pytest

from pinnray.geometry.cache import finger_mesh
from pinnray.geometry.finger.design import Design
from pinnray.geometry.mesh.settings import MeshSettings
from pinnray.geometry.mesh.triangle_mesh import TriangleMesh

os.environ["PETSC_OPTIONS"] = (
    "-no_signal_handler"  # whoever loads PETSc first: a closed pipe would end a worker, and hang them all
)

os.environ.setdefault("XDG_CACHE_HOME", str(Path.home() / ".cache"))  # so that no test's cache becomes theirs
os.environ.setdefault("MPLCONFIGDIR", str(Path.home() / ".cache" / "matplotlib"))

PLUGIN = Path(__file__).parent / "solvers" / "plugin"


def pytest_collection_finish() -> None:
    """What is loaded by now stays: the search for garbage, 3 % of the time, need not look at it."""
    gc.freeze()


@pytest.fixture(scope="session", autouse=True)
def without_waiting_for_the_disk() -> Iterator[None]:
    """Files need not be on the disk: no test cuts the power, and thousands of files take minutes."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(os, "fsync", lambda _: None)
        yield


@pytest.fixture
def full_disk() -> Iterator[None]:
    """No file may become longer than 4096 bytes: writing fails as on a full disk, in libraries, too."""
    before, handler = resource.getrlimit(resource.RLIMIT_FSIZE), signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (4096, before[1]))
    yield
    resource.setrlimit(resource.RLIMIT_FSIZE, before)
    signal.signal(signal.SIGXFSZ, handler)


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
    """The default finger with elements of 1 mm, two across its walls: a third of the usual unknowns."""
    return finger_mesh(Design(), settings=MeshSettings(size=1.0), across=1)


@pytest.fixture(scope="session")
def usual_mesh() -> TriangleMesh:
    """The same with the three elements across walls that a user has."""
    return finger_mesh(Design(), settings=MeshSettings(size=1.0), across=3)


@pytest.fixture
def few_elements(monkeypatch: pytest.MonkeyPatch) -> None:
    """Walls get the elements that their size asks for, not three at least: half to a fifth of the nodes."""
    monkeypatch.setitem(finger_mesh.__kwdefaults__, "across", 1)


@pytest.fixture(scope="module")
def few_elements_throughout() -> Iterator[None]:
    """The same for all of a module, with its own fixtures."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(finger_mesh.__kwdefaults__, "across", 1)
        yield


@pytest.fixture
def without_pictures(monkeypatch: pytest.MonkeyPatch) -> None:
    """Pictures take most of the time of a small run, and have tests of their own."""
    monkeypatch.setattr("pinnray.comparison.pipeline.pipeline.draw_all", lambda *_: [])


def inline(
    _: object,
    work: Callable,
    tasks: Mapping[str, object],
    report: Callable[..., None] = lambda *_: None,
    **__: object,
) -> Generator:
    """Stands for `Pool.answers`: tasks run one after the other in this process."""
    for name, each in tasks.items():
        yield name, work(each, partial(report, name))


@pytest.fixture
def in_line(monkeypatch: pytest.MonkeyPatch) -> None:
    """No other process is started, which would import for seconds."""
    monkeypatch.setattr("pinnray.runtime.processes.pool.Pool.answers", inline)


@pytest.fixture(scope="session")
def discs_fitted_once() -> Iterator[None]:
    """Discs are not fitted again in a picture where they were: tests share films, and it takes longest."""
    from pinnray.vision.discs import disc_detector

    fit, known = disc_detector.fit_discs, {}  # type: ignore[attr-defined]

    def fitted(*what: Any, **options: Any) -> object:
        key = hashlib.sha256(pickle.dumps((what, options))).digest()
        if key not in known:
            known[key] = fit(*what, **options)
        return known[key]

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(disc_detector, "fit_discs", fitted)
        yield
