"""Observations of a finger: displacements of its markers and, if measured, the reaction."""

from dataclasses import dataclass, replace

import numpy as np

from geometry.arrays import FloatArray
from geometry.errors import UserError
from geometry.observations import Observations
from solvers.assimilation.estimation import Estimate, Prediction
from solvers.assimilation.misfit import misfit_of, standard_deviations
from solvers.fem.boundary_conditions import marker_functionals
from solvers.fem.identification.response import Response
from solvers.lagrange import LagrangeSpace
from solvers.problem import Problem


@dataclass(frozen=True, eq=False)
class ObservationModel:
    """Observations of the m markers that were seen, in the order u v u v ..., then of the reaction if any.

    Attributes:
        functionals: From nodal displacements to the markers', shape (2 m, N, 2).
        observed: Shape (2 m,) or (2 m + 1,), mm and N/mm.
        deviations: Their standard deviations, of the same shape.
        axis: Index of the reaction among the load's prescribed components; None if it was not measured.
    """

    functionals: FloatArray
    observed: FloatArray
    deviations: FloatArray
    axis: int | None = None

    @classmethod
    def of(
        cls, problem: Problem, space: LagrangeSpace, observations: Observations, radius: float | None
    ) -> "ObservationModel":
        """Of the markers alone, each the mean over a disc of the radius, mm; None: the observations' own."""
        misfit = misfit_of(replace(problem, observations=observations), marker_radius=radius)
        if misfit is None:
            raise UserError("there are no markers to find parameters by")
        deviations = standard_deviations(observations).ravel()
        return cls(marker_functionals(misfit, space), misfit.observed.ravel(), deviations)

    def with_reaction(self, problem: Problem, reaction: float, deviation: float) -> "ObservationModel":
        """The model with the reaction along y and its standard deviation added, N/mm.

        Raises:
            UserError: If the load leaves v free.
        """
        if 1 not in problem.load.prescribed:
            raise UserError("v of the load is free, so that there is no reaction along y to measure")
        return replace(
            self,
            observed=np.append(self.observed, reaction),
            deviations=np.append(self.deviations, deviation),
            axis=problem.load.prescribed.index(1),
        )

    def predicted(self, response: Response) -> Prediction:
        """Predictions of a model, with their derivatives."""
        values = np.tensordot(self.functionals, response.nodal)
        slopes = np.tensordot(self.functionals, response.nodal_slopes, axes=((1, 2), (1, 2)))
        if self.axis is None:
            return values, slopes
        forces, force_slopes = response.forces[self.axis], response.force_slopes[:, self.axis]
        return np.append(values, forces), np.vstack([slopes, force_slopes])

    def missed(self, found: Estimate) -> FloatArray:
        """Predicted minus observed displacements of the markers, shape (m, 2), mm."""
        return self._markers(found.residuals * found.inflation * self.deviations)

    def missed_without_each(self, found: Estimate) -> FloatArray:
        """Predicted minus observed displacements, each marker predicted by the others, shape (m, 2), mm."""
        residuals = np.zeros_like(self.observed)
        for rows in np.arange(self._markers(residuals).size).reshape(-1, 2):
            residuals[rows] = found.left_out(rows)
        return self._markers(residuals * found.inflation * self.deviations)

    def _markers(self, values: FloatArray) -> FloatArray:
        return values[: len(self.functionals)].reshape(-1, 2)
