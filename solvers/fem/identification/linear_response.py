"""Response of the finger, its derivatives by the parameters at an equilibrium, and its observations.

With the internal force F, the functionals b_k of the load and their values d_k the equilibrium is
F(c, θ) = f_k b_k(θ), b_k(θ) . c = d_k(θ). With the tangent K there, the derivative by a parameter, written ',
costs one back-substitution:

    K c' - f_k' b_k = f_k b_k' - dF/dθ,   b_k . c' = d_k' - b_k' . c
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from geometry.arrays import FloatArray
from geometry.errors import UserError
from geometry.observations import Observations
from solvers.assimilation.estimation import Estimate, Prediction
from solvers.assimilation.misfit import MarkerSettings, misfit_of, standard_deviations
from solvers.constrained_elimination import ConstrainedElimination
from solvers.fem.boundary_conditions import marker_functionals
from solvers.lagrange import LagrangeSpace
from solvers.problem import Problem, contact_functional


@dataclass(frozen=True, eq=False)
class Response:
    """Displacements and forces, and their derivatives by p parameters.

    Attributes:
        nodal: Displacements, shape (N, 2), mm.
        forces: At the prescribed components, shape (k,), N/mm.
        nodal_slopes: Shape (p, N, 2).
        force_slopes: Shape (p, k).
        energy: Elastic energy of the body per depth, N mm / mm; without that of a layer at the base.
    """

    nodal: FloatArray
    forces: FloatArray
    nodal_slopes: FloatArray
    force_slopes: FloatArray
    energy: float

    @classmethod
    def of(
        cls,
        problem: Problem,
        space: LagrangeSpace,
        names: Sequence[str],
        equilibrium: tuple[FloatArray, FloatArray, float],
        solve: Callable[[FloatArray], FloatArray],
        load: ConstrainedElimination,
        force_slope: Callable[[str], FloatArray],
    ) -> "Response":
        """Solve once for each parameter.

        Args:
            problem: With the values of the parameters.
            space: The elements.
            names: The parameters.
            equilibrium: `nodal`, `forces` and `energy`.
            solve: K^-1 of nodal forces, shape (N, 2).
            load: The load's functionals b_k.
            force_slope: From a parameter to dF/dθ, shape (N, 2).
        """
        nodal, forces, energy = equilibrium
        slopes = []
        for name in names:
            moved = _moved_functionals(name, problem, space)
            free = solve(np.tensordot(forces, moved, axes=1) - force_slope(name))
            target = np.array([float(name == f"stroke_{'uv'[axis]}") for axis in problem.load.prescribed])
            slopes.append(load.solution(free, target - np.tensordot(moved, nodal)))
        return cls(
            nodal,
            forces,
            np.array([slope for slope, _ in slopes]).reshape(-1, *nodal.shape),
            np.array([slope for _, slope in slopes]).reshape(-1, len(forces)),
            energy,
        )


def _moved_functionals(name: str, problem: Problem, space: LagrangeSpace) -> FloatArray:
    """Derivatives of `load_functionals` by a parameter, shape (k, N, 2).

    The weight moves with the contact: by its position, the mean of the displacement over it changes by the
    mean of du/dx.
    """
    slopes = np.zeros((len(problem.load.prescribed), len(space.nodes), 2))
    if name == "position":
        points, weights = contact_functional(problem)
        along = space.shape_gradients(problem.mesh.locate(points))[0].T @ weights
        for row, axis in enumerate(problem.load.prescribed):
            slopes[row, :, axis] = along
    return slopes


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
        misfit = misfit_of(replace(problem, observations=observations), MarkerSettings(marker_radius=radius))
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
