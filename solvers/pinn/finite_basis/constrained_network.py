"""Energy of a finite-basis network plus quadratic terms for load and markers, and its Newton step."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
import torch

from pinnray.runtime.arrays import FloatArray
from pinnray.solvers.assimilation.marker_forces import MarkerForces
from pinnray.solvers.assimilation.misfit import MarkerSettings
from pinnray.solvers.constrained_elimination import ConstrainedElimination
from pinnray.solvers.pinn.finite_basis.energy import REGULARISATION, NetworkEnergy
from pinnray.solvers.pinn.finite_basis.load_conditions import load_conditions
from pinnray.solvers.pinn.finite_basis.network import FiniteBasis, FiniteBasisField
from pinnray.solvers.problem import Problem

INVERSE_ITERATIONS = 3
"""Enough to leave soft directions of an unstable equilibrium, not only the softest."""


class NewtonIterate(NamedTuple):
    """Result of a Newton step."""

    output: torch.Tensor  # Output layer, shape (c, 2, m + 1), mm
    forces: FloatArray  # Of the springs, shape (n,), N/mm
    change: float  # Twice the energy of the step over the work of the load: small where Newton has converged
    # The forces at the markers for all factors of their weights; None at finite strain
    markers: MarkerForces | None = None
    factor: float = 1.0  # The factor taken
    unstable: int = 0  # Number of directions in which the energy falls at the output layer before the step
    # Elastic energy per depth, N mm/mm, where it is quadratic and so half of the forces' work
    energy: float | None = None


class PointSprings(NamedTuple):
    """Springs that pull k weighted means of the displacement at q points, each by a of its components."""

    points: FloatArray  # Shape (q, 2), mm
    weights: FloatArray  # Shape (k, q)
    axes: list[int]  # The components, (a,)

    def functionals(self, basis: FiniteBasis) -> FloatArray:
        """Functionals of the output layer, those of a mean's components together, shape (k a, U)."""
        count = len(self.weights), len(self.axes)
        found = np.zeros((*count, basis.windows.count, 2, basis.per_window))
        means = basis.functionals(self.points, self.weights)
        for number, axis in enumerate(self.axes):
            found[:, number, :, axis] = means
        return found.reshape(-1, 2 * basis.size)

    def neuron_slopes(self, basis: FiniteBasis, forces: FloatArray, output: torch.Tensor) -> torch.Tensor:
        """Derivatives by the neurons, (3, m, c), of the work that forces (k a,) do, N mm/mm."""
        weights = np.zeros((len(self.points), 2))
        weights[:, self.axes] = self.weights.T @ forces.reshape(-1, len(self.axes))
        return basis.slopes_of_values(self.points, weights, output)


