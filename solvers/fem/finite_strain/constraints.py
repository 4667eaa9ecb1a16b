"""Displacements and forces at one stage of the load, and the constraints, rigid or through springs."""

from dataclasses import dataclass

import numpy as np

from geometry.arrays import BoolArray, FloatArray
from solvers.assimilation.misfit import Misfit
from solvers.cylinder_contact import ContactState
from solvers.extrusion import NodalSpace
from solvers.fem.boundary_conditions import load_functionals, load_targets, marker_functionals
from solvers.lagrange import LagrangeSpace
from solvers.problem import Problem


@dataclass(frozen=True, eq=False)
class LoadState(ContactState):
    """A state of the finger, in equilibrium or a guess; `contact` is empty without a cylinder."""

    forces: FloatArray  # Multipliers of the constraints, shape (k,), N/mm


@dataclass(frozen=True, eq=False)
class DisplacementConstraints:
    """Constraints b_k . c + s_k f_k = d_k on the displacements c, with forces f_k."""

    functionals: FloatArray  # b_k, shape (k, N, d)
    targets: FloatArray  # d_k under the full load, shape (k,), mm
    # s_k, shape (k,), mm per N/mm: zero where the value is prescribed, else the compliance of a spring
    # between functional and value, whose energy is (d_k - b_k . c)^2 / (2 s_k)
    slacks: FloatArray

    @classmethod
    def of(cls, problem: Problem, space: NodalSpace, slack: float = 0.0) -> "DisplacementConstraints":
        """The constraints of a `mean` or `point` load, all of one slack; else none."""
        targets = load_targets(problem)
        return cls(load_functionals(problem, space), targets, np.full(len(targets), slack))

    @classmethod
    def springs(cls, misfit: Misfit, space: LagrangeSpace) -> "DisplacementConstraints":
        """Springs between markers and observed positions, whose energy is the misfit; u v u v ..."""
        return cls(marker_functionals(misfit, space), misfit.observed.ravel(), 1 / misfit.weights.ravel())

    def joined(self, other: "DisplacementConstraints") -> "DisplacementConstraints":
        """Both, in this order."""
        return DisplacementConstraints(
            np.concatenate([self.functionals, other.functionals]),
            np.concatenate([self.targets, other.targets]),
            np.concatenate([self.slacks, other.slacks]),
        )

    def only(self, kept: BoolArray) -> "DisplacementConstraints":
        """Subset selected by a mask of shape (k,)."""
        return DisplacementConstraints(self.functionals[kept], self.targets[kept], self.slacks[kept])

    def values(self, nodal: FloatArray) -> FloatArray:
        """b_k . c of displacements of shape (N, d), mm: shape (k,)."""
        return np.asarray(np.einsum("knx,nx->k", self.functionals, nodal))

    def at_nodes(self, forces: FloatArray) -> FloatArray:
        """f_k b_k of forces of shape (k,), N/mm: shape (N, d)."""
        return np.asarray(np.einsum("k,knx->nx", forces, self.functionals))

    def residual(self, nodal: FloatArray, forces: FloatArray, fraction: float) -> FloatArray:
        """Residual of the constraints at a fraction of the load, shape (k,), mm."""
        return np.asarray(fraction * self.targets - self.values(nodal) - self.slacks * forces)
