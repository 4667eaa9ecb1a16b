"""Finite-element displacements under point forces at the markers, and the markers' compliance."""

from dataclasses import dataclass, replace

import numpy as np

from geometry.arrays import BoolArray, FloatArray
from solvers.assimilation.marker_forces import MarkerForces
from solvers.assimilation.misfit import Misfit
from solvers.constrained_elimination import ConstrainedElimination
from solvers.fem.boundary_conditions import marker_functionals
from solvers.fem.linear_equilibrium import LinearElasticity, LinearEquilibrium
from solvers.lagrange import LagrangeSpace
from solvers.problem import Problem


@dataclass(frozen=True, eq=False)
class MarkerCompliance:
    """Finite-element displacements, free and under forces at m markers.

    Attributes:
        equilibrium: The factorised problem; its factors are to be destroyed after use.
        undisturbed: Nodal displacements without forces at the markers, shape (N, 2), mm.
        markers: The 2 m displacements of the markers as functionals, and the nodal displacements under their
            unit forces, while base and load hold at zero.
    """

    equilibrium: LinearEquilibrium
    undisturbed: FloatArray
    markers: ConstrainedElimination

    @classmethod
    def of(cls, problem: Problem, degree: int, misfit: Misfit, slack: float = 0.0) -> "MarkerCompliance":
        """Factorise once; solve once for the problem and once for every component of a marker.

        Args:
            problem: With the conditions that hold.
            degree: Degree of the elements.
            misfit: With the markers.
            slack: Compliance of springs between contact and indenter, mm per N/mm, for `mean` and `point`.
        """
        space = LagrangeSpace(problem.mesh, degree)
        equilibrium = LinearEquilibrium.of(LinearElasticity.of(problem, space), slack)
        markers = ConstrainedElimination.of(equilibrium.response, marker_functionals(misfit, space))
        return cls(equilibrium, equilibrium.solution(), markers)

    def of_markers(self, chosen: BoolArray) -> "MarkerCompliance":
        """Subset of the markers selected by a mask of shape (m,)."""
        both, markers = np.repeat(chosen, 2), self.markers
        return replace(self, markers=ConstrainedElimination(markers.rows[both], markers.responses[both]))

    def forces(self, misfit: Misfit) -> MarkerForces:
        """The minimisers of energy plus misfit, in terms of the forces at the markers."""
        compliance = self.markers.flexibility
        missed = misfit.observed - self.markers.values(self.undisturbed).reshape(-1, 2)
        return MarkerForces(0.5 * (compliance + compliance.T), misfit.weights, missed)

    def under(self, forces: FloatArray) -> FloatArray:
        """Nodal displacements under forces at the markers, shape (m, 2), N/mm: shape (N, 2), mm."""
        return self.undisturbed + np.tensordot(forces.ravel(), self.markers.responses, axes=1)
