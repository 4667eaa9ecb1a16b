"""How the finger gives way to forces at markers, while its conditions at base and contact hold."""

from dataclasses import dataclass, replace

import numpy as np

from geometry.arrays import BoolArray, FloatArray
from solvers.assimilation.marker_forces import MarkerForces
from solvers.assimilation.misfit import Misfit
from solvers.fem.linear_equilibrium import LinearElasticity, LinearEquilibrium
from solvers.lagrange import LagrangeSpace
from solvers.problem import Problem


@dataclass(frozen=True, eq=False)
class MarkerCompliance:
    """Finite-element displacements without and under forces at m markers.

    Attributes:
        equilibrium: The factorised problem; its factors are to be destroyed after use.
        undisturbed: Nodal displacements without forces at the markers, shape (N, 2), mm.
        sampling: The mean over a marker, by which nodal values give its displacement, shape (m, N).
        responses: Nodal displacements under a unit force at each component of each marker, while base and
            load hold at zero, shape (2 m, N, 2), mm per N/mm.
    """

    equilibrium: LinearEquilibrium
    undisturbed: FloatArray
    sampling: FloatArray
    responses: FloatArray

    @classmethod
    def of(cls, problem: Problem, degree: int, misfit: Misfit, slack: float = 0.0) -> "MarkerCompliance":
        """Factorise once; solve once for the problem and once for every component of a marker.

        Args:
            problem: With the conditions that hold.
            degree: Of the elements.
            misfit: Where the markers are.
            slack: Compliance of springs between contact and indenter, mm per N/mm, for `mean` and `point`.
        """
        space = LagrangeSpace(problem.mesh, degree)
        equilibrium = replace(LinearEquilibrium.of(LinearElasticity.of(problem, space)), slack=slack)
        points, weights = misfit.sampling()
        sampling = weights @ space.shape_functions(problem.mesh.locate(points)).toarray()
        forces = np.kron(sampling, np.eye(2)).reshape(-1, *equilibrium.held.shape)
        responses = np.array([equilibrium.response(force) for force in forces]).reshape(forces.shape)
        return cls(equilibrium, equilibrium.solution(), sampling, responses)

    def of_markers(self, chosen: BoolArray) -> "MarkerCompliance":
        """The same for those markers only that a mask of shape (m,) chooses."""
        both = np.repeat(chosen, 2)
        return replace(self, sampling=self.sampling[chosen], responses=self.responses[both])

    def forces(self, misfit: Misfit) -> MarkerForces:
        """The minimisers of energy plus misfit, in terms of the forces at the markers."""
        moved = np.einsum("mn,knx->kmx", self.sampling, self.responses)
        compliance = moved.reshape(len(moved), len(moved))
        missed = misfit.observed - self.sampling @ self.undisturbed
        return MarkerForces(0.5 * (compliance + compliance.T), misfit.weights, missed)

    def under(self, forces: FloatArray) -> FloatArray:
        """Nodal displacements under forces at the markers, shape (m, 2), N/mm: shape (N, 2), mm."""
        return np.asarray(self.undisturbed + np.einsum("k,knx->nx", forces.ravel(), self.responses))
