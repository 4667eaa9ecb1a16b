"""Preset `trained` of `pinn-std` and `pinn-asm`: the paper's networks, all weights by Gauss-Newton steps."""

import math
import time
from collections.abc import Iterator
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import torch

from geometry.arrays import FloatArray
from geometry.mesh.boundary import mean_thickness
from geometry.mesh.point_location import LocatedPoints
from solvers.assimilation.misfit import Weighting
from solvers.energy_and_force import energy_and_force
from solvers.pinn.network_solver import NetworkSolver
from solvers.pinn.paper.modified_mlp import ModifiedMlp
from solvers.pinn.threading import map_in_threads, pool, slices
from solvers.pinn.trained.gauss_newton import TrainingStep, sampled_steps, subset_steps
from solvers.pinn.trained.squares import PIECE, Squares
from solvers.pinn.trained.streams import Streams
from solvers.problem import Problem
from solvers.solution import Solution, Status
from solvers.solver import Progress, check_problem, silent

OUTPUT = 0.7
"""Standard deviation of the first outputs, in strokes: larger ones make the energy nearly quadratic in the
weights, smaller ones leave less to undo."""

SETTLED = 0.01
"""Largest relative decrease of the energy over the last tenth of the steps of a converged training."""


@dataclass(frozen=True)
class TrainedPinnSolver(NetworkSolver):
    """The paper's two modified MLPs with hard conditions, every weight trained by Gauss-Newton's method.

    Attributes:
        width: Neurons in a layer.
        layers: Gated layers of each network.
        steepness: Slope of the first neurons over one mean thickness of the body's walls.
        base_length: Length over which the factor of the clamped base grows to one half, mm.
        sampled_steps: Steps of all weights, each from a sample of points.
        sample_points: Points of the largest sample.
        subset_steps: Steps of some of the weights.
        subset: Number of them, in each network.
        matrix_points: Points from which their matrix comes.
        seed: Of the random numbers.
    """

    width: int = 64
    layers: int = 4
    steepness: float = 1.0
    base_length: float = 5.0
    sampled_steps: int = 7
    sample_points: int = 1800
    subset_steps: int = 110
    subset: int = 1500
    matrix_points: int = 5000
    seed: int = 0
    name: ClassVar[str] = "pinn-std"
    preset: ClassVar[str] = "trained"

    def __post_init__(self) -> None:
        self.check_positive("width", "layers", "steepness", "base_length")
        self.check_positive("sample_points", "subset", "matrix_points")
        self.check_not_negative("sampled_steps", "subset_steps", "seed")
        _ = self.weighting

    def solve(self, problem: Problem, progress: Progress = silent) -> Solution:
        """Train on the problem; see `Solver`."""
        check_problem(self, problem)
        started = time.perf_counter()
        shape = ModifiedMlp(width=self.width, layers=self.layers)
        with pool():
            squares = Squares.of(problem, shape, self.misfit(problem), base_length=self.base_length)
            history: list[tuple[float, ...]] = []
            parameters = self.initial(squares, problem)
            for step in self._steps(squares, parameters):
                parameters = step.parameters
                misfit = squares.misfit(parameters)
                elapsed = time.perf_counter() - started
                history.append((len(history) + 1, step.value - misfit, misfit, elapsed))
                share = len(history) / (self.sampled_steps + self.subset_steps)
                progress(share, f"step {len(history)}, {self._minimised} {step.value:.4f} N mm/mm")
            field = TrainedField(squares.with_type(torch.float64), parameters.double())
            energy, reaction = energy_and_force(problem, field)
        columns = dict(
            zip(("step", "energy", "misfit", "seconds"), np.array(history).reshape(-1, 4).T, strict=True)
        )
        status = training_status(columns["energy"] + columns["misfit"], self._minimised)
        if not self.assimilates:
            del columns["misfit"]
        return Solution(
            solver=self.name,
            problem=problem,
            field=field,
            energy=energy,
            reaction=reaction,
            status=status,
            stats={
                "seconds": time.perf_counter() - started,
                "steps": len(history),
                "parameters": parameters.numel(),
                "quadrature_points": len(squares.body),
                "seed": self.seed,
                "device": "cpu",
            },
            history=columns,
        )

    @property
    def _minimised(self) -> str:
        return "energy and misfit" if self.assimilates else "energy"

    def _steps(self, squares: Squares, start: torch.Tensor) -> Iterator[TrainingStep]:
        for step in sampled_steps(squares, start, self.sample_points, self.sampled_steps, self.seed):
            start = step.parameters
            yield step
        yield from subset_steps(squares, start, self.subset, self.matrix_points, self.subset_steps, self.seed)

    def initial(self, squares: Squares, problem: Problem) -> torch.Tensor:
        """First weights, shape (2, parameters).

        The first neurons change fastest at points drawn from the body, in random directions; the other
        weights are normal, and the outputs have a standard deviation of `OUTPUT` strokes.
        """
        shape, frame = squares.shape, squares.frame
        parameters = shape.initial(self.seed, torch.float64)
        weights = shape.weights(parameters)
        first = weights.first
        generator = torch.Generator().manual_seed(self.seed)
        turn = torch.rand(first[:, :, 0].shape, generator=generator, dtype=torch.float64) * 2 * math.pi
        slope = self.steepness / mean_thickness(problem.mesh) * frame.half
        drawn = torch.multinomial(squares.body.weights, turn.numel(), replacement=True, generator=generator)
        centres = squares.body.inputs[0, drawn, :2].double().view(*turn.shape, 2)
        first[:, :, 0], first[:, :, 1] = slope * turn.cos(), slope * turn.sin()
        first[:, :, 2] = -slope * (turn.cos() * centres[..., 0] + turn.sin() * centres[..., 1])
        double = squares.with_type(torch.float64)
        spread = Streams.of(shape, parameters, double.body.inputs).output[:, 0].std(dim=1)
        stroke = float(np.abs(problem.load.values).max())
        weights.output.mul_((OUTPUT * stroke / spread)[:, None, None])
        return parameters.to(squares.body.weights.dtype)


