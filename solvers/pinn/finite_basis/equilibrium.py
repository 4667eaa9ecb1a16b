"""One level of a finite-basis network: its energy, its load, and the Newton step to equilibrium."""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
import torch

from geometry.arrays import FloatArray, IntArray
from solvers.assimilation.marker_forces import MarkerForces
from solvers.assimilation.marker_weight import WeightChoice
from solvers.constrained_elimination import ConstrainedElimination
from solvers.pinn.finite_basis.energy import LocalEnergy
from solvers.pinn.finite_basis.load_conditions import load_conditions
from solvers.pinn.finite_basis.network import LocalField, LocalUnits
from solvers.pinn.marker_terms import Given
from solvers.problem import Problem

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


class Responses(NamedTuple):
    """How a network answers, with the second derivative of its energy at some output layer.

    Attributes:
        residual: First derivative of the energy there, shape (U,), N/mm.
        free: Newton's step without springs, shape (U,), mm.
        unit: Steps by unit forces of the springs, shape (n, U), mm per N/mm.
    """

    residual: FloatArray
    free: FloatArray
    unit: FloatArray


@dataclass(frozen=True, eq=False)
class Level:
    """The energy of a network that springs pull on.

    A spring pulls a functional of the displacement to a value. Those of the load are rigid, or nearly so;
    those of what is observed yield by 1 / weight per force, which makes their energy the misfit.

    Attributes:
        energy: The energy.
        functionals: Of the output layer, shape (n, U): the load's, then those that are observed.
        values: What they are pulled to, shape (n,), mm.
        compliance: How far they yield, shape (n,), mm per N/mm.
        load: Shape (a, k) of the load's functionals: k for each of a components.
        choice: How a factor of the weights of what is observed is chosen; None where nothing is.
    """

    energy: LocalEnergy
    functionals: FloatArray
    values: FloatArray
    compliance: FloatArray
    load: tuple[int, ...]
    choice: WeightChoice | None

    @classmethod
    def of(
        cls,
        units: LocalUnits,
        problem: Problem,
        points: FloatArray,
        weights: FloatArray,
        given: Given | None = None,
    ) -> "Level":
        """The level of some units with a quadrature: points (q, 2), mm, and weights (q,), mm^2."""
        conditions = load_conditions(problem)
        functionals = _functionals(units, conditions.points, conditions.weights, problem.load.prescribed)
        size, values = functionals.shape[-1], conditions.values.ravel()
        functionals, compliance = functionals.reshape(-1, size), np.zeros(len(values))
        if given is not None:
            misfit = given.misfit
            pulled = _functionals(units, *misfit.sampling(), [0, 1]).swapaxes(0, 1).reshape(-1, size)
            functionals = np.concatenate([functionals, pulled])
            values = np.concatenate([values, misfit.observed.ravel()])
            compliance = np.concatenate([compliance + given.slack, 1 / misfit.weights.ravel()])
        return cls(
            LocalEnergy.of(units, problem.material, points, weights),
            functionals,
            values,
            compliance,
            conditions.values.shape,
            None if given is None else given.choice,
        )

    @property
    def rest(self) -> torch.Tensor:
        """The output layer without displacement."""
        units = self.energy.units
        return torch.zeros(units.windows.count, 2, units.per_window, dtype=torch.float64)

    @property
    def held(self) -> int:
        """How many springs are the load's, a k: the first ones."""
        return int(np.prod(self.load))

    def reaction(self, forces: FloatArray) -> FloatArray:
        """The indenter's force for each prescribed component, shape (a,), N/mm, among the springs' (n,)."""
        of_load: FloatArray = forces[: self.held].reshape(self.load)
        return of_load[:, 0]

    def marker_stats(self, state: Equilibrium) -> dict[str, float]:
        """The factor of the weights, the energy of the markers' springs, N mm/mm, and the largest force."""
        if self.choice is None:
            return {}
        pulled = state.forces[self.held :].reshape(-1, 2)
        yielding = self.compliance[self.held :].reshape(-1, 2) / state.factor
        return {
            "weight_factor": state.factor,
            "misfit": 0.5 * float((yielding * pulled**2).sum()),
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
        found = self.respond(output)
        return None if found is None else self.balance(output, found, fraction)

    def respond(self, output: torch.Tensor) -> Responses | None:
        """One factorisation, and a solution for every spring; None as in `step`."""
        slope, hessian = self.energy.derivatives(output)
        if not torch.isfinite(slope).all():
            return None
        residual = slope.numpy().ravel()
        free, *unit = hessian.solve(
            np.concatenate([-residual[None], self.functionals]),
            REGULARISATION,
            definite=self.energy.material.law == "linear",
        )
        return Responses(residual, free, np.array(unit))

    def balance(self, output: torch.Tensor, found: Responses, fraction: float = 1.0) -> Equilibrium:
        """The step by the forces of the springs that close their gaps."""
        residual, free, unit = found
        springs = ConstrainedElimination(self.functionals, unit, self.compliance)
        values = fraction * self.values - springs.values(output.numpy())
        markers = self._markers(springs, values - springs.values(free))
        factor = self.choice.factor(markers) if self.choice and markers else 1.0
        scaled = np.append(self.compliance[: self.held], self.compliance[self.held :] / factor)
        change, forces = replace(springs, compliance=scaled).solution(free, values)
        decrement = (forces @ self.functionals - residual) @ change
        return Equilibrium(
            output + torch.from_numpy(change).view_as(output),
            forces,
            float(abs(decrement / (fraction * self.values @ forces))),
            markers,
            factor,
        )

    def told(self, given: Given, rows: IntArray) -> "Level":
        """The level with some of its springs, all of the load's among them, the others as they are given."""
        held, misfit = self.held, given.misfit
        return replace(
            self,
            functionals=self.functionals[rows],
            values=np.concatenate([self.values[:held], misfit.observed.ravel()]),
            compliance=np.concatenate([self.compliance[:held], 1 / misfit.weights.ravel()]),
            choice=given.choice,
        )

    def _markers(self, springs: ConstrainedElimination, gap: FloatArray) -> MarkerForces | None:
        """The observed markers, whatever force the load needs.

        Args:
            springs: All springs.
            gap: What they have to close, shape (n,), mm.
        """
        if self.energy.material.law != "linear" or self.choice is None:
            return None
        load, soft = slice(self.held), slice(self.held, None)
        given, stiff = springs.flexibility, springs.schur_complement[load, load]
        held = np.linalg.solve(stiff, np.column_stack([given[load, soft], gap[load]]))
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
