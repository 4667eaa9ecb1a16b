"""The number of elements across the thinnest wall or rib."""

import numpy as np

from geometry.mesh.boundary import boundary_loops
from geometry.mesh.triangle_mesh import TriangleMesh


def elements_across(mesh: TriangleMesh) -> int:
    """The fewest element edges on any way from one closed boundary to another.

    Each wall lies between the outline and a cell and each rib between two cells, so this is the number of
    elements across the thinnest place, counted along the mesh's own edges.
    """
    loop_of = np.full(len(mesh.points), -1)
    for which, loop in enumerate(boundary_loops(mesh)):
        loop_of[loop] = which
    steps = np.where(loop_of >= 0, 0, -1)
    ends = np.concatenate([mesh.edges, mesh.edges[:, ::-1]])
    level = 0
    while True:
        start, stop = loop_of[ends[:, 0]], loop_of[ends[:, 1]]
        met = (start >= 0) & (stop >= 0) & (start != stop)
        if met.any():
            return int((steps[ends[met, 0]] + steps[ends[met, 1]]).min()) + 1
        fresh = ends[(start >= 0) & (stop < 0)]
        if not len(fresh):
            return level
        level += 1
        loop_of[fresh[:, 1]] = loop_of[fresh[:, 0]]
        steps[fresh[:, 1]] = level
