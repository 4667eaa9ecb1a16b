"""Files of the extruded body for other programs: VTK and STL, in metres."""

from pathlib import Path

import numpy as np
import pyvista

from pinnray.robots.solid_mesh import SolidMesh
from pinnray.runtime.atomic import atomic_path


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
