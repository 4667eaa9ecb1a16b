"""Time of a mesh: the section given to Gmsh directly, through the child process, and by way of CadQuery.

CadQuery writes the face as BREP, which Gmsh imports; element sizes are the same. Its import, once a process,
is given apart. Every time is the least of five, in a process that is running. Allow half a minute.
"""

import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path

import gmsh
from rich.table import Table

from geometry.cache import finger_mesh
from geometry.finger.design import Design
from geometry.mesh.element_size import TRIES, set_sizes, size_field
from geometry.mesh.gmsh_model import session
from geometry.mesh.mesher import build_mesh
from geometry.mesh.settings import MeshSettings

SIZES = (0.25, 1.0)
REPEATS = 5


def main() -> Table:
    """Mesh the default finger in three ways."""
    from geometry.cad import section_face

    design = Design()
    table = Table(title=f"Meshing the default finger, s; importing CadQuery takes {import_time():.1f} s more")
    for column in ("size, mm", "nodes", "directly", "by the child process", "by CadQuery", "ratio"):
        table.add_column(column, justify="right")
    for size in SIZES:
        settings = MeshSettings(size=size)
        directly = least(partial(build_mesh, design, settings))
        child = least(partial(uncached, design, settings))
        cad = least(partial(through_brep, design, settings, section_face))
        nodes = len(build_mesh(design, settings).points)
        times = (f"{seconds:.3f}" for seconds in (directly, child, cad))
        table.add_row(f"{size:g}", str(nodes), *times, f"{cad / directly:.2f}")
    return table


def least(task: Callable[[], object]) -> float:
    """Least wall time of some runs, s, after one that does not count."""
    task()
    seconds = []
    for _ in range(REPEATS):
        start = time.perf_counter()
        task()
        seconds.append(time.perf_counter() - start)
    return min(seconds)


def uncached(design: Design, settings: MeshSettings) -> None:
    """The mesh through the cache and its child process, made anew."""
    with tempfile.TemporaryDirectory() as folder:
        finger_mesh(design, settings=settings, cache_dir=Path(folder))


def through_brep(design: Design, settings: MeshSettings, face: Callable[[Design], object]) -> None:
    """Triangles by way of a BREP file, without names of boundaries."""
    contact = [design.section.front_point(x) for x in (*design.contact_ends, design.contact_abscissa)]
    field = size_field(design.section, contact, settings, TRIES[0])
    with tempfile.TemporaryDirectory() as folder, session():
        brep = Path(folder) / "section.brep"
        face(design).exportBrep(str(brep))
        faces = gmsh.model.occ.importShapes(str(brep))
        points = [gmsh.model.occ.addPoint(x, y, 0) for x, y in [*contact, *design.markers]]
        gmsh.model.occ.fragment(faces, [(0, tag) for tag in points])
        gmsh.model.occ.synchronize()
        set_sizes(field, [], settings, Path(folder))
        gmsh.model.mesh.generate(2)


def import_time() -> float:
    """Wall time of importing CadQuery in a new process, less that of an empty one, s."""

    def run(code: str) -> float:
        start = time.perf_counter()
        subprocess.run([sys.executable, "-c", code], check=True)
        return time.perf_counter() - start

    return run("import cadquery") - run("pass")
