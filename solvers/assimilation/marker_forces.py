"""Minimisers of energy plus misfit, by the forces that act at the markers.

Let G_j be the displacement under a unit force at component j of the markers while all conditions hold at
zero, and C = B G their compliance. The minimiser of E(u) + 1/2 (B u - d)^T W (B u - d) is u = u_0 + G p:
without the markers' forces p it is u_0, and

    (W^-1 + C) p = d - B u_0        E(u) = E(u_0) + 1/2 p^T C p

(Sherman, Morrison, Woodbury). One eigen-decomposition of W^1/2 C W^1/2 gives it for all factors of W; with
M = (W^-1 + C)^-1, the leave-one-out residual of marker i is M_ii^-1 p_i, a block of 2 by 2.

Sources: C. E. Rasmussen, C. K. I. Williams, Gaussian Processes for Machine Learning, MIT Press 2006, section
5.4.2, for leaving one out: with the prior exp(-E / T) the compliance times T is the prior covariance of B u.
P. C. Hansen, SIAM Review 34 (1992) 561-580, for the L-curve.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from pinnray.runtime.arrays import FloatArray


class MarkerFit(NamedTuple):
    """The minimiser for one factor of the weights."""

    forces: FloatArray  # p, shape (m, 2), N/mm
    residual: FloatArray  # d - B u, shape (m, 2), mm
    residual_without: FloatArray  # Of each marker in the fit without it, by unchanged weights, (m, 2), mm
    energy: float  # E(u) - E(u_0), N mm / mm

    @property
    def phrase(self) -> str:
        """The root mean square residuals in words."""
        return residual_phrase(self.residual, self.residual_without)


@dataclass(frozen=True, eq=False)
class MarkerForces:
    """The minimisers for all factors of the weights."""

    compliance: FloatArray  # C, shape (2 m, 2 m), mm per N/mm, the components of a marker beside each other
    weights: FloatArray  # The diagonal of W, positive, shape (m, 2), MPa
    prior_residual: FloatArray  # d - B u_0, shape (m, 2), mm

    @cached_property
    def _modes(self) -> tuple[FloatArray, FloatArray]:
        root = np.sqrt(self.weights.ravel())
        values, vectors = np.linalg.eigh(root[:, None] * self.compliance * root)
        return np.maximum(values, 0.0), vectors

    @cached_property
    def _in_modes(self) -> FloatArray:
        """W^1/2 (d - B u_0) in the eigenvectors, shape (2 m,)."""
        return np.asarray(self._modes[1].T @ (np.sqrt(self.weights) * self.prior_residual).ravel())

    def fit(self, factor: float = 1.0) -> MarkerFit:
        """The minimiser for weights times a factor, which is positive."""
        values, vectors = self._modes
        root, count = np.sqrt(self.weights), len(self.weights)
        damped = vectors / (1 + factor * values)
        scaled = (damped @ self._in_modes).reshape(-1, 2)
        blocks = (damped @ vectors.T).reshape(count, 2, count, 2)[np.arange(count), :, np.arange(count)]
        forces = factor * root * scaled
        return MarkerFit(
            forces=forces,
            residual=scaled / root,
            residual_without=np.linalg.solve(blocks, scaled[..., None])[..., 0] / root,
            energy=0.5 * float(forces.ravel() @ self.compliance @ forces.ravel()),
        )


def residual_phrase(residual: FloatArray, residual_without: FloatArray) -> str:
    """Root mean square residuals in words, mm, in the fit and with each marker left out."""
    return (
        "root mean square residual at the markers: "
        f"{root_mean_square(residual):.2g} mm in the fit, "
        f"{root_mean_square(residual_without):.2g} mm when they are left out"
    )


def root_mean_square(values: FloatArray) -> float:
    """Root mean square over all entries."""
    return float(np.sqrt((values**2).mean()))
