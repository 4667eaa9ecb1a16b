"""`pinn-std`: the paper's gated architecture with random hidden weights, at least potential energy."""

import time
from dataclasses import asdict, dataclass
from typing import ClassVar

import numpy as np
import torch

from geometry.arrays import FloatArray
from geometry.errors import UserError
from geometry.quadrature import Quadrature, body_quadrature
from solvers.pinn.energy import Minimum, QuadraticEnergy
from solvers.pinn.gated_units import GatedUnits
from solvers.pinn.trial_space import BaseFactor, NetworkField, TrialUnits
from solvers.problem import Problem, contact_functional
from solvers.solution import Solution, State, Status
from solvers.solver import Progress, check_problem, silent

HISTORY = ("units", "energy", "relative_change", "relative_stress_change", "seconds")


@dataclass(frozen=True)
class PinnStdSolver:
    """A gated modified MLP that grows in rounds, its output layer solved exactly in each.

    The hidden weights stay as they were drawn; only the output layer is fitted, and both components share the
    units. The energy is quadratic in the output layer, so that its minimiser under the load's conditions is
    one Cholesky factorisation; the clamp is a factor of the network. Every round adds hidden units around
    points drawn with a density that is the square root of the present solution's energy density (uniform at
    first), and stops when a round changes the displacement by less than `tolerance`.

    Attributes:
        units: Hidden units added in a round.
        rounds: The most rounds.
        tolerance: Relative L2 change of the displacement in a round below which it has settled; the error
            is a few times larger, and that of the stress larger still.
        gate_width: Half width of the region where a unit's gate is open in the first round, mm.
        width_ratio: By how much that is multiplied from round to round.
        encoder_slope: Slope of the encoders, 1/mm.
        gate_steepness: Steepness of the gates.
        base_length: Distance from the base at which the hard condition's factor is one half, mm.
        seed: Of the random numbers.
    """

    units: int = 500
    rounds: int = 6
    tolerance: float = 0.005
    gate_width: float = 3.0
    width_ratio: float = 1.0
    encoder_slope: float = 0.3
    gate_steepness: float = 2.0
    base_length: float = 5.0
    seed: int = 0
    name: ClassVar[str] = "pinn-std"
    laws: ClassVar[tuple[str, ...]] = ("linear",)
    loads: ClassVar[tuple[str, ...]] = ("mean", "point")

    def __post_init__(self) -> None:
        if self.seed < 0:
            raise UserError(f"pinn-std: seed must be zero or more, got {self.seed}")
        if self.units < 1 or self.rounds < 2:
            raise UserError(
                "pinn-std needs at least 1 unit a round and 2 rounds, to see whether it has converged"
            )
        for setting in (
            "tolerance",
            "gate_width",
            "width_ratio",
            "encoder_slope",
            "gate_steepness",
            "base_length",
        ):
            if not getattr(self, setting) > 0:
                raise UserError(f"pinn-std: {setting} must be positive, got {getattr(self, setting)}")

    def settings(self) -> dict[str, object]:
        """The preset that this is, size, initialisation, criterion and seed."""
        return {"preset": "fast", **asdict(self)}

    def solve(self, problem: Problem, progress: Progress = silent) -> Solution:
        """Solve the linear problem; see `Solver`."""
        check_problem(self, problem)
        started = time.perf_counter()
        rng = np.random.default_rng(self.seed)
        factor = BaseFactor.of(problem.mesh, self.base_length)
        quadrature = body_quadrature(problem.mesh)
        points, weights, centroids = map(
            _tensor, (quadrature.location.points, quadrature.weights, problem.mesh.at_centroids().points)
        )
        contact_points, contact_weights, prescribed = map(
            _tensor, (*contact_functional(problem), problem.load.values)
        )
        energy = QuadraticEnergy(weights, problem.material.lame)
        rounds: list[TrialUnits] = []
        at_centroids: list[torch.Tensor] = []
        at_contact: list[torch.Tensor] = []
        density, before = np.ones(len(points)), torch.zeros(len(centroids), 2)
        history: list[tuple[float, ...]] = []
        for number in range(self.rounds):
            shrink = self.width_ratio**number
            units = GatedUnits.around(
                _draw_points(problem, quadrature, density, self.units, rng),
                width=self.gate_width * shrink,
                slope=self.encoder_slope / shrink,
                steepness=self.gate_steepness,
                rng=rng,
            )
            new = TrialUnits(units, factor)
            rounds.append(new)
            energy.add(*new.derivatives(points))
            at_centroids.append(new.values(centroids))
            at_contact.append(new.values(contact_points).T @ contact_weights)
            best = energy.minimise(torch.cat(at_contact), problem.load.prescribed, prescribed)
            displacement = torch.cat(at_centroids, dim=1) @ best.output
            change = _relative_change(displacement, before, _tensor(problem.mesh.areas))
            before = displacement
            stress_change = _stress_change(best.energy, history[-1][1] if history else float("inf"))
            seconds = time.perf_counter() - started
            history.append((len(best.output), best.energy, change, stress_change, seconds))
            progress(
                (number + 1) / self.rounds, f"{len(best.output)} units, energy {best.energy:.4f} N mm/mm"
            )
            if change <= self.tolerance:
                break
            state = State.from_gradient(energy.gradient(best.output).numpy(), problem)
            density = np.sqrt(state.energy_density)
        units = GatedUnits.joined([trial.units for trial in rounds])
        field = NetworkField(TrialUnits(units, factor), best.output)
        return self._solution(problem, field, best, np.array(history), time.perf_counter() - started)

    def _solution(
        self, problem: Problem, field: NetworkField, best: Minimum, history: FloatArray, seconds: float
    ) -> Solution:
        reaction = np.zeros(2)
        reaction[problem.load.prescribed] = best.forces.numpy()
        change = float(history[-1, 2])
        converged = change <= self.tolerance
        message = (
            f"the last {self.units} units changed the displacement by {change:.2%} "
            f"(criterion {self.tolerance:.2%}) and the stress, in the energy norm, by {history[-1, 3]:.0%}; "
            "the errors themselves are a few times larger than these changes"
        )
        if not converged:
            message += "; take more rounds or more units"
        return Solution(
            solver=self.name,
            problem=problem,
            field=field,
            energy=best.energy,
            reaction=reaction,
            status=Status(converged, message),
            stats={
                "seconds": seconds,
                "unknowns": 2 * field.trial.units.count,
                "units": field.trial.units.count,
                "quadrature_points": len(body_quadrature(problem.mesh).weights),
                "regularisation": best.regularisation,
                "seed": self.seed,
                "device": "cpu",
            },
            history=dict(zip(HISTORY, history.T, strict=True)),
        )


