"""A finger at finite strain by a finite-basis network, for the inverse problem.

The body is drawn at X; its walls moved by W put the material at X + W(X). With M = (I + ∇W)^-1 the energy is

    E = ∫ ψ(H M) det(I + ∇W) dX        H = ∇u by the drawn X

so that the stress and the tangent conjugate to H follow from the law's at G = H M, by det(I + ∇W) and an M
for every derivative by X:

    P_ij = det(I + ∇W) P(G)_im M_jm        A_ijkl = det(I + ∇W) A(G)_imkn M_jm M_ln
"""

from functools import partial
from typing import ClassVar, NamedTuple

import numpy as np
import torch

from pinnray.geometry.mesh.point_location import LocatedPoints
from pinnray.geometry.mesh.wall_motion import WallMotion
from pinnray.runtime.arrays import FloatArray
from pinnray.solvers.elasticity import Lame, deformation_jacobian, piola_stress_and_tangent
from pinnray.solvers.identification.body import Linearised
from pinnray.solvers.pinn.finite_basis.energy import REGULARISATION, NetworkEnergy, energy_density
from pinnray.solvers.pinn.finite_basis.network import FiniteBasisField
from pinnray.solvers.pinn.finite_basis.solver import FiniteBasisSolver
from pinnray.solvers.pinn.threading import pool
from pinnray.solvers.problem import Problem
from pinnray.solvers.symmetric_factors import Factors

TOLERANCE = 1e-2
"""Relative error of a solve in the energy norm, and so of a Newton step."""
MOST_ITERATIONS = 8
"""Iterations of conjugate gradients that cost less than factors of the tangent at hand."""

ALIKE = 0.5
"""Change of a tangent over itself up to which its factors tell the signs of its eigenvalues."""


class WallMetric(NamedTuple):
    """Change of coordinates by moved walls at the quadrature points: M, (q, 2, 2), and det(I + ∇W), (q,)."""

    inverse: torch.Tensor
    volume: torch.Tensor


