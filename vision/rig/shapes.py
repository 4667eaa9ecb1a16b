"""Painted shapes in planes of constant z, which make up a scene."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from pinnray.runtime.arrays import FloatArray
from pinnray.vision.calibration.camera import Camera, Pose

CORNERS = 512
"""Corners of the polygon that approximates a circle, within 0.0004 pixels at a radius of 20 pixels."""
CHORD = 1e-3
"""Largest distance of an edge's image, a polyline, from the curve that the lens makes of it, pixels."""

LOBES = range(3, 10)
"""Waves of an irregular outline around the circle; all have the same expected height."""

Paint = tuple[float, float, float]
"""Reflectance in blue, green and red."""


@dataclass(frozen=True, eq=False)
class Shape:
    """A part of a plane.

    Attributes:
        edges: Of its border, shape (n, 2, 2), mm, in any order, the shape on the same side of all.
        colour: All over it.
        z: Of its plane, mm.
    """

    edges: FloatArray
    colour: Paint
    z: float = 0.0


@dataclass(frozen=True, eq=False)
class Scene:
    """Shapes before a background; the later ones hide the earlier ones."""

    background: Paint
    shapes: Sequence[Shape]


def closed(corners: ArrayLike) -> FloatArray:
    """The edges of a polygon, shape (n, 2, 2), from its corners in order, shape (n, 2)."""
    points = np.asarray(corners, dtype=np.float64)
    return np.stack([points, np.roll(points, -1, axis=0)], axis=1)


def rectangle(low: ArrayLike, high: ArrayLike) -> FloatArray:
    """The edges of a rectangle from its lower left and upper right corner, shape (4, 2, 2)."""
    (left, bottom), (right, top) = np.asarray(low), np.asarray(high)
    return closed([(left, bottom), (right, bottom), (right, top), (left, top)])


def circle(centre: ArrayLike, radius: float) -> FloatArray:
    """Corners of a polygon that has the circle's area, shape (n, 2), mm."""
    angle = 2 * np.pi * np.arange(CORNERS) / CORNERS
    reach = radius * np.sqrt(angle[1] / np.sin(angle[1]))
    return np.asarray(centre + reach * np.stack([np.cos(angle), np.sin(angle)], axis=1))


def blot(centre: ArrayLike, radius: float, irregular: float, rng: np.random.Generator) -> FloatArray:
    """Corners of a disc with an irregular outline, shape (n, 2), mm, with the disc's centroid and area.

    Args:
        centre: Centroid, mm.
        radius: Of the disc with the same area, mm.
        irregular: Root mean square deviation of the outline from a circle, relative to the radius.
        rng: Draws the outline.
    """
    if not irregular:
        return circle(centre, radius)
    angle = 2 * np.pi * np.arange(CORNERS) / CORNERS
    heights, turns = rng.standard_normal(len(LOBES)), rng.uniform(0, 2 * np.pi, len(LOBES))
    waves = (heights[:, None] * np.cos(np.outer(LOBES, angle) + turns[:, None])).sum(axis=0)
    reach = 1 + irregular * waves / np.sqrt(np.mean(waves**2))
    corners = reach[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    edges = closed(corners)
    return np.asarray(centre + radius * np.sqrt(np.pi / area(edges)) * (corners - centroid(edges)))


def area(edges: FloatArray) -> float:
    """Signed area within edges of shape (n, 2, 2), in their unit squared; positive if counter-clockwise."""
    return float(_turns(edges).sum() / 2)


def centroid(edges: FloatArray) -> FloatArray:
    """Centroid of the area within edges of shape (n, 2, 2), shape (2,)."""
    return np.asarray((edges.sum(axis=1) * _turns(edges)[:, None]).sum(axis=0) / (6 * area(edges)))


def _turns(edges: FloatArray) -> FloatArray:
    (x0, y0), (x1, y1) = edges[:, 0].T, edges[:, 1].T
    return np.asarray(x0 * y1 - x1 * y0)


def seen_edges(shape: Shape, camera: Camera, pose: Pose) -> FloatArray:
    """Edges of the shape in the image, shape (m, 2, 2), pixels; those that the lens bends are divided."""
    start, end = shape.edges[:, 0], shape.edges[:, 1]

    def seen(points: FloatArray) -> FloatArray:
        return camera.project(np.column_stack([points, np.full(len(points), shape.z)]), pose)

    bent = np.linalg.norm(seen((start + end) / 2) - (seen(start) + seen(end)) / 2, axis=1)
    pieces = np.maximum(np.ceil(np.sqrt(bent / CHORD)), 1).astype(np.int64)
    edge = np.repeat(np.arange(len(pieces)), pieces)
    nth = np.arange(len(edge)) - np.repeat(np.cumsum(pieces) - pieces, pieces)

    def along(fraction: FloatArray) -> FloatArray:
        return seen(start[edge] + fraction[:, None] * (end - start)[edge])

    return np.stack([along(nth / pieces[edge]), along((nth + 1) / pieces[edge])], axis=1)