def _draw_points(
    problem: Problem, quadrature: Quadrature, density: FloatArray, count: int, rng: np.random.Generator
) -> FloatArray:
    """Points of the body drawn with a density given at the quadrature points, shape (count, 2), mm."""
    mesh = problem.mesh
    share = (quadrature.weights * density).reshape(len(mesh.triangles), -1).sum(axis=1)
    chosen = rng.choice(len(share), count, p=share / share.sum())
    barycentric = rng.dirichlet(np.ones(3), count)
    return np.asarray(np.einsum("nc,ncx->nx", barycentric, mesh.points[mesh.triangles[chosen]]))


def _relative_change(now: torch.Tensor, before: torch.Tensor, areas: torch.Tensor) -> float:
    """Relative L2 norm of the change of a displacement given at the centroids, (t, 2)."""
    square = (areas[:, None] * (now - before) ** 2).sum() / (areas[:, None] * now**2).sum()
    return float(square.sqrt())


def _stress_change(energy: float, before: float) -> float:
    """Change of the stress in the energy norm, relative to the stress.

    In nested spaces the norm of the change between two minimisers is the square root of twice the energy
    gained.
    """
    return float(np.sqrt(max(before - energy, 0.0) / energy))


def _tensor(array: FloatArray) -> torch.Tensor:
    return torch.from_numpy(np.array(array, dtype=np.float64))
