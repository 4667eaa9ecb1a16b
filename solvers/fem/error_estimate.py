"""How far a finite-element solution is from the exact one, from its own smoothed gradient.

The error's gradient is estimated by the difference of the smoothed gradient from the field's own, here R u
for nodal displacements u (Zienkiewicz and Zhu, Int. J. Numer. Meth. Engng 24 (1987) 337-357). Its energy is
the error in the energy norm.

The error of any functional j of the displacement is a(e, z - z_h) with the dual solution z, a(v, z) = j(v),
and z_h in the finite-element space (R. Becker, R. Rannacher, An optimal control approach to a posteriori
error estimation in finite element methods, Acta Numerica 10 (2001) 1-102, section 3). With both errors
estimated by R this is c(R u, R z_h), which is linear in z_h = K^-1 j. Hence one solve serves every
functional:

    j(e) = j . d,    K d = R^T C R u

so that d is the estimated error of the displacement itself, at markers and everywhere.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.sparse import csr_matrix

from geometry.arrays import FloatArray
from geometry.locate import Location
from geometry.quadrature import Quadrature, body_quadrature
from solvers.fem.lagrange import LagrangeField, LagrangeSpace
from solvers.fem.recovery import GradientRecovery
from solvers.problem import Problem
from solvers.solution import ErrorEstimate, State

QUADRATURE_DEGREE = 4
"""Exact for the energy of the estimated error: smoothed gradients are polynomials of degree 2."""


@dataclass(frozen=True, eq=False)
class ImprovedField:
    """A finite-element displacement with its estimated error added, and its smoothed gradient.

    Attributes:
        space: The elements.
        values: Nodal displacements, shape (N, 2), mm.
        gradients: Nodal values of the smoothed gradient, shape (N, 2, 2).
    """

    space: LagrangeSpace
    values: FloatArray
    gradients: FloatArray

    def displacement(self, location: Location) -> FloatArray:
        """Displacement, shape (n, 2), mm."""
        return LagrangeField(self.space, self.values).displacement(location)

    def gradient(self, location: Location) -> FloatArray:
        """Displacement gradient du_i/dx_j, shape (n, 2, 2)."""
        flat = self.space.shape_functions(location) @ self.gradients.reshape(-1, 4)
        return np.asarray(flat.reshape(-1, 2, 2))


@dataclass(frozen=True, eq=False)
class ErrorEstimator:
    """Estimates for fields of one finite-element space.

    Attributes:
        problem: Whose linear stress and whose markers count.
        space: The elements.
    """

    problem: Problem
    space: LagrangeSpace

    @cached_property
    def rule(self) -> Quadrature:
        """The element rule of all integrals."""
        return body_quadrature(self.space.mesh, QUADRATURE_DEGREE)

    @cached_property
    def recovery(self) -> GradientRecovery:
        """The smoothing."""
        return GradientRecovery.of(self.space)

    def gradient_error(self, nodal: FloatArray) -> FloatArray:
        """Smoothed minus own gradient at the quadrature points, shape (q, 2, 2)."""
        smoothed, own = self.recovery.gradient(nodal).reshape(-1, 4), self._derivatives
        flat = self._shapes @ smoothed
        return np.asarray(flat.reshape(-1, 2, 2) - np.stack([along @ nodal for along in own], axis=-1))

    def force(self, stress: FloatArray) -> FloatArray:
        """Nodal forces R^T of a stress at the quadrature points, shape (q, 2, 2), MPa: (N, 2), N/mm."""
        weighted = self.rule.weights[:, None, None] * stress
        smooth = (self._shapes.T @ weighted.reshape(-1, 4)).reshape(-1, 2, 2)
        own = sum(along.T @ weighted[..., axis] for axis, along in enumerate(self._derivatives))
        return np.asarray(self.recovery.transposed(smooth) - own)

    def estimate(self, nodal: FloatArray, solve: Callable[[FloatArray], FloatArray]) -> ErrorEstimate:
        """The estimated error of a linear solution.

        Args:
            nodal: Its nodal displacements, shape (N, 2), mm.
            solve: From nodal forces (N, 2), N/mm, to the nodal displacements (N, 2), mm, under them with
                nothing prescribed at base and contact but zero.
        """
        difference = self.gradient_error(nodal)
        own = LagrangeField(self.space, nodal).gradient(self.rule.location)
        error, state, better = (
            State.from_gradient(gradient, self.problem) for gradient in (difference, own, own + difference)
        )
        displacement = solve(self.force(error.stress))
        energy, total = (self._integral(each.energy_density) for each in (error, state))
        return ErrorEstimate(
            energy_norm=float(np.sqrt(energy / total)),
            displacement=self._relative(self._shapes @ displacement, self._shapes @ nodal),
            von_mises=self._relative(better.von_mises - state.von_mises, state.von_mises),
            markers=displacement[self.space.mesh.marker_nodes],
            field=ImprovedField(self.space, nodal + displacement, self.recovery.gradient(nodal)),
        )

    def shares(self, nodal: FloatArray, dual: FloatArray) -> FloatArray:
        """What every triangle adds to the error of a functional, shape (t,).

        Args:
            nodal: The solution, shape (N, 2), mm.
            dual: The functional's dual solution K^-1 j, shape (N, 2).
        """
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
