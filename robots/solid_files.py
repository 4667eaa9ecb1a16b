"""Files of the extruded body for other programs: VTK and STL, in metres, and its material."""

from pathlib import Path

import numpy as np
import pyvista

from pinnray.robots.solid_mesh import SolidMesh
from pinnray.runtime.atomic import atomic_path, write_json
from pinnray.solvers.material import Material


def write_solid(out: Path, body: SolidMesh) -> tuple[Path, Path]:
    """Write the tetrahedra as a VTK file, with 1 at the nodes of `base` and of `front`, and their surface."""
    grid = pyvista.UnstructuredGrid({pyvista.CellType.TETRA: body.tetrahedra}, body.points)
    for name in ("base", "front"):
        grid.point_data[name] = np.isin(np.arange(len(body.points)), body.nodes_on(name)).astype(np.uint8)
    files = out / "finger.vtk", out / "finger.stl"
    for path, data in zip(files, (grid, grid.extract_surface(algorithm="dataset_surface")), strict=True):
        with atomic_path(path) as partial:
            data.save(partial)
    return files


def write_material(path: Path, material: Material, density: float, loss_factor: float) -> None:
    """Write the material in SI units; the loss factor is stated, not measured."""
    content = {
        "schema": 1,
        "length_unit": "m",
        "young_Pa": 1e6 * material.young,
        "poisson": material.poisson,
        "density_kg_per_m3": density,
        "loss_factor": loss_factor,
        "substance": material.substance and material.substance.name,
    }
    write_json(path, content)
