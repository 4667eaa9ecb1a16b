"""Element sizes: fine in walls and ribs, finer at corners and contact if asked, growing into solid parts.

Walls and ribs are found by rays through the material, so that any section will do.
"""

import numpy as np
import shapely
from scipy.ndimage import distance_transform_edt

from pinnray.geometry.finger.finger import Finger
from pinnray.geometry.mesh.settings import MeshSettings
from pinnray.geometry.section.section import Section
from pinnray.geometry.section.thickness import wall_thickness
from pinnray.runtime.arrays import FloatArray

TRIES = (3.6, 4.8, 6.4)
"""Thickness over element size: the first that gives `MIN_ELEMENTS` of the mesher is taken."""


def estimated_triangles(finger: Finger, settings: MeshSettings) -> int:
    """Number of triangles of a finger's mesh, estimated from the size field to a tenth, without meshing."""
    sizes, origin, spacing = size_field(finger.section, contact_points(finger), settings, TRIES[0])
    x, y = np.indices(sizes.shape) * spacing + origin[:, None, None]
    inside = shapely.contains_xy(finger.section.polygon, x, y)
    return round(float((spacing**2 / (np.sqrt(3) / 4 * sizes[inside] ** 2)).sum()))


def contact_points(finger: Finger) -> FloatArray:
    """Ends and middle of the contact, shape (3, 2), mm."""
    low, high = finger.contact_ends
    return np.array([finger.section.front_point(x) for x in (low, finger.contact_abscissa, high)])


def size_field(
    section: Section, contact: FloatArray, settings: MeshSettings, elements: float
) -> tuple[FloatArray, FloatArray, float]:
    """Element sizes on a regular grid around a section.

    The field is the minimum over points of the boundary of their size, growing from the edge of their reach:
    in walls and ribs, at cavities, at the base and at the contact.

    Args:
        section: The body.
        contact: Points of the contact, shape (k, 2), mm.
        settings: Element sizes.
        elements: A wall's thickness over its largest element.

    Returns:
        Sizes, shape (nx, ny), mm; the first grid point, shape (2,), mm; and the grid's spacing, mm.
    """
    size, largest = settings.size, settings.size * settings.coarsening
    low, high = section.bounds
    spacing = max(size, float(np.sqrt(np.prod(high - low + 4 * size) / 200_000)))  # grid points
    origin = low - 2 * spacing
    shape = np.ceil((high - origin) / spacing).astype(int) + 3
    field = np.full(shape, largest)
    for points, fine, reach in _fine_parts(section, contact, settings, elements, spacing):
        near = np.ones(shape, dtype=bool)
        near[tuple(np.rint((points - origin) / spacing).astype(int).T)] = False
        away = np.maximum(distance_transform_edt(near, sampling=spacing) - reach, 0)
        np.minimum(field, fine + settings.growth * away, out=field)
    return field, origin, spacing


def _fine_parts(
    section: Section, contact: FloatArray, settings: MeshSettings, elements: float, spacing: float
) -> list[tuple[FloatArray, float, float]]:
    """Points (k, 2), mm, with the element size there and the distance to which it reaches, both mm."""
    size = settings.size
    found = [(contact, size, 0.0)]
    edges = [
        loop.along(which, _shares(loop.lengths[which], spacing)) for loop, which in section.named("base")
    ]
    for cavity in section.cavities:
        for which, length in enumerate(cavity.lengths):
            points = cavity.along(which, _shares(length, spacing))
            edges.append(points)
            if which not in cavity.straight:
                found.append((points, min(size, cavity.circle(which)[1] / 3), 0.0))
    if edges:
        found.append((np.concatenate(edges), size, 2 * size))
    points, thickness = wall_thickness(section, spacing)
    wall = thickness <= 16 * size  # what is thicker is a solid part
    ratio = 1.1  # of neighbouring thicknesses that get sizes of their own
    points, steps = points[wall], np.floor(np.log(thickness[wall] / size) / np.log(ratio) + 1e-9)
    for step in np.unique(steps):
        across = float(size * ratio**step)
        found.append((points[steps == step], min(size, across / elements), across * ratio))
    return found


def _shares(length: float, spacing: float) -> FloatArray:
    return np.linspace(0, 1, int(np.ceil(length / spacing)) + 1)
