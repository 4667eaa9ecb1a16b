"""Cache and worker: quick hits, damaged entries, time limits, one-line failures."""

import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from pinnray.geometry import Design, MeshSettings, UserError, cache, finger_mesh
from pinnray.geometry.cache import cache_key, drawn_finger
from pinnray.geometry.drawing.description import Description
from pinnray.geometry.mesh.triangle_mesh import TriangleMesh
from pinnray.runtime.cache import cache_folder, check_writable, share_cache
from pinnray.runtime.processes.pool import Pool, child_environment
from pinnray.runtime.processes.worker import ChildCall, perform

COARSE = MeshSettings(size=1.5, coarsening=2)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    folder = tmp_path_factory.mktemp("cache")
    abandoned = folder / ".mesh-0.0123abcd.partial.npz"
    abandoned.write_bytes(b"half of a mesh")
    os.utime(abandoned, (0, 0))
    with pytest.MonkeyPatch.context() as monkeypatch:
        monkeypatch.setenv("PINNRAY_CACHE", str(folder))
        finger_mesh(Design(), settings=COARSE)
        yield folder


def test_second_call_is_read_from_the_cache(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("pinnray.geometry.cache.run_task", None)  # a second run would fail
    mesh = finger_mesh(Design(name="another-name"), settings=COARSE)
    assert len(mesh.markers) == 9


def test_nothing_but_the_result_is_left_in_the_cache(folder: Path) -> None:
    assert [path.suffix for path in folder.iterdir()] == [".npz"]


def test_worker_gives_the_same_mesh_as_meshing_here(folder: Path) -> None:
    from pinnray.geometry.mesh.mesher import build_mesh

    assert finger_mesh(Design(), settings=COARSE).digest == build_mesh(Design(), COARSE).digest


@pytest.mark.parametrize(
    "damage",
    [
        lambda content: b"",  # empty
        lambda content: content[: len(content) // 2],  # cut off
        lambda content: content[:3000] + bytes(64) + content[3064:],  # a few bytes lost
        lambda content: b"not an archive at all",
    ],
)
def test_damaged_entry_is_rebuilt_with_a_warning(folder: Path, damage, monkeypatch) -> None:
    (entry,) = folder.glob("mesh-*.npz")
    good, mesh = entry.read_bytes(), TriangleMesh.load(entry)
    rebuilt = []

    def run(task, timeout_s):
        rebuilt.append(task.what)
        return mesh

    monkeypatch.setattr("pinnray.geometry.cache.run_task", run)
    entry.write_bytes(damage(good))
    with pytest.warns(RuntimeWarning, match="rebuilding mesh-.* is damaged"):
        finger_mesh(Design(), settings=COARSE)
    assert rebuilt == ["meshing design 'default'"]
    assert entry.read_bytes() == good


def test_key_follows_everything_the_mesh_depends_on(monkeypatch: pytest.MonkeyPatch) -> None:
    def key(design: Design | None = None, **settings: float) -> str:
        return cache_key((design or Design()).digest, MeshSettings(**settings).model_dump())

    keys = {key(), key(Design(rib_angle=19)), key(size=0.3), key(corner_size=0.1)}
    monkeypatch.setattr("pinnray.geometry.cache.package_version", lambda package: "0")
    keys.add(key())
    assert len(keys) == 5
    assert key(Design(name="x")) in keys


@pytest.mark.slow
def test_time_limit_ends_the_worker_with_advice(tmp_path: Path, monkeypatch) -> None:
    monkeypatch.setattr("pinnray.geometry.cache.TIMEOUT_S", 0.5)
    monkeypatch.setenv("PINNRAY_CACHE", str(tmp_path))
    with pytest.raises(UserError, match=r"meshing design 'default' was ended after 0\.5 s; use larger"):
        finger_mesh(Design(), settings=MeshSettings(size=0.02))
    assert list(tmp_path.iterdir()) == []


def test_the_worker_stays_and_follows_a_change_of_folder(tmp_path, monkeypatch):
    monkeypatch.setenv("PINNRAY_CACHE", str(tmp_path / "first"))
    finger_mesh(Design(), settings=COARSE)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("PINNRAY_CACHE", "second")
    (tmp_path / "beam.svg").write_text(
        '<svg xmlns="http://www.w3.org/2000/svg" width="60mm" height="10mm" viewBox="0 0 60 10">'
        '<path d="M 0 0 H 60 V 10 H 0 Z"/></svg>'
    )
    drawn = drawn_finger(Path("beam.svg"), Description())
    assert drawn.section.area == pytest.approx(600)
    assert finger_mesh(drawn, settings=COARSE).areas.sum() == pytest.approx(600)


@pytest.mark.parametrize("place", ["/proc/cache", "/dev/null/cache"])
@pytest.mark.parametrize("variable", ["PINNRAY_CACHE", "XDG_CACHE_HOME", "HOME"])
def test_where_no_cache_can_be_written_a_temporary_one_serves_libraries_too(
    variable: str, place: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("PINNRAY_CACHE", "XDG_CACHE_HOME", "MPLCONFIGDIR"):
        monkeypatch.setenv(name, "")  # so that it is as before, afterwards
        monkeypatch.delenv(name)
    monkeypatch.setenv(variable, place)
    with pytest.warns(RuntimeWarning, match=r"cannot write to the cache .* set PINNRAY_CACHE to a folder"):
        share_cache()
    folder = cache_folder()  # warns no more
    check_writable(folder)
    assert os.environ["XDG_CACHE_HOME"] == str(folder)
    assert os.environ["MPLCONFIGDIR"] == str(folder / "matplotlib")


def test_a_full_cache_is_a_warning_and_the_mesh_is_there(tmp_path: Path, monkeypatch) -> None:
    def full(mesh: TriangleMesh, path: Path) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(TriangleMesh, "save", full)
    monkeypatch.setenv("PINNRAY_CACHE", str(tmp_path))
    with pytest.warns(RuntimeWarning, match=r"cache folder .* \(No space left on device\), .* is repeated"):
        mesh = finger_mesh(Design(), settings=COARSE)
    assert len(mesh.markers) == 9


@pytest.mark.parametrize(
    ("task", "end"),
    [
        (ChildCall("this", cache._mesher, (Design(), COARSE, None)), ": File too large"),
        # OpenCASCADE writes a part and says nothing
        pytest.param(
            ChildCall("this", cache._cad_writer, (Design(), ["step"])),
            "/finger.step: a part was not written; is the disk full?",
            marks=pytest.mark.slow,
        ),
    ],
    ids=["mesh", "cad"],
)
def test_a_full_disk_in_the_worker_names_the_place(full_disk, task, end):
    with Pool(1) as pool:  # a new process, which inherits the full disk
        ((_, answer),) = pool.answers(perform, {"this": (task, 8.0)})
    assert str(answer).startswith("this failed: /")
    assert str(answer).endswith(end)


@pytest.mark.parametrize(
    ("variables", "expected"),
    [
        ({"PINNRAY_CACHE": "a", "XDG_CACHE_HOME": "b"}, "a"),  # ours wins
        ({"XDG_CACHE_HOME": "b"}, "b/pinn-ray"),
        ({"HOME": "me"}, "me/.cache/pinn-ray"),
    ],
)
def test_cache_folder(variables: dict[str, str], expected: str, tmp_path: Path, monkeypatch) -> None:
    for name in ("PINNRAY_CACHE", "XDG_CACHE_HOME"):
        monkeypatch.delenv(name, raising=False)
    for name, value in variables.items():
        monkeypatch.setenv(name, str(tmp_path / value))
    assert cache_folder() == tmp_path / expected


def test_import_needs_neither_cadquery_nor_gmsh() -> None:
    code = (
        "import sys; from pinnray import geometry\n"
        "geometry.load_design('stiff'); geometry.finger_mesh\n"
        "print(*({'cadquery', 'gmsh', 'OCP'} & set(sys.modules)))"
    )
    done = subprocess.run(
        [sys.executable, "-c", code],
        env=child_environment(os.environ),
        capture_output=True,
        text=True,
        check=True,
    )
    assert done.stdout.strip() == ""


def test_every_public_name_can_be_imported() -> None:
    from pinnray import geometry

    for name in geometry.__all__:  # type: ignore[attr-defined]
        assert getattr(geometry, name) is not None
    with pytest.raises(AttributeError, match="nothing"):
        _ = geometry.nothing  # type: ignore[attr-defined]
