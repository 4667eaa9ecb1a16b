"""Cache of meshes and drawings, keyed by a hash of everything they depend on."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

from pinnray.geometry.drawing.description import Description
from pinnray.geometry.drawing.drawn_finger import DrawnFinger
from pinnray.geometry.finger.finger import Finger
from pinnray.geometry.mesh.settings import MeshSettings
from pinnray.geometry.mesh.triangle_mesh import TriangleMesh
from pinnray.runtime.atomic import write_bytes
from pinnray.runtime.cache import cache_folder, cached
from pinnray.runtime.content_hash import content_hash, file_digest, sources_digest
from pinnray.runtime.errors import UserError
from pinnray.runtime.machine import package_version
from pinnray.runtime.processes.worker import ChildCall, run_task

TIMEOUT_S = 300.0
"""Time limit of a process that meshes, reads or writes."""

CAD_FORMATS = ("step", "stl", "dxf")

MAKERS = ("cadquery", "cadquery-ocp", "ezdxf", "gmsh", "numpy", "svgelements")
"""Packages on whose versions the results depend."""


def finger_mesh(
    finger: Finger, *, settings: MeshSettings | None = None, across: int | None = None, keep: bool = True
) -> TriangleMesh:
    """The mesh of a finger, from the cache if it was made before.

    Args:
        finger: The finger.
        settings: Element sizes; None means the mesh of the finger's file if it has one, else the default
            sizes.
        across: Least number of elements through a wall; None means that of the mesher, 3.
        keep: Whether the cache keeps the mesh.

    Raises:
        UserError: If meshing fails or takes too long.
    """
    if isinstance(finger, DrawnFinger) and finger.mesh is not None and settings is None:
        return replace(finger.mesh, depth=finger.depth)
    settings = settings or MeshSettings()
    task = ChildCall(f"meshing design {finger.name!r}", _mesher, (finger, settings, across))
    entry = cache_folder() / f"mesh-{cache_key(finger.digest, (settings.model_dump(), across))}.npz"
    save = TriangleMesh.save if keep else None
    mesh: TriangleMesh = cached(entry, task.what, lambda: run_task(task, TIMEOUT_S), TriangleMesh.load, save)
    return mesh


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


def drawn_finger(file: Path, description: Description) -> DrawnFinger:
    """The finger of a drawing, from the cache if the same file was read before.

    Args:
        file: STEP, DXF, SVG or MSH.
        description: Clamp, contact and markers; what it leaves out is the drawing's own or proposed.

    Raises:
        UserError: If the drawing cannot be read, is no sound section, or the description does not fit it.
    """
    if not file.is_file():
        raise UserError(f"there is no drawing {file}")
    lines = description.model_dump(mode="json")
    # The child has its own folder.
    task = ChildCall(f"reading {file.name}", _reader, (file.absolute(), lines))
    entry = cache_folder() / f"drawing-{cache_key(file_digest(file), (file.name, lines))}.pickle"
    found: DrawnFinger = cached(entry, task.what, lambda: run_task(task, TIMEOUT_S))
    return found


def cad_files(finger: Finger, folder: Path, *, formats: Sequence[str] = CAD_FORMATS) -> list[Path]:
    """Write a finger's CAD files: solid as STEP and STL (body and markers), section as DXF.

    Args:
        finger: The finger.
        folder: Output folder; made if it does not exist.
        formats: Some of `CAD_FORMATS`.

    Returns:
        The files written.

    Raises:
        UserError: If a format is unknown, or CAD fails or takes too long.
    """
    unknown = sorted(set(formats) - set(CAD_FORMATS))
    if unknown:
        raise UserError(f"unknown CAD format {unknown[0]!r}; there are {', '.join(CAD_FORMATS)}")
    task = ChildCall(f"CAD of design {finger.name!r}", _cad_writer, (finger, sorted(set(formats))))
    contents: dict[str, bytes] = run_task(task, TIMEOUT_S)
    for name, content in contents.items():
        write_bytes(folder / name, content)
    return [folder / name for name in contents]


def cache_key(digest: str, asked: object) -> str:
    """SHA-256 over the digest of a finger or file, what is asked, package versions and the sources."""
    versions = {package: package_version(package) for package in MAKERS}
    parts = {"content": digest, "asked": asked, "versions": versions, "sources": sources_digest(__name__)}
    return content_hash(parts)


def _mesher() -> Callable[..., TriangleMesh]:
    from pinnray.geometry.mesh.mesher import build_mesh

    return build_mesh


def _reader() -> Callable[..., DrawnFinger]:
    from pinnray.geometry.drawing.load import finger_from_file

    return lambda file, lines: finger_from_file(file, Description(**lines))


def _cad_writer() -> Callable[..., dict[str, bytes]]:
    from pinnray.geometry.cad import cad_contents

    return cad_contents
