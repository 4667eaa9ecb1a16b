"""Base of the presets `fast` and `local`: a network with random hidden weights and an exact output layer."""

import time
from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import asdict, dataclass, fields, replace
from typing import ClassVar

import numpy as np

from pinnray.geometry.mesh.quadrature import body_quadrature
from pinnray.runtime.arrays import FloatArray
from pinnray.runtime.errors import UserError
from pinnray.solvers.assimilation.marker_forces import MarkerFit
from pinnray.solvers.assimilation.misfit import MarkerSettings, leave_one_out_displacements
from pinnray.solvers.assimilation.picture_frames import FreePictures
from pinnray.solvers.contact.contact_region import CONTACT_AT_END
from pinnray.solvers.pinn.finite_basis.constrained_network import ConstrainedNetwork, NewtonIterate
from pinnray.solvers.pinn.finite_basis.energy import LAWS, NetworkEnergy
from pinnray.solvers.pinn.finite_basis.hard_constraint import HardConstraint
from pinnray.solvers.pinn.finite_basis.network import FiniteBasis, Windows
from pinnray.solvers.pinn.finite_basis.newton import Level, LoadStep, find_equilibrium, follow_load
from pinnray.solvers.pinn.finite_basis.point_spacing import (
    PointSpacing,
    graded_quadrature,
    graded_triangles,
    spread_points,
)
from pinnray.solvers.pinn.finite_basis.pressed_network import PressedNetwork
from pinnray.solvers.pinn.network_solver import NetworkSolver
from pinnray.solvers.pinn.threading import pool
from pinnray.solvers.problem import Problem
from pinnray.solvers.shared_work import shared
from pinnray.solvers.solution import Solution, Status, unstable_phrase
from pinnray.solvers.solver import Cost, Progress, check_problem, silent

ORDERS = np.linspace(2, 4, 21)
"""Orders of convergence that turn the change between two levels into an error estimate: the first one, a
conservative assumption, unless the change before it shows a higher one. A higher one than the last has put
the estimate below the true error: by chance two changes differ much."""

FINEST = 0.75
"""Spacing of the third level relative to the second's."""


