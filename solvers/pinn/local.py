"""`pinn-local`: a finite-basis network whose output layer is solved exactly, in seconds."""

import time
from dataclasses import asdict, dataclass
from typing import ClassVar

import numpy as np
import torch

from geometry.arrays import FloatArray
from geometry.errors import UserError
from geometry.quadrature import body_quadrature
from solvers.pinn.grading import (
    Spacing,
    graded_quadrature,
    graded_triangles,
    mean_thickness,
    singular_points,
    spread_points,
)
from solvers.pinn.local_energy import LocalEnergy
from solvers.pinn.local_units import LocalField, LocalUnits
from solvers.pinn.trial_space import BaseFactor
from solvers.problem import Problem, contact_functional
from solvers.solution import Solution, Status
from solvers.solver import Progress, check_problem, silent

QUADRATURE_DEGREE = 2
REGULARISATION = 1e-12
"""Added to the unit diagonal of the scaled system, so that nearly dependent units do no harm."""


@dataclass(frozen=True)
class PinnLocalSolver:
    """Windows spread over the body, denser at its re-entrant corners, each with a few random tanh ridges.

    The energy is quadratic in the output layer, which is found by one sparse factorisation; the hidden
    weights stay as they were drawn. It is solved on two levels of spacing, and the change between them tells
    whether the network is fine enough. Spacings are in units of the body's mean thickness, so that one
    setting serves every design.

    Attributes:
        wall_spacing: Spacing of the windows along walls.
        corner_spacing: Spacing at singular points.
        growth: Growth of the spacing per distance from them.
        radius: Radius of a window in spacings.
        ridges: Ridges in a window.
        slope: Slope of the ridges per radius.
        coarser: How many times larger the spacings of the first level are.
        tolerance: Relative L2 change of the displacement between the levels below which it has converged.
        thinning: Smallest distance of two windows in spacings.
        cell: Longest edge of a quadrature cell in spacings.
        base_length: Distance from the base, mm, at which the hard condition's factor is one half.
        seed: Of the random numbers.
    """

    wall_spacing: float = 0.5
    corner_spacing: float = 0.006
    growth: float = 0.5
    radius: float = 1.8
    ridges: int = 5
    slope: float = 0.7
    coarser: float = 1.7
    tolerance: float = 0.005
    thinning: float = 0.75
    cell: float = 0.45
    base_length: float = 5.0
    seed: int = 0
    name: ClassVar[str] = "pinn-local"
    laws: ClassVar[tuple[str, ...]] = ("linear",)
    loads: ClassVar[tuple[str, ...]] = ("mean", "point")

    def __post_init__(self) -> None:
        if self.seed < 0:
            raise UserError(f"pinn-local: seed must be zero or more, got {self.seed}")
        positive = ("wall_spacing", "corner_spacing", "slope", "tolerance", "thinning", "cell", "base_length")
        for setting in positive:
            if not getattr(self, setting) > 0:
                raise UserError(f"pinn-local: {setting} must be positive, got {getattr(self, setting)}")
        if self.ridges < 2 or self.radius < 1.2 or self.coarser <= 1 or self.growth < 0:
            raise UserError("pinn-local needs ridges >= 2, radius >= 1.2, coarser > 1 and growth >= 0")

    def settings(self) -> dict[str, object]:
        """Spacing, windows, ridges, criterion and seed."""
        return asdict(self)

    def solve(self, problem: Problem, progress: Progress = silent) -> Solution:
        """Train the network on the linear problem; see `Solver`."""
        check_problem(self, problem)
        started = time.perf_counter()
        rule = body_quadrature(problem.mesh, 1)
        before, change = np.zeros_like(rule.location.points), float("inf")
        history = []
        for number, scale in enumerate((self.coarser, 1.0)):
            level = _Level.of(self, problem, scale)
            field, energy, forces = level.solve(problem)
            displacement = field.displacement(rule.location)
            change = _relative(displacement - before, displacement, rule.weights)
            before = displacement
            history.append((field.output[:, 0].numel(), energy, change, time.perf_counter() - started))
            progress((number + 1) / 2, f"{field.output[:, 0].numel()} units, energy {energy:.4f} N mm/mm")
        converged = change <= self.tolerance
        message = (
            f"{self.coarser:g} times finer windows changed the displacement by {change:.2%} "
            f"(criterion {self.tolerance:.2%})"
        )
        reaction = np.zeros(2)
        reaction[problem.load.prescribed] = forces
        return Solution(
            solver=self.name,
            problem=problem,
            field=field,
            energy=energy,
            reaction=reaction,
            status=Status(converged, message if converged else f"{message}; take a smaller spacing"),
            stats={
                "seconds": time.perf_counter() - started,
                "unknowns": field.output.numel(),
                "units": field.output[:, 0].numel(),
                "windows": field.units.windows,
                "quadrature_points": len(level.points),
                "seed": self.seed,
                "device": "cpu",
            },
            history=dict(
                zip(("units", "energy", "relative_change", "seconds"), np.array(history).T, strict=True)
            ),
        )


@dataclass(frozen=True, eq=False)
class _Level:
    """The units and the quadrature of one level of spacing."""

    units: LocalUnits
    points: FloatArray
    weights: FloatArray

    @classmethod
    def of(cls, settings: PinnLocalSolver, problem: Problem, scale: float) -> "_Level":
        mesh = problem.mesh
        unit = scale * mean_thickness(mesh)
        spacing = Spacing(
            singular_points(mesh),
            wall=settings.wall_spacing * unit,
            corner=settings.corner_spacing * unit,
            growth=settings.growth * scale,
        )
        triangles = graded_triangles(mesh, spacing, settings.cell)
        centres = spread_points(triangles, mesh, spacing, settings.thinning)
        units = LocalUnits.around(
            centres,
            settings.radius * spacing.at(centres),
            ridges=settings.ridges,
            slope=settings.slope,
            factor=BaseFactor.of(mesh, settings.base_length),
            rng=np.random.default_rng(settings.seed),
        )
        return cls(units, *graded_quadrature(triangles, QUADRATURE_DEGREE))

    def solve(self, problem: Problem) -> tuple[LocalField, float, FloatArray]:
        """The field of least energy under the load's conditions, its energy, and the load's forces."""
        energy = LocalEnergy.of(self.units, problem.material, self.points, self.weights)
        shape = (self.units.windows, 2, self.units.per_window)
        _, hessian = energy.derivatives(torch.zeros(shape, dtype=torch.float64))
        functional = self.units.functional(*contact_functional(problem))
        right = np.zeros((len(problem.load.prescribed), *shape))
        for row, axis in enumerate(problem.load.prescribed):
            right[row, :, axis] = functional
        right = right.reshape(len(right), -1)
        responses = hessian.solve(right, REGULARISATION)
        forces = np.linalg.solve(right @ responses.T, problem.load.values)
        field = LocalField(self.units, torch.from_numpy(forces @ responses).view(shape))
        return field, 0.5 * float(forces @ problem.load.values), forces


def _relative(difference: FloatArray, field: FloatArray, weights: FloatArray) -> float:
    """Relative L2 norm of a difference of fields (q, 2)."""
    norms = [np.sqrt((weights[:, None] * values**2).sum()) for values in (difference, field)]
    return float(norms[0] / norms[1])
