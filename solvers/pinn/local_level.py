"""One level of a finite-basis network: its energy, its load, and the Newton step to equilibrium."""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
import torch

from geometry.arrays import FloatArray
from solvers.assimilation import Misfit
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
        forces: Of the level's springs, shape (n,), N/mm.
        change: Twice the energy of the step over the work of the load: small where Newton has converged.
    """

    output: torch.Tensor
    forces: FloatArray
    change: float


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
    """

    energy: LocalEnergy
    functionals: FloatArray
    values: FloatArray
    compliance: FloatArray
    load: tuple[int, ...]

    @classmethod
    def of(
        cls,
        units: LocalUnits,
        problem: Problem,
        points: FloatArray,
        weights: FloatArray,
        misfit: Misfit | None = None,
    ) -> "Level":
        """The level of some units with a quadrature: points (q, 2), mm, and weights (q,), mm^2.

        Args:
            units: The hidden units.
            problem: What is solved.
            points: Of the quadrature.
            weights: Of the quadrature.
            misfit: What is minimised with the energy.
        """
        conditions = load_conditions(problem)
        rigid = _functionals(units, conditions.points, conditions.weights, problem.load.prescribed)
        functionals, values, compliance = [rigid], [conditions.values.ravel()], [np.zeros(len(rigid))]
        if misfit is not None and misfit.weights.any():
            functionals.append(_functionals(units, *misfit.sampling(), [0, 1]))
            values.append(misfit.observed.T.ravel())
            compliance.append(1 / misfit.weights.T.ravel())
        return cls(
            LocalEnergy.of(units, problem.material, points, weights),
            np.concatenate(functionals),
            np.concatenate(values),
            np.concatenate(compliance),
            conditions.values.shape,
        )

    @property
    def rest(self) -> torch.Tensor:
        """The output layer without displacement."""
        units = self.energy.units
        return torch.zeros(units.windows.count, 2, units.per_window, dtype=torch.float64)

    def reaction(self, forces: FloatArray) -> FloatArray:
        """The indenter's force for each prescribed component, shape (a,), N/mm, among the springs' (n,)."""
        of_load: FloatArray = forces[: np.prod(self.load)].reshape(self.load)
        return of_load[:, 0]

    def misfit(self, forces: FloatArray) -> float:
        """The energy of the springs, N mm/mm: what the observations add to what is minimised."""
        return 0.5 * float(self.compliance @ forces**2)

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
        compliance = self.functionals @ np.transpose(responses) + np.diag(self.compliance)
        forces = np.linalg.solve(compliance, gap)
        change = free + forces @ np.array(responses)
        decrement = (forces @ self.functionals - residual) @ change
        return Equilibrium(
            output + torch.from_numpy(change).view_as(output),
            forces,
            float(abs(decrement / (fraction * self.values @ forces))),
        )

    def nearest(self, field: LocalField) -> torch.Tensor:
        """The output layer whose displacement is nearest to another network's in the linear energy."""
        material = self.energy.material.model_copy(update={"law": "linear"})
        found = replace(self, energy=replace(self.energy, material=material, origin=field)).step(self.rest)
        return self.rest if found is None else found.output


def _functionals(units: LocalUnits, points: FloatArray, weights: FloatArray, axes: list[int]) -> FloatArray:
    """Sums of weights (k, q) times components of the displacement at points (q, 2): (a k, U)."""
    found = np.zeros((len(axes), len(weights), units.windows.count, 2, units.per_window))
    for row, axis in enumerate(axes):
        found[row, :, :, axis] = units.functionals(points, weights)
    return found.reshape(len(axes) * len(weights), -1)
