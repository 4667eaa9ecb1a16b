"""One level of a finite-basis network: its energy, its load, and the Newton step to equilibrium."""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
import torch

from geometry.arrays import FloatArray
from solvers.pinn.conditions import load_conditions
from solvers.pinn.local_energy import LocalEnergy
from solvers.pinn.local_units import LocalField, LocalUnits
from solvers.problem import Problem

REGULARISATION = 1e-12
"""Added to the unit diagonal of the scaled system, so that nearly dependent units do no harm."""


class Equilibrium(NamedTuple):
    """Where a Newton step leads.

    Attributes:
        output: Output layer, shape (c, 2, m + 1), mm.
        forces: Multipliers of the load's functionals, shape (a, k), N/mm.
        change: Twice the energy of the step over the work of the load: small where Newton has converged.
    """

    output: torch.Tensor
    forces: FloatArray
    change: float


@dataclass(frozen=True, eq=False)
class Level:
    """The energy of a network under a load.

    Attributes:
        energy: The energy.
        functionals: The load's functionals on the output layer, shape (a k, U).
        values: What they are to be, shape (a k,), mm.
        axes: How many components are prescribed, a.
    """

    energy: LocalEnergy
    functionals: FloatArray
    values: FloatArray
    axes: int

    @classmethod
    def of(cls, units: LocalUnits, problem: Problem, points: FloatArray, weights: FloatArray) -> "Level":
        """The level of some units with a quadrature: points (q, 2), mm, and weights (q,), mm^2."""
        conditions = load_conditions(problem)
        functionals = np.zeros((*conditions.values.shape, units.windows.count, 2, units.per_window))
        for row, axis in enumerate(problem.load.prescribed):
            functionals[row, :, :, axis] = units.functionals(conditions.points, conditions.weights)
        return cls(
            LocalEnergy.of(units, problem.material, points, weights),
            functionals.reshape(conditions.values.size, -1),
            conditions.values.ravel(),
            len(conditions.values),
        )

    @property
    def rest(self) -> torch.Tensor:
        """The output layer without displacement."""
        units = self.energy.units
        return torch.zeros(units.windows.count, 2, units.per_window, dtype=torch.float64)

    def field(self, output: torch.Tensor) -> LocalField:
        """The displacement that an output layer gives."""
        return LocalField(self.energy.units, output)

    def step(self, output: torch.Tensor, fraction: float = 1.0) -> Equilibrium | None:
        """One Newton step to equilibrium under a fraction of the load; for a linear law it is the solution.

        With K the second derivative of the energy and r its first, y = K^-1 (-r) and x_k = K^-1 b_k for the
        functionals b_k; the step is y + f_k x_k with the forces f that make it meet the conditions.

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
        forces = np.linalg.solve(self.functionals @ np.transpose(responses), gap)
        change = free + forces @ np.array(responses)
        decrement = (forces @ self.functionals - residual) @ change
        return Equilibrium(
            output + torch.from_numpy(change).view_as(output),
            forces.reshape(self.axes, -1),
            float(abs(decrement / (fraction * self.values @ forces))),
        )

    def nearest(self, field: LocalField) -> torch.Tensor:
        """The output layer whose displacement is nearest to another network's in the linear energy."""
        material = self.energy.material.model_copy(update={"law": "linear"})
        found = replace(self, energy=replace(self.energy, material=material, origin=field)).step(self.rest)
        return self.rest if found is None else found.output
