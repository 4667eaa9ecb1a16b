"""The measurement that unknowns are sought from: markers and, if known, the force."""

from dataclasses import dataclass, replace

import numpy as np

from geometry.arrays import FloatArray, IntArray
from geometry.errors import UserError
from geometry.observations import Observations
from solvers.assimilation.estimation import Prediction
from solvers.assimilation.misfit import MarkerSettings, Misfit, misfit_of, standard_deviations
from solvers.identification.response import MarkerModel, Response
from solvers.problem import Problem


@dataclass(frozen=True, eq=False)
class Reading:
    """A measurement of markers and, if known, of the force.

    Attributes:
        misfit: The markers that were seen and are believed.
        deviations: Their standard deviations, shape (m, 2), mm.
        kept: Which of the markers that were seen these are, shape (seen,).
        reaction: Force of the indenter along y per depth, with its standard deviation, N/mm.
    """

    misfit: Misfit
    deviations: FloatArray
    kept: IntArray
    reaction: tuple[float, float] | None = None

    @classmethod
    def of(
        cls,
        problem: Problem,
        observations: Observations,
        radius: float | None,
        reaction: tuple[float, float] | None,
    ) -> "Reading":
        """All markers that were seen; see `MarkerSettings.marker_radius` for the radius, mm."""
        settings = MarkerSettings(marker_radius=radius)
        misfit = misfit_of(replace(problem, observations=observations), settings)
        if misfit is None or not len(misfit.points):
            raise UserError("there are no markers to find a force by")
        return cls(misfit, standard_deviations(observations), np.arange(len(misfit.points)), reaction)

    def without(self, marker: int) -> "Reading":
        """The reading without one of its markers."""
        return replace(
            self,
            misfit=self.misfit.without(marker),
            deviations=np.delete(self.deviations, marker, axis=0),
            kept=np.delete(self.kept, marker),
        )

    def only(self, kept: IntArray) -> "Reading":
        """The reading of some of its markers, by their numbers among those that were seen, ascending."""
        found = self
        for place in np.flatnonzero(~np.isin(self.kept, kept))[::-1]:
            found = found.without(int(place))
        return found

    @property
    def observed(self) -> FloatArray:
        """Displacements u v u v ..., then the reaction if there is one."""
        return self._joined(self.misfit.observed, 0)

    @property
    def noise(self) -> FloatArray:
        """Standard deviations of `observed`."""
        return self._joined(self.deviations, 1)

    def _joined(self, values: FloatArray, which: int) -> FloatArray:
        return np.append(values.ravel(), [] if self.reaction is None else [self.reaction[which]])

    def predicted(self, markers: MarkerModel, response: Response) -> Prediction:
        """Predictions of `observed`, with their derivatives."""
        values, slopes = markers.predicted(response)
        if self.reaction is None:
            return values, slopes
        along_y = markers.unknowns.force_slopes()[:, 1]
        return np.append(values, response.hypothesis.force[1]), np.vstack([slopes, along_y])