@dataclass(frozen=True, kw_only=True)
class FiniteBasisSolver(NetworkSolver, ABC):
    """A network with random hidden weights, whose output layer alone is solved for, exactly.

    Its windows are spread over the body, denser at re-entrant corners, and have a few random tanh neurons
    each. The energy of the linear law is quadratic in the output layer, which takes one sparse factorisation;
    that of a law of finite strain is minimised by Newton's method. The network is solved on two levels of
    spacing, whose change estimates the error; if that is too large, on a third. Spacings are in units of the
    body's thickness, so that one setting serves every design.

    Attributes:
        wall_spacing: Spacing of the windows in the width of a wall or cavity, at most the mean thickness.
        corner_spacing: Spacing at sharp corners in mean thicknesses of the body.
        growth: Growth of the spacing per distance from them.
        neurons: Neurons in a window.
        steepness: Steepness of the neurons per spacing.
        coarser: Ratio of the first level's spacings to the second's.
        tolerance: Estimated relative L2 error of the displacement below which it has converged.
        thinning: Smallest distance of two windows in spacings.
        cell: Longest edge of a quadrature cell in spacings.
        base_length: Distance from the base, mm, at which the factor of the hard constraint is one half.
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
    name: ClassVar[str] = "pinn-std"
    laws: ClassVar[tuple[str, ...]] = LAWS
    loads: ClassVar[tuple[str, ...]] = ("mean", "point", "patch", "cylinder")
    cost: ClassVar[Cost] = Cost(per_triangle=0, fixed=6)

    def __post_init__(self) -> None:
        self.check_positive(*(name for name in self._of_network if name not in ("seed", "growth")))
        if self.seed < 0 or self.neurons < 2 or self.coarser <= 1 or self.growth < 0:
            raise UserError(f"{self.name} needs seed >= 0, neurons >= 2, coarser > 1 and growth >= 0")
        if self.weighting is not None:
            self.weighting.check_weights()

    @property
    def weighting(self) -> MarkerSettings | None:
        """The settings of the markers' weights; None for a solver that does not assimilate them."""
        return self if isinstance(self, MarkerSettings) else None

    @property
    def _of_network(self) -> dict[str, object]:
        """The settings but for those of the markers."""
        of_markers = {entry.name for entry in fields(MarkerSettings)}
        return {name: value for name, value in asdict(self).items() if name not in of_markers}

    @abstractmethod
    def windows(self, centres: FloatArray, spacing: FloatArray, rng: np.random.Generator) -> Windows:
        """A window for every centre.

        Args:
            centres: Shape (c, 2), mm.
            spacing: Distance between neighbouring centres there, shape (c,), mm.
            rng: For whatever is drawn.
        """

    def solve(self, problem: Problem, progress: Progress = silent) -> Solution:
        """Train the network; see `Solver`."""
        check_problem(self, problem)
        if (framed := self._framed(problem, progress)) is not None:
            return framed
        started = time.perf_counter()
        rule = body_quadrature(problem.mesh, 1)
        before = np.zeros_like(rule.location.points)
        history, changes = [], list[float]()
        coarse: Level | None = None
        scales = [self.coarser, 1.0, FINEST]
        if problem.load.kind == "cylinder":  # along the load the coarsest level will do
            scales.insert(0, self.coarser**2)
        for number, scale in enumerate(scales):
            part = _part(progress, number / len(scales), 1 / len(scales))
            with pool():
                network, reached = coarse = self.equilibrium(problem, scale, coarse, part)
                state, field = reached.state, coarse.field
                displacement = field.displacement(rule.location)
            change = _relative(displacement - before, displacement, rule.weights)
            changes.append(change)
            finer = scales[max(number - 1, 0)] / scale
            error = estimated_error(changes[1:], scales[: number + 1])
            before = displacement
            energy = network.energy.total(state.output) if state.energy is None else state.energy
            history.append((field.basis.size, energy, error, time.perf_counter() - started))
            progress((number + 1) / len(scales), f"{field.basis.size} units, energy {energy:.4f} N mm/mm")
            failed = reached.fraction < 1 and scale <= self.coarser  # a finer level may get farther
            if failed or (scale <= 1 and error <= self.tolerance) or not displacement.any():
                break
        reaction, region = np.zeros(2), reached.region
        if region is not None:
            reaction[:] = region.force
        elif problem.load.kind != "cylinder":
            # The first functional of every prescribed component is a mean, whose multiplier is the force.
            reaction[problem.load.prescribed] = state.forces[: len(problem.load.prescribed)]
        fit = None if state.markers is None else state.markers.fit(state.factor)
        columns = "units", "energy", "estimated_error", "seconds"
        changed = f"{finer:.2g} times finer windows changed the displacement by {change:.2%}"
        return Solution(
            solver=self.name,
            problem=problem,
            field=field,
            energy=energy,
            reaction=reaction,
            status=self._status(problem, reached, changed, error, fit),
            stats={
                "seconds": time.perf_counter() - started,
                "unknowns": field.output.numel(),
                "units": field.basis.size,
                "windows": field.basis.windows.count,
                "quadrature_points": len(network.energy.weights),
                "newton_iterations": reached.iterations,
                "unstable_directions": state.unstable,
                **network.marker_stats(state),
                **(region.stats() if region else {}),
                "seed": self.seed,
                "device": "cpu",
            },
            history=dict(zip(columns, np.array(history).T, strict=True)),
            left_out=None if fit is None else leave_one_out_displacements(problem, fit.residual_without),
        )

    def equilibrium(self, problem: Problem, scale: float, coarse: Level | None, progress: Progress) -> Level:
        """A level at a scale of the spacings, from a coarser one if given; see `level`."""
        network = self.level(problem, scale)
        if problem.load.kind == "cylinder":
            return Level(network, PressedNetwork.of(network, problem).equilibrium(coarse, progress))
        return Level(network, _train(network, coarse, progress))

    def _framed(self, problem: Problem, progress: Progress) -> Solution | None:
        """The solution with the pictures' frames by the coarsest level; None where they are fixed.

        At finite strain the pictures are taken as they are.
        """
        observations, linear = problem.observations, problem.material.law == "linear"
        if self.weighting is None or observations is None or not linear:
            return None
        pictures = FreePictures.of(observations)
        forces = self.level(problem, self.coarser).at_rest().markers if pictures.parameters else None
        if forces is None:
            return None
        found = pictures.by_forces(forces, self.weighting)
        straight = replace(problem, observations=pictures.straightened(observations, found.z))
        return pictures.framed(self.solve(straight, progress), problem, found)

    def level(self, problem: Problem, scale: float) -> ConstrainedNetwork:
        """The network of a refinement level, with spacings of `scale` times the settings'.

        Args:
            problem: The body and the load.
            scale: Of the spacings.
        """
        bare = replace(problem, observations=None)
        key = (type(self).windows, *self._of_network.items(), bare.digest, scale)
        energy = shared(key, lambda: self._energy(bare, scale))
        return ConstrainedNetwork.of(energy, problem, self.weighting)

    def _energy(self, problem: Problem, scale: float) -> NetworkEnergy:
        mesh = problem.mesh
        wall, corner = self.wall_spacing * scale, self.corner_spacing * scale
        spacing = PointSpacing.of(problem, wall=wall, corner=corner, growth=self.growth * scale)
        triangles = graded_triangles(mesh, spacing, self.cell)
        centres = spread_points(triangles, mesh, spacing, self.thinning)
        distances = spacing.at(centres)
        rng = np.random.default_rng(self.seed)
        windows = self.windows(centres, distances, rng)
        steepness, constraint = self.steepness / distances, HardConstraint.of(mesh, self.base_length)
        basis = FiniteBasis.around(
            windows, centres, steepness, neurons=self.neurons, constraint=constraint, rng=rng
        )
        quadrature = graded_quadrature(triangles, spacing, self.cell)
        return NetworkEnergy.of(basis, problem.material, *quadrature)

    def _status(
        self, problem: Problem, reached: LoadStep, changed: str, error: float, fit: MarkerFit | None
    ) -> Status:
        region = reached.region
        if problem.load.kind == "cylinder" and reached.fraction == 1 and region is None:
            return Status(True, "the cylinder does not touch the finger")
        if region and region.at_end:
            return Status(False, CONTACT_AT_END)
        if reached.fraction < 1:
            return Status(
                False,
                f"stopped at {reached.fraction:.1%} of the load: Newton's method fails beyond; "
                "take a smaller spacing, the load patch or a smaller stroke",
            )
        message = (
            f"{changed}, so that its error is about {error:.2%} or less (criterion {self.tolerance:.2%})"
        )
        if unstable := reached.state.unstable:
            return Status(False, f"{message}; but {unstable_phrase(unstable)}")
        if region:
            message += f"; contact from x = {region.start:.4g} to {region.end:.4g} mm"
        converged = error <= self.tolerance
        advice = "" if converged else "; take a smaller spacing"
        return Status(converged, message + advice + (f"; {fit.phrase}" if fit else ""))


