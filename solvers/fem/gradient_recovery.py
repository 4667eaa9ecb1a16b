"""Smoothed gradients of finite-element fields, by superconvergent patch recovery.

The gradient of a finite-element displacement is most accurate inside the elements, at the points of a Gauss
rule. A polynomial of the degree of the elements is fitted to those of the triangles around a vertex, with the
weight 1 / distance: where fewer than four triangles meet, on the boundary, those of their neighbours count
too. Its value is the smoothed gradient at the vertex; at the middle of an edge it is the mean of both ends'
polynomials.

Source: O. C. Zienkiewicz, J. Z. Zhu, The superconvergent patch recovery and a posteriori error estimates,
part 1, Int. J. Numer. Meth. Engng 33 (1992) 1331-1364, sections 3 and 4; the weight is ours.
"""

from dataclasses import dataclass
from itertools import combinations_with_replacement, product
from typing import NamedTuple

import numpy as np
from scipy.sparse import csr_matrix, diags, vstack

from geometry.arrays import FloatArray, IntArray
from geometry.mesh.quadrature import triangle_rule
from geometry.mesh.triangle_mesh import TriangleMesh
from solvers.lagrange import LagrangeSpace


@dataclass(frozen=True, eq=False)
class GradientRecovery:
    """The linear map from nodal displacements to nodal values of their smoothed gradient."""

    # Along x and y at the sample points, each a matrix (s, N), 1/mm
    derivatives: tuple[csr_matrix, csr_matrix]
    smoothing: csr_matrix  # From values at the sample points to nodal values, a matrix (N, s)

    @classmethod
    def of(cls, space: LagrangeSpace) -> "GradientRecovery":
        """Fit the polynomials of every patch."""
        rule, _ = triangle_rule(space.degree)
        samples = space.mesh.at_barycentric(rule)
        fits = _fit(space.mesh, space.degree, samples.points.reshape(-1, len(rule), 2))
        columns = len(samples)
        smoothing = csr_matrix((fits.weights[0], fits.sample, fits.start), (len(fits.scale), columns))
        if space.degree == 2:
            smoothing = vstack([smoothing, _at_edges(space.mesh, fits, columns)], format="csr")
        return cls(space.shape_gradients(samples), smoothing)

    def gradient(self, nodal: FloatArray) -> FloatArray:
        """Nodal values of the smoothed gradient du_i/dx_j, shape (N, 2, 2)."""
        return np.stack([self.smoothing @ (along @ nodal) for along in self.derivatives], axis=-1)

    def transposed(self, nodal: FloatArray) -> FloatArray:
        """The transposed map, from shape (N, 2, 2) to shape (N, 2)."""
        x, y = (self.smoothing.T @ nodal[..., axis] for axis in (0, 1))
        return np.asarray(self.derivatives[0].T @ x + self.derivatives[1].T @ y)


class _Fits(NamedTuple):
    """The polynomial of vertex i is the sum of weights[:, k] f(sample[k]), start[i] <= k < start[i + 1]."""

    start: IntArray
    sample: IntArray
    weights: FloatArray
    scale: FloatArray


def _fit(mesh: TriangleMesh, degree: int, samples: FloatArray) -> _Fits:
    """Least squares in every patch; samples of shape (t, q, 2), mm."""
    vertices, (triangles, per_triangle, _) = len(mesh.points), samples.shape
    corners = (np.ones(3 * triangles), (mesh.triangles.ravel(), np.repeat(np.arange(triangles), 3)))
    touching = csr_matrix(corners, shape=(vertices, triangles))
    narrow = diags((touching.getnnz(axis=1) < 4).astype(np.float64))
    patches = (touching + narrow @ touching @ touching.T @ touching).tocsr()
    start = patches.indptr.astype(np.int64) * per_triangle
    sample = (patches.indices[:, None].astype(np.int64) * per_triangle + np.arange(per_triangle)).ravel()
    vertex = np.repeat(np.arange(vertices), np.diff(start))
    offset = samples.reshape(-1, 2)[sample] - mesh.points[vertex]
    distance = np.linalg.norm(offset, axis=1)
    scale = np.add.reduceat(distance, start[:-1]) / np.diff(start)
    terms = _monomials(offset / scale[vertex, None], degree)
    weighted, size = terms / distance, len(terms)
    # Entry by entry: all of all samples at once would take gigabytes on a mesh of a million triangles.
    normal = np.empty((vertices, size, size))
    for i, j in combinations_with_replacement(range(size), 2):
        normal[:, i, j] = normal[:, j, i] = np.add.reduceat(weighted[i] * terms[j], start[:-1])
    inverse = np.linalg.inv(normal)
    weights = np.zeros_like(terms)
    for i, j in product(range(size), repeat=2):
        weights[i] += inverse[:, i, j][vertex] * weighted[j]
    return _Fits(start, sample, weights, scale)


def _at_edges(mesh: TriangleMesh, fits: _Fits, columns: int) -> csr_matrix:
    """Mean of the polynomials of both ends at the middle of every edge, a matrix (e, s)."""
    ends = mesh.edges.ravel()
    middles = np.repeat(mesh.points[mesh.edges].mean(axis=1), 2, axis=0)
    terms = 0.5 * _monomials((middles - mesh.points[ends]) / fits.scale[ends, None], 2)
    count = np.diff(fits.start)[ends]
    behind = np.concatenate([[0], np.cumsum(count)])
    entries = np.arange(behind[-1]) + np.repeat(fits.start[ends] - behind[:-1], count)
    values = sum(
        np.repeat(term, count) * weight[entries] for term, weight in zip(terms, fits.weights, strict=True)
    )
    return csr_matrix((values, fits.sample[entries], behind[::2]), (len(mesh.edges), columns))


def _monomials(place: FloatArray, degree: int) -> FloatArray:
    """1, x, y and, for degree 2, x^2, x y, y^2 at places of shape (n, 2): shape (3, n) or (6, n)."""
    x, y = place.T
    columns = [np.ones_like(x), x, y]
    return np.stack(columns if degree == 1 else [*columns, x * x, x * y, y * y])