@dataclass(frozen=True, eq=False)
class ConstrainedNetwork:
    """A network with springs, each of which pulls a functional of its displacement to a target.

    Springs of the load are rigid; those of the markers have the compliance 1 / weight, which
    makes their energy the misfit.
    """

    energy: NetworkEnergy  # The elastic energy
    functionals: FloatArray  # Of the output layer, shape (n, U): the load's, then the markers'
    targets: FloatArray  # Their prescribed or observed values, shape (n,), mm
    compliance: FloatArray  # Of the springs, shape (n,), mm per N/mm
    springs: tuple[PointSprings, ...]  # Where these functionals come from: the load, then the markers
    weighting: MarkerSettings | None  # Chooses a factor of the markers' weights; None without markers
    factor: float | None = None  # That factor, where it is held

    @classmethod
    def of(
        cls, energy: NetworkEnergy, problem: Problem, weighting: MarkerSettings | None = None
    ) -> "ConstrainedNetwork":
        """The network of an energy under the load and, with a weighting, the markers of a problem."""
        points, weights, values = load_conditions(problem)
        springs, targets = [PointSprings(points, weights, problem.load.prescribed)], values.T.ravel()
        compliance = np.zeros(len(targets))
        misfit = None if weighting is None else weighting.misfit(problem)
        if weighting is not None and misfit is not None:
            springs.append(PointSprings(*misfit.sampling(), [0, 1]))
            targets = np.concatenate([targets, misfit.observed.ravel()])
            compliance = np.concatenate([compliance, 1 / misfit.weights.ravel()])
        functionals = _functionals(springs, energy.basis)
        weighting = weighting if misfit else None
        return cls(energy, functionals, targets, compliance, tuple(springs), weighting)

    def with_neurons(self, neurons: torch.Tensor, factor: float) -> "ConstrainedNetwork":
        """The network with other neurons (3, m, c), the factor of the markers' weights held."""
        basis = replace(self.energy.basis, neurons=neurons)
        functionals = _functionals(self.springs, basis)
        return replace(self, energy=replace(self.energy, basis=basis), functionals=functionals, factor=factor)

    @property
    def zero_output(self) -> torch.Tensor:
        """The output layer without displacement."""
        basis = self.energy.basis
        return torch.zeros(basis.windows.count, 2, basis.per_window, dtype=torch.float64)

    @property
    def load_count(self) -> int:
        """Number of springs of the load: the first ones."""
        return len(self.springs[0].axes) * len(self.springs[0].weights)

    def marker_stats(self, state: NewtonIterate) -> dict[str, float]:
        """The factor of the weights, the misfit, N mm / mm, and the largest force at a marker, N/mm."""
        if self.weighting is None:
            return {}
        forces = state.forces[self.load_count :].reshape(-1, 2)
        compliance = self.compliance[self.load_count :].reshape(-1, 2) / state.factor
        return {
            "weight_factor": state.factor,
            "misfit": 0.5 * float((compliance * forces**2).sum()),
            "marker_force": float(np.linalg.norm(forces, axis=1).max()),
        }

    def field(self, output: torch.Tensor) -> FiniteBasisField:
        """The displacement field of an output layer."""
        return FiniteBasisField(self.energy.basis, output)

    def step(
        self, output: torch.Tensor, fraction: float = 1.0, shift: float = REGULARISATION
    ) -> NewtonIterate | None:
        """One Newton step to equilibrium under a fraction of the load; for a linear law it is the solution.

        With K the second derivative of the energy and r its first, y = K^-1 (-r) and x_k = K^-1 b_k for the
        functionals b_k; the step is y + f_k x_k with the forces f by which every spring with compliance s_k
        is short of its target by s_k f_k. At its end the derivative of a quadratic energy is f_k b_k less the
        damping's part, and the energy half of its product with the output layer.

        Args:
            output: Where the network is linearised.
            fraction: Of the load.
            shift: Added to the unit diagonal of the scaled K.

        Returns:
            None if a point of the quadrature is inside out.
        """
        if self.energy.quadratic and shift == REGULARISATION and not output.any():
            gradient, factors = output, self.energy.factors_at_rest
        else:
            gradient, hessian = self.energy.derivatives(output)
            if not torch.isfinite(gradient).all():
                return None
            factors = hessian.factorised(shift, definite=self.energy.quadratic)
        residual = gradient.numpy().ravel()
        free, *responses = factors.solve(np.concatenate([-residual[None], self.functionals]))
        unit = np.reshape(responses, self.functionals.shape)
        springs = ConstrainedElimination(self.functionals, unit, self.compliance)
        values = fraction * self.targets - springs.values(output.numpy())
        markers = self._marker_forces(springs, values - springs.values(free))
        factor = self.factor or (self.weighting.factor(markers) if self.weighting and markers else 1.0)
        scaled = np.append(self.compliance[: self.load_count], self.compliance[self.load_count :] / factor)
        springs = replace(springs, compliance=scaled)
        change, forces = springs.solution(free, values)
        decrement = abs(float((forces @ self.functionals - residual) @ change))
        work = abs(float(fraction * self.targets @ forces))
        reached = output + torch.from_numpy(change).view_as(output)
        derivative = forces @ self.functionals - factors.damping * change
        energy = 0.5 * float(derivative @ reached.numpy().ravel()) if self.energy.quadratic else None
        share, unstable = decrement / work if work else decrement, springs.unstable(factors.negative)
        return NewtonIterate(reached, forces, share, markers, factor, unstable, energy)

    def at_rest(self) -> NewtonIterate:
        """The solution under the whole load, of a linear law."""
        found = self.step(self.zero_output)
        assert found is not None  # nothing is inside out at rest
        return found

    def softest(self, output: torch.Tensor) -> FloatArray:
        """A soft direction at an output layer, of its shape, by inverse iteration under the constraints."""
        _, hessian = self.energy.derivatives(output)
        factors = hessian.factorised(REGULARISATION, definite=False)
        springs = ConstrainedElimination(self.functionals, factors.solve(self.functionals), self.compliance)
        found = np.random.default_rng(0).standard_normal(self.functionals.shape[1])
        for _ in range(INVERSE_ITERATIONS):
            found, _ = springs.solution(factors.solve(found[None])[0])
            found /= np.abs(found).max()
        return found.reshape(output.shape)

    def least(self, state: NewtonIterate) -> tuple[float, torch.Tensor]:
        """Energy with that of the springs at an equilibrium, N mm/mm, and its derivatives by the neurons.

        The output layer minimises it, so that only the neurons' own part counts. Source: G. Golub,
        V. Pereyra, Inverse Problems 19 (2003) R1-R26 (variable projection).
        """
        soft = self.compliance.copy()
        soft[self.load_count :] /= state.factor
        value, slopes = self.energy.with_neuron_slopes(state.output)
        parts = np.split(state.forces, [self.load_count])
        for springs, forces in zip(self.springs, parts, strict=False):
            slopes -= springs.neuron_slopes(self.energy.basis, forces, state.output)
        return value + 0.5 * float(soft @ state.forces**2), slopes

    def energy_with_springs(self, output: FloatArray, fraction: float) -> float:
        """Energy per depth with that of the springs that are not rigid, under a fraction of the load."""
        soft = self.compliance > 0
        flat = self.functionals.reshape(len(self.functionals), -1)
        gaps = fraction * self.targets - flat @ output.ravel()
        elastic = self.energy.total(torch.from_numpy(output))
        return elastic + 0.5 * float((gaps[soft] ** 2 / self.compliance[soft]).sum())

    def _marker_forces(self, springs: ConstrainedElimination, gap: FloatArray) -> MarkerForces | None:
        """The forces at the markers, the load's forces eliminated, of springs that close gaps (n,), mm."""
        if not self.energy.quadratic or self.weighting is None:
            return None
        load, soft = slice(self.load_count), slice(self.load_count, None)
        flexibility, stiff = springs.flexibility, springs.schur_complement[load, load]
        held = np.linalg.solve(stiff, np.column_stack([flexibility[load, soft], gap[load]]))
        rest = np.column_stack([flexibility[soft, soft], gap[soft]]) - flexibility[soft, load] @ held
        reduced = 0.5 * (rest[:, :-1] + rest[:, :-1].T)
        return MarkerForces(reduced, 1 / self.compliance[soft].reshape(-1, 2), rest[:, -1].reshape(-1, 2))


def _functionals(springs: Sequence[PointSprings], basis: FiniteBasis) -> FloatArray:
    """Functionals of the output layer of all springs, shape (n, U)."""
    return np.concatenate([each.functionals(basis) for each in springs])
