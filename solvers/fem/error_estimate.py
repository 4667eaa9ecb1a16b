"""Estimated discretisation error of a finite-element solution, from its smoothed gradient.

The error's gradient is estimated by the difference of the smoothed gradient from the field's own, here R u
for nodal displacements u (Zienkiewicz and Zhu, Int. J. Numer. Meth. Engng 24 (1987) 337-357). Its energy is
the error in the energy norm.

The error of any functional j of the displacement is a(e, z - z_h) with the dual solution z, a(v, z) = j(v),
and z_h in the finite-element space (R. Becker, R. Rannacher, Acta Numerica 10 (2001) 1-102, section 3). With
both errors estimated by R this is c(R u, R z_h), linear in z_h = K^-1 j, so that one solve serves all:

    j(e) = j . d,    K d = R^T C R u

where d is the estimated error of the displacement itself. At finite strain K and C are the tangents at the
solution.

The smoothed gradient is by superconvergent patch recovery. The gradient of a finite-element displacement is
most accurate inside the elements, at the points of a Gauss rule. A polynomial of the degree of the elements
is fitted to those of the triangles around a vertex, with the weight 1 / distance: where fewer than four
triangles meet, on the boundary, those of their neighbours count too. Its value is the smoothed gradient at
the vertex; at the middle of an edge it is the mean of both ends' polynomials (O. C. Zienkiewicz, J. Z. Zhu,
Int. J. Numer. Meth. Engng 33 (1992) 1331-1364, sections 3 and 4; the weight is ours).
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations_with_replacement, product
from typing import NamedTuple

import numpy as np
from scipy.sparse import csr_matrix, diags, vstack

from pinnray.geometry.mesh.point_location import LocatedPoints
from pinnray.geometry.mesh.quadrature import Quadrature, body_quadrature, triangle_rule
from pinnray.geometry.mesh.triangle_mesh import TriangleMesh
from pinnray.runtime.arrays import FloatArray, IntArray
from pinnray.solvers.elasticity import deformation_jacobian, lame_constants, piola_stress
from pinnray.solvers.lagrange import LagrangeField, LagrangeSpace
from pinnray.solvers.problem import Material, Problem
from pinnray.solvers.shared_work import shared
from pinnray.solvers.solution import ErrorEstimate, State


class GradientRecovery:
    """The linear map from nodal displacements to nodal values of their smoothed gradient."""

    def __init__(self, space: LagrangeSpace) -> None:
        rule, _ = triangle_rule(space.degree)
        samples = space.mesh.at_barycentric(rule)
        fits = _fit(space.mesh, space.degree, samples.points.reshape(-1, len(rule), 2))
        columns = len(samples)
        smoothing = csr_matrix((fits.weights[0], fits.sample, fits.start), (len(fits.scale), columns))
        if space.degree == 2:
            smoothing = vstack([smoothing, _at_edges(space.mesh, fits, columns)], format="csr")
        self._smoothing = smoothing  # From values at the s sample points to nodal values, a matrix (N, s)
        self._derivatives = space.shape_gradients(samples)  # Along x and y, each a matrix (s, N), 1/mm

    def gradient(self, nodal: FloatArray) -> FloatArray:
        """Nodal values of the smoothed gradient du_i/dx_j, shape (N, 2, 2)."""
        return np.stack([self._smoothing @ (along @ nodal) for along in self._derivatives], axis=-1)

    def transposed(self, nodal: FloatArray) -> FloatArray:
        """The transposed map, from shape (N, 2, 2) to shape (N, 2)."""
        x, y = (self._smoothing.T @ nodal[..., axis] for axis in (0, 1))
        return np.asarray(self._derivatives[0].T @ x + self._derivatives[1].T @ y)


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


@dataclass(frozen=True, eq=False)
class ImprovedField(LagrangeField):
    """A finite-element displacement with its estimated error added, and its smoothed gradient."""

    gradients: FloatArray  # Nodal values of the smoothed gradient, shape (N, 2, 2)
    # Field whose gradient replaces it where it would turn the material inside out; None at small strain
    own: LagrangeField | None = None

    def gradient(self, location: LocatedPoints) -> FloatArray:
        """Displacement gradient du_i/dx_j, shape (n, 2, 2)."""
        flat = self.space.shape_functions(location) @ self.gradients.reshape(-1, 4)
        smooth = np.asarray(flat.reshape(-1, 2, 2))
        if self.own is None:
            return smooth
        possible = deformation_jacobian(smooth) > 0
        return np.where(possible[:, None, None], smooth, self.own.gradient(location))


@dataclass(frozen=True, eq=False)
class ErrorEstimator:
    """Error estimates for fields of one finite-element space and the problem's material."""

    problem: Problem
    space: LagrangeSpace

    @cached_property
    def rule(self) -> Quadrature:
        """The rule of all integrals, exact for the estimate: smoothed gradients are of degree 2."""
        return body_quadrature(self.space.mesh, 4)

    @cached_property
    def recovery(self) -> GradientRecovery:
        """The smoothing, one for all solvers on a mesh."""
        key = ("smoothing", self.space.mesh.digest, self.space.degree)
        return shared(key, lambda: GradientRecovery(self.space))

    def gradient_error(self, nodal: FloatArray) -> FloatArray:
        """Smoothed minus own gradient at the quadrature points, shape (q, 2, 2)."""
        smoothed = self._shapes @ self.recovery.gradient(nodal).reshape(-1, 4)
        return np.asarray(smoothed.reshape(-1, 2, 2) - self._gradient(nodal))

    def _gradient(self, nodal: FloatArray) -> FloatArray:
        """Own gradient at the quadrature points, shape (q, 2, 2)."""
        return np.stack([along @ nodal for along in self._derivatives], axis=-1)

    def force(self, stress: FloatArray) -> FloatArray:
        """Nodal forces R^T of a stress at the quadrature points, shape (q, 2, 2), MPa: (N, 2), N/mm."""
        weighted = self.rule.weights[:, None, None] * stress
        smooth = (self._shapes.T @ weighted.reshape(-1, 4)).reshape(-1, 2, 2)
        own = sum(along.T @ weighted[..., axis] for axis, along in enumerate(self._derivatives))
        return np.asarray(self.recovery.transposed(smooth) - own)

    def estimate(self, nodal: FloatArray, solve: Callable[[FloatArray], FloatArray]) -> ErrorEstimate:
        """The estimated error of a solution with nodal displacements of shape (N, 2), mm.

        `solve` gives the change of the nodal displacements, mm, under nodal forces, N/mm, both (N, 2), while
        the prescribed values at base and contact are constant.
        """
        gradient, difference = self._gradient(nodal), self.gradient_error(nodal)
        state = State.from_gradient(gradient, self.problem)
        stress, von_mises = self._changes(gradient, difference)
        displacement = solve(self.force(stress))
        energy = 0.5 * self._integral(np.einsum("qij,qij->q", stress, difference))
        own = None if self.problem.material.law == "linear" else LagrangeField(self.space, nodal)
        return ErrorEstimate(
            energy_norm=float(np.sqrt(energy / self._integral(state.energy_density))),
            displacement=self._relative(self._shapes @ displacement, self._shapes @ nodal),
            von_mises=self._relative(von_mises, state.von_mises),
            markers=displacement[self.space.mesh.marker_nodes],
            field=ImprovedField(self.space, nodal + displacement, self.recovery.gradient(nodal), own),
        )

    def _changes(self, gradient: FloatArray, difference: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Changes of first Piola-Kirchhoff and von Mises stress at the quadrature points, MPa.

        To first order at finite strain: the whole difference, large in corners, might turn material inside
        out.
        """
        step = 1.0 if self.problem.material.law == "linear" else 1e-6
        before, after = (self._stresses(gradient + part * difference) for part in (0.0, step))
        return (after[0] - before[0]) / step, (after[1] - before[1]) / step

    def _stresses(self, gradient: FloatArray) -> tuple[FloatArray, FloatArray]:
        """First Piola-Kirchhoff and von Mises stress, MPa."""
        state = State.from_gradient(gradient, self.problem)
        return piola_stress(self.problem.material.law, gradient, state.stress), state.von_mises

    def shares(self, nodal: FloatArray, dual: FloatArray) -> FloatArray:
        """Shares of the triangles, (t,), in a functional's error, by its dual solution K^-1 j, (N, 2)."""
        stress = State.from_gradient(self.gradient_error(nodal), self.problem).stress
        products = np.einsum("qij,qij->q", stress, self.gradient_error(dual)) * self.rule.weights
        return np.asarray(products.reshape(len(self.space.mesh.triangles), -1).sum(axis=1))

    @cached_property
    def _shapes(self) -> csr_matrix:
        return self.space.shape_functions(self.rule.location)

    @cached_property
    def _derivatives(self) -> tuple[csr_matrix, csr_matrix]:
        return self.space.shape_gradients(self.rule.location)

    def _integral(self, values: FloatArray) -> float:
        return float((self.rule.weights * values).sum())

    def _relative(self, difference: FloatArray, values: FloatArray) -> float:
        """Relative L2 norm of a difference at the quadrature points, both of shape (q,) or (q, k)."""
        squares = [(field**2).reshape(len(field), -1).sum(axis=1) for field in (difference, values)]
        return float(np.sqrt(self._integral(squares[0]) / self._integral(squares[1])))


def locking_advice(degree: int, material: Material) -> str:
    """A clause for a solution's status if its elements lock, else nothing.

    Every linear triangle of a nearly incompressible material in plane strain has to keep its volume, and
    there are more of them than nodes (T. J. R. Hughes, The Finite Element Method, Prentice-Hall, 1987,
    chapter 4).
    """
    if degree > 1 or material.plane == "stress" or material.poisson <= 0.4:  # the error has grown by a fifth
        return ""
    # Beyond Poisson's ratio 0.49 the elements hardly move, and the error grows less.
    factor, most = locking_factor(material.poisson), 5
    times = f"more than {most}" if factor > most else f"about {factor:.1f}"
    return (
        f"linear elements lock in plane strain at Poisson's ratio {material.poisson:g}: "
        f"their energy is {times} times as far off as at 0.3; take degree=2"
    )


def locking_factor(poisson: float) -> float:
    """Error of linear elements in energy in plane strain, over the error at Poisson's ratio 0.3.

    Its growth with λ/μ was measured on the fingers `default` and `slender` with elements of 1, 0.5 and
    0.25 mm: 0.06 to 0.11 up to 0.49.
    """
    ratio, usual = (lame.λ / lame.μ for lame in (lame_constants(1.0, ν, "strain") for ν in (poisson, 0.3)))
    return float(1 + 0.09 * (ratio - usual))
