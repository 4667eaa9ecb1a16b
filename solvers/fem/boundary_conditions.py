"""Conditions at base, contact and markers in a finite-element space, and the reaction."""

from dataclasses import dataclass

import numpy as np

from pinnray.runtime.arrays import BoolArray, FloatArray
from pinnray.solvers.assimilation.misfit import Misfit
from pinnray.solvers.extrusion import NodalSpace
from pinnray.solvers.lagrange import LagrangeSpace
from pinnray.solvers.problem import Problem, contact_functional


def dirichlet_conditions(problem: Problem, space: NodalSpace) -> tuple[BoolArray, FloatArray]:
    """Components held by base, symmetry and, for a `patch`, contact, and their displacements, (N, d), mm."""
    held, values = space.mirrored.copy(), np.zeros(space.nodes.shape)
    held[space.boundary_nodes("base")] = True
    if problem.load.kind == "patch":
        contact = np.ix_(space.boundary_nodes("contact"), np.array(problem.load.prescribed))
        held[contact], values[contact] = True, problem.load.values
    return held, values


@dataclass(frozen=True, eq=False)
class DisplacementConstraints:
    """Constraints b_k . c + s_k f_k = d_k on the displacements c, with forces f_k."""

    functionals: FloatArray  # b_k, shape (k, N, d)
    targets: FloatArray  # d_k under the full load, shape (k,), mm
    # s_k, shape (k,), mm per N/mm: zero where the value is prescribed, else the compliance of a spring with
    # the energy (d_k - b_k . c)^2 / (2 s_k)
    slacks: FloatArray

    @classmethod
    def of(cls, problem: Problem, space: NodalSpace) -> "DisplacementConstraints":
        """The constraints of a `mean` or `point` load; else none."""
        if problem.load.kind not in ("mean", "point"):
            return cls(np.zeros((0, *space.nodes.shape)), np.zeros(0), np.zeros(0))
        coefficients, targets = space.mean_value(*contact_functional(problem)), problem.load.values
        functionals = np.zeros((len(targets), *space.nodes.shape))
        for row, axis in enumerate(problem.load.prescribed):
            functionals[row, :, axis] = coefficients
        return cls(functionals, targets, np.zeros(len(targets)))

    @classmethod
    def springs(cls, misfit: Misfit, space: LagrangeSpace) -> "DisplacementConstraints":
        """Springs between markers and observed positions, whose energy is the misfit; u v u v ..."""
        points, weights = misfit.sampling()
        sampling = weights @ space.shape_functions(space.mesh.locate(points)).toarray()
        functionals = np.kron(sampling, np.eye(2)).reshape(-1, len(space.nodes), 2)
        return cls(functionals, misfit.observed.ravel(), 1 / misfit.weights.ravel())

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


def reaction_by_residual_work(space: NodalSpace, residual: FloatArray) -> FloatArray:
    """Force of the indenter on the finger, shape (2,), N/mm: the work of the residual on a unit translation.

    The translation is zero at the base, where the clamp's own force works. Unlike an integral of stresses
    along the boundary it is exact for the discrete solution.
    """
    moved = np.ones(len(space.nodes), dtype=bool)
    moved[space.boundary_nodes("base")] = False
    return np.asarray(residual[moved, :2].sum(axis=0))
