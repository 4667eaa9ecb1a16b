"""Files of the extruded body for other programs: VTK and STL, in metres, and its material."""

from pathlib import Path
from typing import Any

import numpy as np
import pyvista

from pinnray.robots.solid_mesh import SolidMesh
from pinnray.runtime.atomic import atomic_path, write_json
from pinnray.solvers.physics import Material


def write_vtk(path: Path, body: SolidMesh) -> None:
    """Write the tetrahedra as a VTK file, with 1 at the nodes of `base` and of `front`."""
    grid = pyvista.UnstructuredGrid({pyvista.CellType.TETRA: body.tetrahedra}, body.points)
    for name in ("base", "front"):
        grid.point_data[name] = np.isin(np.arange(len(body.points)), body.nodes_on(name)).astype(np.uint8)
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
