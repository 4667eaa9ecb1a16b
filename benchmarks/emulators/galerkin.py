"""Reduced Galerkin's method: equilibrium among combinations of modes, with few triangles in the integrals.

Source of the choice of triangles: C. Farhat, P. Avery, T. Chapman, J. Cortial, International Journal for
Numerical Methods in Engineering 98 (2014) 625-662.
"""

import numpy as np
from scipy.optimize import nnls

from benchmarks.emulators.modes import Rule, piola
from geometry.arrays import FloatArray
from solvers.cylinder_contact import CylinderContact
from solvers.elasticity import Lame
from studies.fields.emulator import LEAST
from studies.fields.reduction import Modes
from studies.fields.snapshots import Snapshots

USED, LEFT = 80, 1e-4
"""Fields whose forces the few triangles give, and share of these forces that is left out."""
UPDATES, ITERATIONS, RESIDUAL, GAP = 30, 30, 1e-5, 1e-4
"""Of the contact's multipliers and of Newton's method; residual over the force; gap, mm."""


class ReducedBody:
    """Modes of displacement and their internal force."""

    def __init__(self, known: Snapshots, lame: Lame) -> None:
        nodal = known.nodal.reshape(-1, known.nodal.shape[2], 2)
        modes, coefficients = Modes.of_fields(nodal, known.space, LEAST)
        sizes = coefficients.std(axis=0)
        self.lame, self.space = lame, known.space
        self.vectors = modes.vectors.reshape(len(sizes), -1, 2) * sizes[:, None, None]
        self.inverse = np.linalg.pinv(self.vectors.reshape(len(sizes), -1))
        self._integrate(Rule.of(self.space))
        states = coefficients / sizes
        picked = np.random.default_rng(0).choice(len(states), USED, replace=False)
        rows = np.concatenate([self._shares(states[each]) for each in picked])
        left, found, _ = np.linalg.svd(rows, full_matrices=False)
        left = left[:, found > LEFT * found[0]]
        factors, _ = nnls(left.T @ rows, left.T @ rows.sum(axis=1), maxiter=20_000)
        self.cells = np.flatnonzero(factors)
        rule = Rule.of(self.space, cells=self.cells)
        self._integrate(Rule(rule.where, rule.weights * np.repeat(factors[self.cells], 6)))

    def _integrate(self, rule: Rule) -> None:
        self.weights = rule.weights
        self.gradients = rule.gradients(self.space, self.vectors).reshape(len(rule.weights), 4, -1)

    def _shares(self, state: FloatArray) -> FloatArray:
        """Triangles' shares of the internal force, over its length, shape (r, t)."""
        stress = self._stress(state) * self.weights[:, None, None]
        found = np.einsum("qk,qkr->qr", stress.reshape(-1, 4), self.gradients)
        per_cell = found.reshape(-1, 6, found.shape[1]).sum(axis=1)
        return np.asarray(per_cell.T / np.linalg.norm(per_cell.sum(axis=0)))

    def _stress(self, state: FloatArray) -> FloatArray:
        return piola((self.gradients @ state).reshape(-1, 2, 2), self.lame)

    def force_and_tangent(self, state: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Internal force (r,) and its derivative (r, r)."""
        deformed = (self.gradients @ state).reshape(-1, 2, 2) + np.eye(2)
        inverse = np.linalg.inv(deformed).transpose(0, 2, 1)
        log, (λ, μ) = np.log(np.linalg.det(deformed)), self.lame[:2]
        stress = μ * (deformed - inverse) + (λ * log)[:, None, None] * inverse
        slope = λ * np.einsum("qij,qkl->qijkl", inverse, inverse)
        slope += (μ - λ * log)[:, None, None, None, None] * np.einsum("qil,qkj->qijkl", inverse, inverse)
        slope = slope.reshape(-1, 4, 4) + μ * np.eye(4)
        flat = self.gradients.reshape(-1, self.gradients.shape[2])
        weighted = (slope * self.weights[:, None, None]) @ self.gradients
        force = (stress * self.weights[:, None, None]).ravel() @ flat
        return force, flat.T @ weighted.reshape(flat.shape)

    def pressed(
        self, contact: CylinderContact, share: float, guess: FloatArray
    ) -> tuple[FloatArray, FloatArray] | None:
        """Displacement (N, 2), mm, and force, N/mm, from a guess (N, 2); None if none is found."""
        state = guess.ravel() @ self.inverse
        on_front = self.vectors[:, contact.nodes].transpose(1, 2, 0)
        multipliers, stiffness = np.zeros(len(contact.nodes)), contact.stiffness
        for _ in range(UPDATES):
            for _ in range(ITERATIONS):
                inner, tangent = self.force_and_tangent(state)
                gap, normal = _gaps(contact, on_front @ state, share)
                push = np.maximum(0.0, multipliers - stiffness * gap)
                touching = push > 0
                along = np.einsum("mi,mir->mr", normal[touching], on_front[touching])
                turned = np.stack([-normal[touching, 1], normal[touching, 0]], axis=1)
                across = np.einsum("mi,mir->mr", turned, on_front[touching])
                residual = inner - push[touching] @ along
                bend = (push[touching] / (gap[touching] + contact.radius))[:, None] * across
                state = state - np.linalg.solve(
                    tangent + stiffness * along.T @ along - across.T @ bend, residual
                )
                if not np.isfinite(state).all():
                    return None
                if np.linalg.norm(residual) < RESIDUAL * np.abs(inner).max():
                    break
            gap, normal = _gaps(contact, on_front @ state, share)
            multipliers = np.maximum(0.0, multipliers - stiffness * gap)
            if max(np.abs(gap[multipliers > 0]).max(initial=0.0), -gap.min()) < GAP:
                return np.tensordot(state, self.vectors, 1), multipliers @ normal
        return None


def _gaps(contact: CylinderContact, moved: FloatArray, share: float) -> tuple[FloatArray, FloatArray]:
    away = contact.positions + moved - contact.centre - share * contact.travel
    distance = np.linalg.norm(away, axis=1)
    return distance - contact.radius, away / distance[:, None]
