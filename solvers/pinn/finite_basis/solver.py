"""What `pinn-std` and `pinn-local` share: a finite-basis network whose output layer is solved exactly."""

import time
from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import asdict, dataclass
from typing import ClassVar

import numpy as np

from geometry.arrays import FloatArray
from geometry.errors import UserError
from geometry.mesh.quadrature import body_quadrature
from solvers.assimilation.marker_forces import MarkerFit
from solvers.assimilation.misfit import leave_one_out_displacements
from solvers.pinn.finite_basis.equilibrium import Level
from solvers.pinn.finite_basis.hard_constraint import BaseFactor
from solvers.pinn.finite_basis.network import LocalField, LocalUnits
from solvers.pinn.finite_basis.newton import Path, equilibrium, follow_load
from solvers.pinn.finite_basis.point_spacing import (
    Spacing,
    graded_quadrature,
    graded_triangles,
    spread_points,
)
from solvers.pinn.finite_basis.windows import Windows
from solvers.pinn.marker_terms import ASSIMILATION, Observing
from solvers.pinn.threading import pool
from solvers.problem import Problem
from solvers.solution import Solution, Status
from solvers.solver import Progress, check_problem, silent

Train = Callable[[float, LocalField | None, Progress], tuple[Level, Path]]
"""What gives a level of a scale of spacings, trained, from the field of the one before."""

ORDER = 2
"""In the spacing, of the displacement's error: what the levels' change is taken to mean. It falls faster."""

FINEST = 0.75
"""Spacing of a third level, in that of the second, where the second is not enough."""


