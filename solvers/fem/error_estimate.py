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
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.sparse import csr_matrix

from geometry.arrays import FloatArray
from geometry.mesh.point_location import LocatedPoints
from geometry.mesh.quadrature import Quadrature, body_quadrature
from solvers.elasticity import deformation_jacobian, lame_constants, piola_stress
from solvers.fem.gradient_recovery import GradientRecovery
from solvers.lagrange import LagrangeField, LagrangeSpace
from solvers.problem import Material, Problem
from solvers.solution import ErrorEstimate, State


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
        """The estimated error of a solution with nodal displacements of shape (N, 2), mm.

        `solve` gives the change of the nodal displacements, mm, under nodal forces, N/mm, both (N, 2), while
        the prescribed values at base and contact are constant.
        """
        own = LagrangeField(self.space, nodal)
        gradient, difference = own.gradient(self.rule.location), self.gradient_error(nodal)
        state = State.from_gradient(gradient, self.problem)
        stress, von_mises = self._changes(gradient, difference)
        displacement = solve(self.force(stress))
        energy = 0.5 * self._integral(np.einsum("qij,qij->q", stress, difference))
        return ErrorEstimate(
            energy_norm=float(np.sqrt(energy / self._integral(state.energy_density))),
            displacement=self._relative(self._shapes @ displacement, self._shapes @ nodal),
            von_mises=self._relative(von_mises, state.von_mises),
            markers=displacement[self.space.mesh.marker_nodes],
            field=ImprovedField(
                self.space,
                nodal + displacement,
                self.recovery.gradient(nodal),
                None if self.problem.material.law == "linear" else own,
            ),
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
