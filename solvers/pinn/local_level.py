"""One level of a finite-basis network: its energy, its load, and the Newton step to equilibrium."""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
import torch

from geometry.arrays import FloatArray
from solvers.assimilation import Misfit
from solvers.marker_forces import MarkerForces
from solvers.pinn.conditions import load_conditions
from solvers.pinn.local_energy import LocalEnergy
from solvers.pinn.local_units import LocalField, LocalUnits
from solvers.problem import Problem
from solvers.weight_choice import WeightChoice

GIVEN = WeightChoice("given", None)
REGULARISATION = 1e-12
"""Added to the unit diagonal of the scaled system, so that nearly dependent units do no harm."""


class Equilibrium(NamedTuple):
    """Where a Newton step leads.

    Attributes:
        output: Output layer, shape (c, 2, m + 1), mm.
        forces: Of the level's springs, shape (n,), N/mm.
        change: Twice the energy of the step over the work of the load: small where Newton has converged.
        markers: The forces at observed markers for all factors of their weights; for a linear law alone.
        factor: That which was taken.
    """

    output: torch.Tensor
    forces: FloatArray
    change: float
    markers: MarkerForces | None = None
    factor: float = 1.0


@dataclass(frozen=True, eq=False)
class Level:
    """The energy of a network that springs pull on.

    A spring pulls a functional of the displacement to a value. Those of the load are rigid; those of what is
    observed yield by 1 / weight per force, which makes their energy the misfit.

    Attributes:
        energy: The energy.
        functionals: Of the output layer, shape (n, U): the load's, then those that are observed.
        values: What they are pulled to, shape (n,), mm.
        compliance: How far they yield, shape (n,), mm per N/mm.
        load: Shape (a, k) of the load's functionals: k for each of a components.
        choice: How a factor of the weights of what is observed is chosen.
    """

    energy: LocalEnergy
    functionals: FloatArray
    values: FloatArray
    compliance: FloatArray
    load: tuple[int, ...]
    choice: WeightChoice

    @classmethod
    def of(
        cls,
        units: LocalUnits,
        problem: Problem,
        points: FloatArray,
        weights: FloatArray,
        misfit: Misfit | None = None,
        choice: WeightChoice = GIVEN,
    ) -> "Level":
        """The level of some units with a quadrature: points (q, 2), mm, and weights (q,), mm^2.

        Args:
            units: The hidden units.
            problem: What is solved.
            points: Of the quadrature.
            weights: Of the quadrature.
            misfit: What is minimised with the energy.
            choice: How a factor of the misfit is chosen.
        """
        conditions = load_conditions(problem)
        rigid = _functionals(units, conditions.points, conditions.weights, problem.load.prescribed)
        size = rigid.shape[-1]
        functionals = [rigid.reshape(-1, size)]
        values, compliance = [conditions.values.ravel()], [np.zeros(conditions.values.size)]
        if misfit is not None and misfit.weights.any():
            soft = _functionals(units, *misfit.sampling(), [0, 1])
            functionals.append(soft.swapaxes(0, 1).reshape(-1, size))
            values.append(misfit.observed.ravel())
            compliance.append(1 / misfit.weights.ravel())
        return cls(
            LocalEnergy.of(units, problem.material, points, weights),
            np.concatenate(functionals),
            np.concatenate(values),
            np.concatenate(compliance),
            conditions.values.shape,
            choice,
        )

    @property
    def rest(self) -> torch.Tensor:
        """The output layer without displacement."""
        units = self.energy.units
        return torch.zeros(units.windows.count, 2, units.per_window, dtype=torch.float64)

    @property
    def rigid(self) -> int:
        """How many springs are the load's, which do not yield: a k, the first ones."""
        return int(np.prod(self.load))

    def reaction(self, forces: FloatArray) -> FloatArray:
        """The indenter's force for each prescribed component, shape (a,), N/mm, among the springs' (n,)."""
        of_load: FloatArray = forces[: self.rigid].reshape(self.load)
        return of_load[:, 0]

    def marker_stats(self, state: Equilibrium) -> dict[str, float]:
        """The factor of the weights, the springs' energy, N mm/mm, which is the misfit, the largest force."""
        if not self.compliance.any():
            return {}
        pulled = state.forces[self.rigid :].reshape(-1, 2)
        return {
            "weight_factor": state.factor,
            "misfit": 0.5 * float(self.compliance @ state.forces**2) / state.factor,
            "marker_force": float(np.linalg.norm(pulled, axis=1).max()),
        }

    def field(self, output: torch.Tensor) -> LocalField:
        """The displacement that an output layer gives."""
        return LocalField(self.energy.units, output)

    def step(self, output: torch.Tensor, fraction: float = 1.0) -> Equilibrium | None:
        """One Newton step to equilibrium under a fraction of the load; for a linear law it is the solution.

        With K the second derivative of the energy and r its first, y = K^-1 (-r) and x_k = K^-1 b_k for the
        functionals b_k; the step is y + f_k x_k with the forces f by which every spring with compliance s_k
        is short of its value by s_k f_k.

        Returns:
            None if a point of the quadrature is inside out.
        """
        slope, hessian = self.energy.derivatives(output)
        if not torch.isfinite(slope).all():
            return None
        residual = slope.numpy().ravel()
        free, *responses = hessian.solve(
            np.concatenate([-residual[None], self.functionals]),
            REGULARISATION,
            definite=self.energy.material.law == "linear",
        )
        gap = fraction * self.values - self.functionals @ (output.numpy().ravel() + free)
        given = self.functionals @ np.transpose(responses)
        markers = self._markers(given, gap)
        factor = 1.0 if markers is None else self.choice.factor(markers)
        forces = np.linalg.solve(given + np.diag(self.compliance) / factor, gap)
        change = free + forces @ np.array(responses)
        decrement = (forces @ self.functionals - residual) @ change
        return Equilibrium(
            output + torch.from_numpy(change).view_as(output),
            forces,
            float(abs(decrement / (fraction * self.values @ forces))),
            markers,
            factor,
        )

    def _markers(self, given: FloatArray, gap: FloatArray) -> MarkerForces | None:
        """The observed markers without the load, which holds its values.

        Args:
            given: How far the functionals give way to unit forces, shape (n, n), mm per N/mm.
            gap: What the springs have to close, shape (n,), mm.
        """
        if self.energy.material.law != "linear" or not self.compliance.any():
            return None
        load, soft = slice(self.rigid), slice(self.rigid, None)
        held = np.linalg.solve(given[load, load], np.column_stack([given[load, soft], gap[load]]))
        rest = np.column_stack([given[soft, soft], gap[soft]]) - given[soft, load] @ held
        compliance = 0.5 * (rest[:, :-1] + rest[:, :-1].T)
        return MarkerForces(compliance, 1 / self.compliance[soft].reshape(-1, 2), rest[:, -1].reshape(-1, 2))

    def nearest(self, field: LocalField) -> torch.Tensor:
        """The output layer whose displacement is nearest to another network's in the linear energy."""
        material = self.energy.material.model_copy(update={"law": "linear"})
        found = replace(self, energy=replace(self.energy, material=material, origin=field)).step(self.rest)
        return self.rest if found is None else found.output


def _functionals(units: LocalUnits, points: FloatArray, weights: FloatArray, axes: list[int]) -> FloatArray:
    """Sums of weights (k, q) times components of the displacement at points (q, 2): (a, k, U)."""
    found = np.zeros((len(axes), len(weights), units.windows.count, 2, units.per_window))
    for row, axis in enumerate(axes):
        found[row, :, :, axis] = units.functionals(points, weights)
    return found.reshape(len(axes), len(weights), -1)
