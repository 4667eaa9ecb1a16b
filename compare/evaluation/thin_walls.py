"""Remarks on a wall that is thin for the elements, or for the finger's other walls."""

import numpy as np

from geometry.section.thickness import wall_thickness
from solvers.problem import Problem

LEAST_ACROSS = 1.5
"""Elements across a wall below which its bending is told to be unresolved: less than two."""
NECK = 0.2
"""Thickness of a wall over the median wall's below which it is told: such a neck is a hinge. The walls of
finger rays, printed or drawn, have 0.24 or more."""


def wall_remarks(problem: Problem) -> list[str]:
    """A remark on the thinnest wall of a problem's finger, if it is a neck or has too few elements across."""
    if problem.finger is None:
        return []
    section, mesh = problem.finger.section, problem.mesh
    extent = float(np.ptp(section.bounds, axis=0).max())
    points, thickness = wall_thickness(section, extent / 400)
    if not len(points):
        return []
    least, usual = float(thickness.min()), float(np.median(thickness))
    where = points[thickness.argmin()]
    corners = mesh.points[mesh.triangles]
    longest = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
    away = np.linalg.norm(corners.mean(axis=1) - where, axis=1)
    height = float(np.median((2 * mesh.areas / longest)[away <= max(least, away.min())]))
    across = least / height
    if across >= LEAST_ACROSS and least >= NECK * usual:
        return []
    count = max(round(across), 1)
    said = f"wall of {least:.2g} mm at ({where[0]:.4g}, {where[1]:.4g}) mm"
    if least < NECK * usual:
        said += f", {least / usual:.1g} of the median wall's {usual:.3g} mm"
    said += f": {count} element{'s' if count > 1 else ''} of {height:.2g} mm across it"
    if across < LEAST_ACROSS:
        return [f"{said}, too few for the stress of its bending; take a mesh with at least two there"]
    return [f"{said}; a neck bends as a hinge, its stiffness with its thickness cubed: see that it is meant"]
