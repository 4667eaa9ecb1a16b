"""Presets `fast`, `local` and `trained` of `pinn-std` and `pinn-asm`: output layers that are exact."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import ClassVar, cast

import numpy as np
import torch

from pinnray.geometry.observations import Observations
from pinnray.runtime.arrays import FloatArray
from pinnray.runtime.errors import UserError
from pinnray.solvers.assimilation.misfit import MarkerSettings
from pinnray.solvers.pinn.finite_basis.newton import Level
from pinnray.solvers.pinn.finite_basis.solver import FiniteBasisSolver
from pinnray.solvers.pinn.finite_basis.training import with_trained_neurons
from pinnray.solvers.pinn.finite_basis.windows import GateTree, ShepardWindows
from pinnray.solvers.problem import Problem
from pinnray.solvers.shared_work import SharedWork
from pinnray.solvers.solution import Solution
from pinnray.solvers.solver import Cost, Progress, Solver


@dataclass(frozen=True, kw_only=True)
class PinnStdSolver(FiniteBasisSolver):
    """Preset `fast`: a gated network.

    A gated layer of the paper's network mixes two encoders; here the gate above mixes its result again, and
    so on (`GateTree`), so that every encoder serves a part of the body. An encoder is a hidden layer of tanh
    neurons with its own output weights. The rest is as in `FiniteBasisSolver`.

    Attributes:
        gate_width: Width of the gates in spacings.
    """

    wall_spacing: float = 0.9
    corner_spacing: float = 0.018
    growth: float = 0.6
    gate_width: float = 0.8
    steepness: float = 0.5
    cell: float = 0.5
    preset: ClassVar[str] = "fast"

    def windows(self, centres: FloatArray, spacing: FloatArray, rng: np.random.Generator) -> GateTree:
        """Gates with an encoder for every centre; see `FiniteBasisSolver`."""
        return GateTree.over(centres, spacing, width=self.gate_width, rng=rng)


@dataclass(frozen=True, kw_only=True)
class PinnLocalSolver(FiniteBasisSolver):
    """Preset `local`: a finite-basis network, whose windows are round and normalised to sum to one.

    Attributes:
        radius: Radius of a window in spacings.
    """

    wall_spacing: float = 0.5
    corner_spacing: float = 0.006
    growth: float = 0.5
    radius: float = 1.8
    steepness: float = 0.4
    cell: float = 0.45
    preset: ClassVar[str] = "local"

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.radius < 1.2:
            raise UserError(f"{self.name}: windows overlap from a radius of 1.2 on, got {self.radius}")

    def windows(self, centres: FloatArray, spacing: FloatArray, rng: np.random.Generator) -> ShepardWindows:
        """A round window for every centre; see `FiniteBasisSolver`."""
        return ShepardWindows(torch.from_numpy(centres), torch.from_numpy(self.radius * spacing))


@dataclass(frozen=True, kw_only=True)
class TrainedPinnSolver(PinnLocalSolver):
    """Preset `trained`: the network of preset `local` with two fifths of its windows, every weight trained.

    Attributes:
        steps: Of the training on each level.
    """

    wall_spacing: float = 0.8
    corner_spacing: float = 0.01
    growth: float = 0.8
    steps: int = 25
    preset: ClassVar[str] = "trained"
    laws: ClassVar[tuple[str, ...]] = ("linear",)
    loads: ClassVar[tuple[str, ...]] = ("mean", "point", "patch")
    cost: ClassVar[Cost] = Cost(per_triangle=0, fixed=120)

    def equilibrium(self, problem: Problem, scale: float, coarse: Level | None, progress: Progress) -> Level:
        """A level whose neurons are trained; see `FiniteBasisSolver`."""
        network, start = super().equilibrium(problem, scale, coarse, progress)
        windows = cast(ShepardWindows, network.energy.basis.windows)
        return Level(*with_trained_neurons(network, start, windows, self.steps, progress))


@dataclass(frozen=True, kw_only=True)
class _WithMarkers(MarkerSettings):
    """A network with the markers' misfit."""

    name: ClassVar[str] = "pinn-asm"
    twin: ClassVar[str] = "fem-asm"
    loads: ClassVar[tuple[str, ...]] = ("mean", "point", "patch")

    def refitter(self, problem: Problem) -> Callable[[Observations], Solution]:
        """See `Refittable`; one factorisation of each level for all observations if the law is linear."""
        work, solver = SharedWork(), cast(Solver, self)

        def refit(observations: Observations) -> Solution:
            with work.used():
                return solver.solve(replace(problem, observations=observations))

        return refit


@dataclass(frozen=True, kw_only=True)
class PinnAsmSolver(_WithMarkers, PinnStdSolver):
    """The network of `PinnStdSolver` with the markers' misfit."""

    cost: ClassVar[Cost] = Cost(per_triangle=0, fixed=1.7)  # beside pinn-std, whose work it shares


@dataclass(frozen=True, kw_only=True)
class PinnLocalAsmSolver(_WithMarkers, PinnLocalSolver):
    """The network of `PinnLocalSolver` with the markers' misfit."""


@dataclass(frozen=True, kw_only=True)
class TrainedPinnAsmSolver(_WithMarkers, TrainedPinnSolver):
    """The network and the training of `TrainedPinnSolver` with the markers' misfit."""
