"""Quadrature over the body and along its boundaries."""

from dataclasses import dataclass

import numpy as np
from scipy.special import roots_legendre

from pinnray.geometry.mesh.point_location import LocatedPoints
from pinnray.geometry.mesh.triangle_mesh import TriangleMesh
from pinnray.runtime.arrays import FloatArray
from pinnray.runtime.errors import UserError


@dataclass(frozen=True, eq=False)
class Quadrature:
    """Points and weights: the integral of f over the body is `(weights * f(points)).sum()`."""

    location: LocatedPoints  # the q points and their triangles
    weights: FloatArray  # shape (q,), mm^2


def triangle_rule(degree: int) -> tuple[FloatArray, FloatArray]:
    """Symmetric rule on one triangle, exact for polynomials up to `degree`.

    Returns:
        Barycentric points (q, 3) and weights (q,) that sum to one.

    Raises:
        UserError: If no rule of that degree is implemented.

    Source: D. A. Dunavant, High degree efficient symmetrical Gaussian quadrature rules for the triangle,
    Int. J. Numer. Meth. Engng 21 (1985) 1129-1148, appendix II, p = 1, 2, 4.
    """
    if degree <= 1:
        return np.full((1, 3), 1 / 3), np.ones(1)
    if degree == 2:
        return _orbit(1 / 6), np.full(3, 1 / 3)
    if degree <= 4:
        points = np.concatenate([_orbit(0.445948490915965), _orbit(0.091576213509771)])
        return points, np.repeat([0.223381589678011, 0.109951743655322], 3)
    raise UserError(f"there is no triangle rule of degree {degree}; take 1, 2 or 4")


def body_quadrature(mesh: TriangleMesh, degree: int = 2) -> Quadrature:
    """The element rule of `degree` in every triangle of the mesh."""
    barycentric, weights = triangle_rule(degree)
    return Quadrature(mesh.at_barycentric(barycentric), np.outer(mesh.areas, weights).ravel())


def edge_quadrature(mesh: TriangleMesh, name: str, points_per_edge: int = 4) -> tuple[FloatArray, FloatArray]:
    """Gauss-Legendre rule on every edge of a named boundary.

    Returns:
        Points (q, 2), mm, and weights (q,), mm.
    """
    edges = mesh.points[mesh.boundary(name)]
    return segment_quadrature(edges[:, 0], edges[:, 1], points_per_edge)


def segment_quadrature(
    start: FloatArray, end: FloatArray, points_per_segment: int = 4
) -> tuple[FloatArray, FloatArray]:
    """Gauss-Legendre rule on segments from `start` to `end`, both (s, 2), mm.

    Returns:
        Points (q, 2), mm, and weights (q,), mm.
    """
    abscissae, weights = roots_legendre(points_per_segment)
    points = start[:, None] + (0.5 * (1 + abscissae))[None, :, None] * (end - start)[:, None]
    lengths = np.linalg.norm(end - start, axis=1)
    return points.reshape(-1, 2), np.outer(lengths, 0.5 * weights).ravel()


def _orbit(a: float) -> FloatArray:
    return np.array([[1 - 2 * a, a, a], [a, 1 - 2 * a, a], [a, a, 1 - 2 * a]])
