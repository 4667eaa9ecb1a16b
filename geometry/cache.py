"""Cache of meshes and CAD files, keyed by a hash of everything they depend on."""

import importlib.metadata
import os
import warnings
import zipfile
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from io import BytesIO
from pathlib import Path
from typing import TypeVar

from pinnray.geometry.drawing.description import Description
from pinnray.geometry.drawing.drawn_finger import DrawnFinger
from pinnray.geometry.finger.finger import Finger
from pinnray.geometry.mesh.settings import MeshSettings
from pinnray.geometry.mesh.triangle_mesh import TriangleMesh
from pinnray.geometry.worker import run_task
from pinnray.runtime.atomic import remove_partials, write_bytes
from pinnray.runtime.content_hash import content_hash, file_digest, sources_digest
from pinnray.runtime.errors import UserError

TIMEOUT_S = 300.0

CAD_FORMATS = ("step", "stl", "dxf", "svg")

MAKERS = ("cadquery", "cadquery-ocp", "ezdxf", "gmsh", "numpy", "svgelements")
"""Packages on whose versions the results depend."""

_Result = TypeVar("_Result")


def finger_mesh(
    finger: Finger,
    *,
    settings: MeshSettings | None = None,
    across: int | None = None,
    cache_dir: Path | None = None,
    timeout_s: float = TIMEOUT_S,
    keep: bool = True,
) -> TriangleMesh:
    """The mesh of a finger, from the cache if it was made before.

    Args:
        finger: The finger.
        settings: Element sizes; None means the mesh of the finger's file if it has one, else the default
            sizes.
        across: Least number of elements through a wall; None means that of the mesher, 3.
        cache_dir: Folder of the cache; by default `cache_folder()`.
        timeout_s: Time limit, s.
        keep: Whether the cache keeps the mesh.

    Raises:
        UserError: If meshing fails or takes too long.
    """
    if isinstance(finger, DrawnFinger):
        if finger.mesh is not None and settings is None:
            return replace(finger.mesh, depth=finger.depth)
        finger.check_materials()
    settings = settings or MeshSettings()
    task: dict[str, object] = {
        "kind": "mesh",
        "what": f"meshing design {finger.name!r}",
        "finger": finger.definition(),
        "settings": settings.model_dump(),
        **({} if across is None else {"across": across}),
    }
    entry = _entry(task, finger.digest, ".npz", cache_dir)
    return _cached(entry, task, timeout_s, TriangleMesh.load, TriangleMesh.save if keep else None)


def mesh_sizes(
    finger: Finger, asked: MeshSettings | None = None, usual: MeshSettings | None = None
) -> MeshSettings | None:
    """Element sizes for `finger_mesh`: those asked for, None for the mesh of its file, or the usual ones."""
    has_mesh = isinstance(finger, DrawnFinger) and finger.mesh is not None
    return asked or (None if has_mesh else usual or MeshSettings())


def expected_triangles(finger: Finger, settings: MeshSettings | None) -> int:
    """Number of triangles that `finger_mesh` gives: of the mesh of the finger's file, else to a tenth."""
    if isinstance(finger, DrawnFinger) and finger.mesh is not None and settings is None:
        return len(finger.mesh.triangles)
    from pinnray.geometry.mesh.element_size import estimated_triangles

    return estimated_triangles(finger, settings or MeshSettings())


def drawn_finger(
    file: Path,
    description: Description,
    *,
    cache_dir: Path | None = None,
    timeout_s: float = TIMEOUT_S,
) -> DrawnFinger:
    """The finger of a drawing, from the cache if the same file was read before.

    Args:
        file: STEP, DXF, SVG or MSH.
        description: Clamp, contact and markers; what it leaves out is the drawing's own or proposed.
        cache_dir: Folder of the cache; by default `cache_folder()`.
        timeout_s: Time limit, s.

    Raises:
        UserError: If the drawing cannot be read, is no sound section, or the description does not fit it.
    """
    if not file.is_file():
        raise UserError(f"there is no drawing {file}")
    task: dict[str, object] = {
        "kind": "drawing",
        "what": f"reading {file.name}",
        "file": str(file.absolute()),  # the child process has its own working directory
        "name": file.name,
        "description": description.model_dump(mode="json"),
    }
    entry = _entry(task, file_digest(file), ".json", cache_dir)
    return _cached(entry, task, timeout_s, DrawnFinger.load, DrawnFinger.save)