@dataclass(frozen=True, kw_only=True)
class FiniteBasisSolver(Observing, ABC):
    """Windows spread over the body, denser at its re-entrant corners, each with a few random tanh neurons.

    The energy of the linear law is quadratic in the output layer, which is found by one sparse factorisation;
    the neo-Hookean one is minimised by Newton's method. The hidden weights stay as they were drawn. It is
    solved on two levels of spacing, and the change between them tells how large the error is; if it is too
    large, there is a third. Spacings are in units of the body's thickness, so that one setting serves every
    design.

    Attributes:
        wall_spacing: Spacing of the windows in the width of a wall or cavity, at most the mean thickness.
        corner_spacing: Spacing at sharp corners in mean thicknesses of the body.
        growth: Growth of the spacing per distance from them.
        neurons: Neurons in a window.
        steepness: Steepness of the neurons per spacing.
        coarser: How many times larger the spacings of the first level are.
        tolerance: Estimated relative L2 error of the displacement below which it has converged.
        thinning: Smallest distance of two windows in spacings.
        cell: Longest edge of a quadrature cell in spacings.
        base_length: Distance from the base, mm, at which the hard condition's factor is one half.
        seed: Of the random numbers.
    """

    wall_spacing: float
    corner_spacing: float
    growth: float
    neurons: int = 5
    steepness: float
    coarser: float = 1.7
    tolerance: float = 0.01
    thinning: float = 0.75
    cell: float
    base_length: float = 5.0
    seed: int = 0
    laws: ClassVar[tuple[str, ...]] = ("linear", "neo-hookean")
    loads: ClassVar[tuple[str, ...]] = ("mean", "point", "patch")

    def __post_init__(self) -> None:
        for setting, value in asdict(self).items():
            if setting not in ("seed", "growth", *ASSIMILATION) and not value > 0:
                raise UserError(f"{self.name}: {setting} must be positive, got {value}")
        if self.seed < 0 or self.neurons < 2 or self.coarser <= 1 or self.growth < 0:
            raise UserError(f"{self.name} needs seed >= 0, neurons >= 2, coarser > 1 and growth >= 0")

    @abstractmethod
    def windows(self, centres: FloatArray, spacing: FloatArray, rng: np.random.Generator) -> Windows:
        """A window for every centre.

        Args:
            centres: Shape (c, 2), mm.
            spacing: Distance between neighbouring centres there, shape (c,), mm.
            rng: For whatever is drawn.
        """

    def settings(self) -> dict[str, object]:
        """Spacing, windows, neurons, criterion and seed."""
        return asdict(self)

    def solve(self, problem: Problem, progress: Progress = silent) -> Solution:
        """Train the network; see `Solver`."""
        check_problem(self, problem)

        def train(scale: float, coarse: LocalField | None, progress: Progress) -> tuple[Level, Path]:
            level = self.level(problem, scale)
            return level, _train(level, coarse, progress)

        with pool():
            return self.trained(problem, train, progress)

    def trained(self, problem: Problem, train: Train, progress: Progress) -> Solution:
        """The solution by levels that are trained one after the other until two agree."""
        started = time.perf_counter()
        rule = body_quadrature(problem.mesh, 1)
        before = np.zeros_like(rule.location.points)
        history = []
        coarse: LocalField | None = None
        scales = (self.coarser, 1.0, FINEST)
        for number, scale in enumerate(scales):
            level, path = train(scale, coarse, _part(progress, number / len(scales), 1 / len(scales)))
            field = coarse = level.field(path.state.output)
            displacement = field.displacement(rule.location)
            change = _relative(displacement - before, displacement, rule.weights)
            finer = scales[max(number - 1, 0)] / scale
            error = change / (finer**ORDER - 1) if number else float("inf")
            before = displacement
            energy = level.energy.total(path.state.output)
            units = field.units.windows.count * field.units.per_window
            history.append((units, energy, error, time.perf_counter() - started))
            progress((number + 1) / len(scales), f"{units} units, energy {energy:.4f} N mm/mm")
            if path.fraction < 1 or error <= self.tolerance:
                break
        state, reaction = path.state, np.zeros(2)
        reaction[problem.load.prescribed] = level.reaction(state.forces)
        fit = None if state.markers is None else state.markers.fit(state.factor)
        return Solution(
            solver=self.name,
            problem=problem,
            field=field,
            energy=energy,
            reaction=reaction,
            status=self._status(path, finer, change, error, fit),
            stats={
                "seconds": time.perf_counter() - started,
                "unknowns": field.output.numel(),
                "units": units,
                "windows": field.units.windows.count,
                "quadrature_points": level.energy.points,
                "newton_iterations": path.iterations,
                **level.marker_stats(state),
                "seed": self.seed,
                "device": "cpu",
            },
            history=dict(
                zip(("units", "energy", "estimated_error", "seconds"), np.array(history).T, strict=True)
            ),
            left_out=None if fit is None else leave_one_out_displacements(problem, fit.left_out),
        )

    def level(self, problem: Problem, scale: float) -> Level:
        """The network with spacings of `scale` times the settings', its quadrature and its load."""
        mesh = problem.mesh
        spacing = Spacing.of(
            problem,
            wall=self.wall_spacing * scale,
            corner=self.corner_spacing * scale,
            growth=self.growth * scale,
        )
        triangles = graded_triangles(mesh, spacing, self.cell)
        centres = spread_points(triangles, mesh, spacing, self.thinning)
        distances = spacing.at(centres)
        rng = np.random.default_rng(self.seed)
        units = LocalUnits.around(
            self.windows(centres, distances, rng),
            centres,
            self.steepness / distances,
            neurons=self.neurons,
            factor=BaseFactor.of(mesh, self.base_length),
            rng=rng,
        )
        quadrature = graded_quadrature(triangles, spacing, self.cell)
        return Level.of(units, problem, *quadrature, self.given(problem))

    def _status(self, path: Path, finer: float, change: float, error: float, fit: MarkerFit | None) -> Status:
        if path.fraction < 1:
            return Status(
                False,
                f"stopped at {path.fraction:.1%} of the load: Newton's method fails beyond; "
                "take a smaller spacing, the load patch or a smaller stroke",
            )
        message = (
            f"{finer:.2g} times finer windows changed the displacement by {change:.2%}, "
            f"so that its error is about {error:.2%} or less (criterion {self.tolerance:.2%})"
        )
        converged = error <= self.tolerance
        advice = "" if converged else "; take a smaller spacing"
        return Status(converged, message + advice + (f"; {fit.phrase}" if fit else ""))


def _train(level: Level, coarse: LocalField | None, progress: Progress) -> Path:
    """Equilibrium on a level: at once for a linear law, else from a coarser level's or along the load."""
    if level.energy.material.law == "linear":
        return Path.start(level).to(1.0, level.step(level.rest), 1)
    if coarse is not None:
        state, iterations = equilibrium(level, level.nearest(coarse), 1.0)
        if state is not None:
            return Path.start(level).to(1.0, state, iterations)
    return follow_load(level, progress)


def _part(progress: Progress, start: float, share: float) -> Progress:
    """The progress of a part of the work."""
    return lambda fraction, text: progress(start + share * fraction, text)


def _relative(difference: FloatArray, field: FloatArray, weights: FloatArray) -> float:
    """Relative L2 norm of a difference of fields (q, 2); infinite if there is no displacement."""
    norms = [np.sqrt((weights[:, None] * values**2).sum()) for values in (difference, field)]
    return float(norms[0] / norms[1]) if norms[1] > 0 else float("inf")