def _train(network: ConstrainedNetwork, coarse: Level | None, progress: Progress) -> LoadStep:
    """Equilibrium of a level: at once for a linear law, else from a coarser level's or along the load."""
    if network.energy.quadratic:
        return LoadStep(1.0, network.at_rest(), 1)

    def reach(guess: NewtonIterate, fraction: float) -> tuple[NewtonIterate | None, int]:
        return find_equilibrium(network, guess.output, fraction)

    rest = NewtonIterate(network.zero_output, np.zeros(len(network.targets)), 0.0)
    near = None if coarse is None else network.energy.nearest(coarse.field)
    if near is not None:
        state, iterations = reach(rest._replace(output=near[0]), 1.0)
        if state is not None:
            return LoadStep(1.0, state, iterations)
    return follow_load(rest, reach, progress)


def estimated_error(changes: Sequence[float], scales: Sequence[float]) -> float:
    """Estimated error of the last level, by the changes to each level but the first; infinite for one level.

    Source of the order that is observed: P. J. Roache, Verification and Validation in Computational Science
    and Engineering, Hermosa 1998, section 5.10.
    """
    if not changes:
        return float("inf")
    order = ORDERS[0]
    if len(changes) > 1 and changes[-1] > 0:
        far, middle, near = (scale**ORDERS for scale in scales[-3:])
        fallen = (far - middle) / (middle - near) <= changes[-2] / changes[-1]
        order = ORDERS[fallen].max(initial=order)
    return float(changes[-1] / ((scales[-2] / scales[-1]) ** order - 1))


def _part(progress: Progress, start: float, share: float) -> Progress:
    """Reports the progress of a share of the work."""
    return lambda fraction, text: progress(start + share * fraction, text)


def _relative(difference: FloatArray, field: FloatArray, weights: FloatArray) -> float:
    """Relative L2 norm of a difference of fields (q, 2); infinite if there is no displacement."""
    norms = [np.sqrt((weights[:, None] * values**2).sum()) for values in (difference, field)]
    return float(norms[0] / norms[1]) if norms[1] > 0 else float("inf")