def cad_files(
    finger: Finger,
    folder: Path,
    *,
    formats: Sequence[str] = CAD_FORMATS,
    cache_dir: Path | None = None,
    timeout_s: float = TIMEOUT_S,
) -> list[Path]:
    """Write a finger's CAD files: solid as STEP and STL (body and markers), section as DXF and SVG.

    Args:
        finger: The finger.
        folder: Output folder; made if it does not exist.
        formats: Some of `CAD_FORMATS`.
        cache_dir: Folder of the cache; by default `cache_folder()`.
        timeout_s: Time limit, s.

    Returns:
        The files written.

    Raises:
        UserError: If a format is unknown, or CAD fails or takes too long.
    """
    unknown = sorted(set(formats) - set(CAD_FORMATS))
    if unknown:
        raise UserError(f"unknown CAD format {unknown[0]!r}; there are {', '.join(CAD_FORMATS)}")
    task: dict[str, object] = {
        "kind": "cad",
        "what": f"CAD of design {finger.name!r}",
        "finger": finger.definition(),
        "formats": sorted(set(formats)),
    }
    entry = _entry(task, finger.digest, ".zip", cache_dir)
    contents = _cached(entry, task, timeout_s, _unpack, _pack)
    for name, content in contents.items():
        write_bytes(folder / name, content)
    return [folder / name for name in contents]


def cache_folder() -> Path:
    """`PINNRAY_CACHE` if set, else `pinn-ray` in `XDG_CACHE_HOME` or `~/.cache`."""
    if chosen := os.environ.get("PINNRAY_CACHE"):
        return Path(chosen)
    return Path(os.environ.get("XDG_CACHE_HOME") or Path("~/.cache").expanduser()) / "pinn-ray"


@contextmanager
def kept_if_possible(folder: Path, what: str) -> Iterator[None]:
    """Warn, if the block cannot write to the cache `folder`, that `what` has to be done again next time."""
    try:
        yield
    except OSError as error:
        warnings.warn(
            f"cannot write to the cache folder {folder} ({error.strerror}), so that {what} is repeated next "
            "time; set PINNRAY_CACHE to a folder that can be written",
            RuntimeWarning,
            stacklevel=4,
        )


def cache_key(digest: str, task: dict[str, object]) -> str:
    """SHA-256 over a finger's or file's digest, task, package versions and this package's own sources."""
    kept = {key: value for key, value in task.items() if key not in ("what", "finger", "file")}
    parts = {
        "content": digest,
        "task": kept,
        "versions": {package: _version(package) for package in MAKERS},
        "sources": sources_digest(__name__),
    }
    return content_hash(parts)


def _entry(task: dict[str, object], digest: str, suffix: str, cache_dir: Path | None) -> Path:
    return (cache_dir or cache_folder()) / f"{task['kind']}-{cache_key(digest, task)}{suffix}"


def _cached(
    entry: Path,
    task: dict[str, object],
    timeout_s: float,
    load: Callable[[Path], _Result],
    save: Callable[[_Result, Path], None] | None,
) -> _Result:
    """Load a task's result; make it first if it is missing or cannot be read."""
    if entry.exists():
        try:
            return load(entry)
        except Exception as error:  # a damaged file can make the reader raise anything
            warnings.warn(
                f"rebuilding {entry.name}: the cached file is damaged ({type(error).__name__})",
                RuntimeWarning,
                stacklevel=3,
            )
    made: _Result = run_task(task, timeout_s)
    if save:
        with kept_if_possible(entry.parent, str(task["what"])):
            remove_partials(entry.parent, older_than_s=86_400.0)  # after a day its process has ended
            save(made, entry)
    return made


def _pack(contents: dict[str, bytes], path: Path) -> None:
    buffer = BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in contents.items():
            archive.writestr(name, content)
    write_bytes(path, buffer.getvalue())


def _unpack(path: Path) -> dict[str, bytes]:
    with zipfile.ZipFile(path) as archive:
        if any(Path(name).name != name for name in archive.namelist()):
            raise ValueError("a file of another folder")
        return {name: archive.read(name) for name in archive.namelist()}


def _version(package: str) -> str:
    try:
        return importlib.metadata.version(package)
    except importlib.metadata.PackageNotFoundError:
        return "unknown"