@dataclass(frozen=True)
class TrainedPinnAsmSolver(TrainedPinnSolver):
    """The networks and the training of `TrainedPinnSolver`, with the markers' misfit beside the energy.

    Attributes:
        weights: As in `MarkerSettings`.
        asm_weight: As there.
        scale: As there.
        marker_radius: As there.
    """

    weights: Weighting = "paper"
    asm_weight: float = 1000.0
    scale: float = 1.0
    marker_radius: float | None = None
    name: ClassVar[str] = "pinn-asm"
    twin: ClassVar[str] = "fem-asm"
    assimilates: ClassVar[bool] = True


@dataclass(frozen=True, eq=False)
class TrainedField:
    """Displacement of trained networks."""

    squares: Squares  # The networks' shape, frame and conditions, double precision
    parameters: torch.Tensor  # Shape (2, parameters), double precision

    def displacement(self, location: LocatedPoints) -> FloatArray:
        """Displacement, shape (n, 2), mm."""
        return self._state(location)[:, :, 0]

    def gradient(self, location: LocatedPoints) -> FloatArray:
        """Displacement gradient du_i/dx_j, shape (n, 2, 2)."""
        return self._state(location)[:, :, 1:]

    def _state(self, location: LocatedPoints) -> FloatArray:
        points, squares = torch.from_numpy(np.array(location.points)), self.squares
        shift = squares.shift(self.parameters)

        def piece(rows: slice) -> torch.Tensor:
            ones = torch.ones(len(points[rows]), dtype=points.dtype)
            sample = squares.frame.sample(points[rows], ones, points.dtype)
            output = Streams.of(squares.shape, self.parameters, sample.inputs).output
            return sample.displacement(output, shift)

        parts = map_in_threads(piece, slices(len(points), PIECE))
        return np.asarray(torch.cat(parts, dim=2).permute(2, 0, 1).numpy())


def training_status(values: FloatArray, minimised: str = "energy") -> Status:
    """Whether the training has settled, from what it minimises after each step, N mm/mm."""
    tenth = max(len(values) // 10, 1)
    fell = 1 - values[-1] / values[-1 - tenth] if len(values) > tenth else math.inf
    message = f"{len(values)} steps; over their last tenth the {minimised} fell by {fell:.2%} "
    message += f"(criterion {SETTLED:.0%}); "
    if fell <= SETTLED:
        return Status(
            True,
            message + "so the training has settled, which does not say how far it is from the least energy",
        )
    return Status(False, message + "so the training has not settled: take more subset_steps")