class NetworkBody:
    """A finger of one law, clamped at its base, as a network; see `pinnray.solvers.identification.body`.

    The factors of one tangent serve as the preconditioner of conjugate gradients for the tangents after it,
    as long as these converge in a few iterations.

    Args:
        energy: The elastic energy of the drawn body.
        walls: Gradients of the walls' motions at the quadrature points, shape (k, q, 2, 2), 1/mm.
    """

    thick: ClassVar[bool] = False

    def __init__(self, energy: NetworkEnergy, walls: FloatArray) -> None:
        self._energy, self._walls = energy, torch.from_numpy(walls)
        self._law = energy.material.law
        self.shape = energy.basis.windows.count, 2, energy.basis.per_window  # Functions of a window last
        self.points = energy.places  # The quadrature points, shape (q, 2), mm
        self.feet = np.zeros((0, *self.shape))  # None: the network is held at the whole base
        self._factors: Factors | None = None
        self.factorisations = 0

    @classmethod
    def of(
        cls, solver: FiniteBasisSolver, problem: Problem, motion: WallMotion, scale: float = 1.0
    ) -> "NetworkBody":
        """The body by a solver's windows, their spacings times a scale.

        Args:
            solver: With spacings and windows.
            problem: The body, its law, and the load at whose place the windows are denser.
            motion: Of the walls.
            scale: Of the spacings.
        """
        energy = solver.level(problem, scale).energy
        return cls(energy, motion.gradients[:, problem.mesh.locate(energy.places).cells])

    def admissible(self, state: FloatArray, changes: FloatArray) -> bool:
        """At the quadrature points; see `Body`."""
        with pool():
            return self._strained(state, self._metric(changes)) is not None

    def linearised(self, state: FloatArray, lame: Lame, changes: FloatArray) -> Linearised | None:
        """The force at a state and the tangent; None if a point is turned inside out."""
        metric = self._metric(changes)
        with pool():
            if (gradient := self._strained(state, metric)) is None:
                return None
            stress, tangent = piola_stress_and_tangent(self._law, gradient, lame, torch)
            force = self._energy.forces(_pulled_back(stress, metric)[None])[0]
        tangent = _tangent_pulled_back(tangent, metric)
        return Linearised(force.numpy(), partial(self._solved, tangent), partial(self._negative, tangent))

    def _strained(self, state: FloatArray, metric: WallMetric) -> torch.Tensor | None:
        """G of a state at the quadrature points, (q, 2, 2); None if a point is turned inside out."""
        gradient = self._gradient(state) @ metric.inverse
        inside_out = not ((metric.volume > 0).all() and (deformation_jacobian(gradient) > 0).all())
        return None if inside_out else gradient

    def _negative(self, tangent: torch.Tensor) -> int:
        """Number of negative eigenvalues of a tangent A at the quadrature points."""
        with pool():
            if self._factors is not None and self._alike(self._factors, tangent):
                return self._factors.negative
            return self._factorised(tangent).negative

    def _alike(self, factors: Factors, tangent: torch.Tensor) -> bool:
        """Whether a tangent K has as many negative eigenvalues as that of the factors, K0.

        On the way from K0 to K one changes its sign only if K0^-1 (K - K0) has an eigenvalue of -1 or less.
        The one farthest from zero is found by the power method, from one vector.
        """
        change = torch.from_numpy(np.random.default_rng(0).normal(size=(1, *self.shape)))
        for _ in range(MOST_ITERATIONS):
            vector = change / change.norm()
            change = _back_substituted(factors, self._product(factors, tangent, vector)) - vector
        return float(change.norm()) < ALIKE

    def _solved(self, tangent: torch.Tensor, right: FloatArray) -> FloatArray:
        """Solutions for generalised forces (r, *shape) with the tangent A at the quadrature points."""
        given = torch.from_numpy(np.ascontiguousarray(right))
        with pool():
            found = None if self._factors is None else self._iterated(self._factors, tangent, given)
            if found is None:
                factors = self._factorised(tangent)
                found = _back_substituted(factors, given)
                found += _back_substituted(factors, given - self._product(factors, tangent, found))
        return np.asarray(found)

    def force_slopes(
        self, state: FloatArray, lame: Lame, changes: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Derivatives of F by the k thicknesses, (k, *shape), and by λ and μ, (2, *shape); see `Body`.

        By a thickness with the gradient V = ∇V_k of its motion, M' = -M V M, G' = -G V M, and the volume's
        factor changes by its product with tr(M V).
        """
        metric = self._metric(changes)
        with pool():
            gradient = self._gradient(state) @ metric.inverse
            stress, tangent = piola_stress_and_tangent(self._law, gradient, lame, torch)
            slopes = []
            for wall in self._walls:
                moved = metric.inverse @ wall
                of_gradient = -gradient @ wall @ metric.inverse
                change = torch.einsum("nijkl,nkl->nij", tangent, of_gradient)
                change += moved.diagonal(dim1=1, dim2=2).sum(dim=1)[:, None, None] * stress
                slopes.append(_pulled_back(change - stress @ metric.inverse.mT @ wall.mT, metric))
            for moduli in (Lame(1.0, 0.0, 1.0), Lame(0.0, 1.0, 0.0)):  # every law is a sum of both
                part, _ = piola_stress_and_tangent(self._law, gradient, moduli, torch)
                slopes.append(_pulled_back(part, metric))
            found = self._energy.forces(torch.stack(slopes)).numpy()
        return found[:-2], found[-2:], self.feet

    def displacement_rows(self, points: FloatArray, weights: FloatArray) -> FloatArray:
        """Rows (r, 2, *shape) of the sums of weights (r, q) times the displacement at points (q, 2), mm."""
        used = weights.any(axis=0)  # a contact is a small part of the front
        return self._both_components(self._energy.basis.functionals(points[used], weights[:, used]))

    traction_rows = displacement_rows

    def gradient_rows(self, points: FloatArray, weights: FloatArray) -> FloatArray:
        """Rows (r, 2, *shape) of Σ_qj w_rqj ∂u/∂X_j(P_q), with weights (r, q, 2), at points (q, 2), mm."""
        return self._both_components(self._energy.basis.gradient_functionals(points, weights))

    def energy(self, state: FloatArray, lame: Lame, changes: FloatArray) -> float:
        """Elastic energy per depth, N mm / mm."""
        metric = self._metric(changes)
        with pool():
            density = energy_density(self._gradient(state) @ metric.inverse, lame, self._law)
        return float((self._energy.weights * metric.volume) @ density)

    def field(self, state: FloatArray) -> FiniteBasisField:
        """The displacement as a function of the drawn position."""
        return FiniteBasisField(self._energy.basis, torch.from_numpy(state))

    def displacements(self, states: FloatArray, location: LocatedPoints) -> FloatArray:
        """Displacements (s, n, 2) of states (s, *shape) at points of the drawn body."""
        basis, outputs = self._energy.basis, torch.from_numpy(states)
        return basis.summed(basis.values, "nuw,swiu->nsi", outputs, location.points).swapaxes(0, 1)

    def gradients(self, states: FloatArray, location: LocatedPoints) -> FloatArray:
        """Displacement gradients (s, n, 2, 2) of states (s, *shape) at points of the drawn body."""
        basis, outputs = self._energy.basis, torch.from_numpy(states)
        return basis.summed(basis.gradients, "xnwu,swiu->nsix", outputs, location.points).swapaxes(0, 1)

    def projected(self, gradients: FloatArray, lame: Lame, changes: FloatArray) -> FloatArray:
        """States (s, *shape) nearest to displacement gradients (s, q, 2, 2) at the points.

        That is in the energy norm of the tangent at the first one, whose factors are kept for the solves that
        follow.
        """
        metric, given = self._metric(changes), torch.from_numpy(np.ascontiguousarray(gradients))
        with pool():
            first = given[0] @ metric.inverse
            first[deformation_jacobian(first) <= 0] = 0.0  # turned inside out between points of the elements
            _, tangent = piola_stress_and_tangent(self._law, first, lame, torch)
            tangent = _tangent_pulled_back(tangent, metric)
            forces = self._energy.forces(torch.einsum("nijkl,snkl->snij", tangent, given))
            return _back_substituted(self._factorised(tangent), forces).numpy()

    def _both_components(self, rows: FloatArray) -> FloatArray:
        found = np.zeros((len(rows), 2, *self.shape))
        for axis in range(2):
            found[:, axis, :, axis] = rows
        return found

    def _gradient(self, state: FloatArray) -> torch.Tensor:
        return self._energy.gradients(torch.from_numpy(state)[None])[0]

    def _metric(self, changes: FloatArray) -> WallMetric:
        by = torch.from_numpy(np.asarray(changes, dtype=np.float64))
        motion = torch.tensordot(by, self._walls, dims=1)
        volume = deformation_jacobian(motion)
        signs = torch.tensor([[1.0, -1.0], [-1.0, 1.0]], dtype=torch.float64)  # of the cofactors
        turned = (torch.eye(2, dtype=torch.float64) + motion).flip(1, 2) * signs
        return WallMetric(turned.mT / volume[:, None, None], volume)

    def _factorised(self, tangent: torch.Tensor) -> Factors:
        if self._factors is not None:
            self._factors.scaled.destroy()
        self._factors = self._energy.hessian(tangent).factorised(REGULARISATION, definite=False)
        self.factorisations += 1
        return self._factors

    def _product(self, factors: Factors, tangent: torch.Tensor, states: torch.Tensor) -> torch.Tensor:
        """The tangent's matrix, with the regularisation of factors, times states (r, *shape)."""
        stresses = torch.einsum("nijkl,snkl->snij", tangent, self._energy.gradients(states))
        diagonal = torch.from_numpy(1 / factors.scale**2).view(self.shape)
        return self._energy.forces(stresses) + REGULARISATION * diagonal * states

    def _iterated(self, factors: Factors, tangent: torch.Tensor, right: torch.Tensor) -> torch.Tensor | None:
        """Solutions by conjugate gradients, preconditioned by the factors of another tangent.

        Returns:
            None if they need more than `MOST_ITERATIONS`, or the matrix is indefinite.
        """
        found, residual = torch.zeros_like(right), right.clone()
        direction = steepest = _back_substituted(factors, residual)
        work = first = _dot(residual, steepest)
        for iteration in range(1, MOST_ITERATIONS + 1):
            if (work.abs() <= TOLERANCE**2 * first.abs()).all():
                return found
            product = self._product(factors, tangent, direction)
            stiffness = _dot(direction, product)
            if not ((stiffness >= 0).all() and (work >= 0).all()):
                return None
            step = torch.where(stiffness > 0, work / stiffness, 0.0)
            found = found + step * direction
            residual = residual - step * product
            steepest = _back_substituted(factors, residual)
            before, work = work, _dot(residual, steepest)
            rest = float((work.abs() / first.abs()).nan_to_num().max()) ** 0.5
            foreseen = iteration * np.log(TOLERANCE) / np.log(rest) if 0 < rest < 1 else np.inf
            if rest > 0 and iteration >= 2 and foreseen > MOST_ITERATIONS:
                return None
            direction = steepest + torch.where(before > 0, work / before, 0.0) * direction
        return None


def _pulled_back(stress: torch.Tensor, metric: WallMetric) -> torch.Tensor:
    """P conjugate to H from the law's, both of shape (q, 2, 2), MPa."""
    return metric.volume[:, None, None] * stress @ metric.inverse.mT


def _tangent_pulled_back(tangent: torch.Tensor, metric: WallMetric) -> torch.Tensor:
    """A conjugate to H from the law's, both of shape (q, 2, 2, 2, 2), MPa."""
    found = torch.einsum("nimko,njm->nijko", tangent, metric.inverse)
    return torch.einsum("nijko,nlo,n->nijkl", found, metric.inverse, metric.volume)


def _dot(left: torch.Tensor, right: torch.Tensor) -> torch.Tensor:
    """Products of the states of two lists (r, *shape), shape (r, 1, 1, 1)."""
    return (left * right).sum(dim=(1, 2, 3), keepdim=True)


def _back_substituted(factors: Factors, right: torch.Tensor) -> torch.Tensor:
    return torch.from_numpy(factors.solve(right.flatten(1).numpy())).view_as(right)
