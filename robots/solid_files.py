"""Files of the extruded body for other programs: Gmsh 2.2, VTK and STL, in metres, and its material."""

from pathlib import Path
from typing import Any

import numpy as np
import pyvista

from pinnray.robots.solid_mesh import SolidMesh
from pinnray.runtime.atomic import atomic_path, write_json, write_text
from pinnray.solvers.physics import Material

GROUPS = ("base", "front")
"""Boundaries that are physical groups of triangles; `body` is the group of all tetrahedra."""


def write_msh(path: Path, body: SolidMesh) -> None:
    """Write the tetrahedra and the triangles of `GROUPS` as Gmsh's format 2.2, which most simulators read."""
    names = [*(f'2 {group} "{name}"' for group, name in enumerate(GROUPS, 1)), f'3 {len(GROUPS) + 1} "body"']
    nodes = [f"{number} {x:.9g} {y:.9g} {z:.9g}" for number, (x, y, z) in enumerate(body.points.tolist(), 1)]
    kinds = [(2, body.faces_on(name)) for name in GROUPS] + [(4, body.tetrahedra)]
    elements = [
        f"{kind} 2 {group} {group} {' '.join(map(str, row))}"
        for group, (kind, cells) in enumerate(kinds, 1)
        for row in (cells + 1).tolist()
    ]
    numbered = [f"{number} {line}" for number, line in enumerate(elements, 1)]
    blocks: list[tuple[str, list[str]]] = [
        ("MeshFormat", ["2.2 0 8"]),
        ("PhysicalNames", [str(len(names)), *names]),
        ("Nodes", [str(len(nodes)), *nodes]),
        ("Elements", [str(len(numbered)), *numbered]),
    ]
    write_text(path, "".join("\n".join([f"${name}", *lines, f"$End{name}\n"]) for name, lines in blocks))


def write_vtk(path: Path, body: SolidMesh) -> None:
    """Write the tetrahedra as a VTK file."""
    grid = pyvista.UnstructuredGrid({pyvista.CellType.TETRA: body.tetrahedra}, body.points)
    with atomic_path(path) as partial:
        grid.save(partial)


def write_surface(path: Path, body: SolidMesh) -> None:
    """Write the surface, for programs that make tetrahedra of their own."""
    faces = np.insert(body.skin, 0, 3, axis=1)
    with atomic_path(path) as partial:
        pyvista.PolyData(body.points, faces.ravel()).save(partial)


def write_material(path: Path, material: Material, density: float, loss_factor: float) -> None:
    """Write the material in SI units; the loss factor is stated, not measured."""
    content: dict[str, Any] = {
        "schema": 1,
        "length_unit": "m",
        "young_Pa": 1e6 * material.young,
        "poisson": material.poisson,
        "density_kg_per_m3": density,
        "loss_factor": loss_factor,
        "substance": material.substance and material.substance.name,
    }
    write_json(path, content)
