"""`fem-nonlinear`: finite-strain elasticity with DOLFINx, the project's virtual experiment."""

import math
import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from typing import ClassVar

import numpy as np
import ufl

from geometry.arrays import BoolArray, FloatArray
from geometry.errors import UserError
from geometry.quadrature import body_quadrature
from solvers.elasticity import Lame, deformation_jacobian, energy_density_of
from solvers.fem.bridge import DistributedSpace, Factorisation
from solvers.fem.conditions import (
    held_components,
    load_functionals,
    patch_displacement,
    reaction_by_residual_work,
)
from solvers.fem.lagrange import LagrangeField, LagrangeSpace
from solvers.fem.ranks import on_all_ranks
from solvers.problem import Problem
from solvers.solution import Solution, Status
from solvers.solver import Progress, check_problem, silent

QUADRATURE_DEGREE = 4
"""Of the energy's integral: exact for quadratic elements with the quadratic part of the law."""


@dataclass(frozen=True)
class FemNonlinearSolver:
    """Neo-Hookean or St Venant-Kirchhoff plane strain by Newton's method, the load applied in adaptive steps.

    Every step starts from the last two states extrapolated; the first from the linear solution. A step whose
    Newton iteration fails, or turns an element inside out, is halved. A `patch` whose tangential component is
    free slides.

    Attributes:
        degree: Degree of the elements, 1 or 2.
        first_step: First fraction of the load.
        max_step: Largest fraction of the load in one step.
        min_step: Fraction of the load below which the solver gives up.
        tolerance: Newton stops when the residual force is below this fraction of the internal forces.
        max_iterations: Newton iterations in one step.
    """

    degree: int = 2
    first_step: float = 0.05
    max_step: float = 0.2
    min_step: float = 1e-3
    tolerance: float = 1e-8
    max_iterations: int = 12
    name: ClassVar[str] = "fem-nonlinear"
    laws: ClassVar[tuple[str, ...]] = ("neo-hookean", "st-venant-kirchhoff")
    loads: ClassVar[tuple[str, ...]] = ("mean", "point", "patch")

    def __post_init__(self) -> None:
        if self.degree not in (1, 2):
            raise UserError(f"fem-nonlinear has elements of degree 1 and 2, not {self.degree}")
        if not 0 < self.min_step <= self.first_step <= self.max_step <= 1:
            raise UserError("fem-nonlinear needs 0 < min_step <= first_step <= max_step <= 1")

    def settings(self) -> dict[str, object]:
        """Element degree, load steps and Newton's criteria."""
        return asdict(self)

    def solve(self, problem: Problem, progress: Progress = silent) -> Solution:
        """Solve the finite-strain problem; see `Solver`. The material law must be one of finite strain."""
        check_problem(self, problem)
        return on_all_ranks(self._solve, problem, progress)

    def _solve(self, problem: Problem, progress: Progress) -> Solution:
        started = time.perf_counter()
        space = LagrangeSpace(problem.mesh, self.degree)
        newton = _Newton(self, problem, space)
        path = [_Step(fraction=0.0, nodal=np.zeros((len(space.nodes), 2)), residual=None)]
        step, failures, iterations = self.first_step, 0, 0
        while path[-1].fraction < 1:
            rest = 1 - path[-1].fraction
            fraction = 1 - rest * (1 - 1 / math.ceil(rest / step - 1e-9))  # equal steps to the end
            nodal, residual, taken = newton.iterate(_extrapolate(path, fraction), fraction)
            iterations += taken
            if residual is None:
                failures += 1
                step /= 2
                if step < self.min_step:
                    break
                continue
            path.append(_Step(fraction, nodal, residual))
            progress(fraction, f"{fraction:.0%} of the load, {taken} Newton iterations")
            step = min(self.max_step, step * (2 if taken <= 4 else 1))
        last = path[-1]
        complete = last.fraction >= 1
        residuals = [
            np.zeros_like(entry.nodal) if entry.residual is None else entry.residual for entry in path
        ]
        reactions = np.array([reaction_by_residual_work(space, residual) for residual in residuals])
        return Solution(
            solver=self.name,
            problem=problem,
            field=LagrangeField(space, last.nodal),
            energy=newton.energy(last.nodal),
            reaction=reactions[-1],
            status=Status(
                complete,
                f"all of the load applied in {len(path) - 1} steps, {iterations} Newton iterations"
                if complete
                else f"stopped at {last.fraction:.1%} of the load: Newton's method fails beyond; "
                "take a finer mesh, a wider contact or a smaller stroke",
            ),
            stats={
                "seconds": time.perf_counter() - started,
                "unknowns": last.nodal.size,
                "load_steps": len(path) - 1,
                "halved_steps": failures,
                "newton_iterations": iterations,
                "degree": self.degree,
            },
            history={
                "load_fraction": np.array([entry.fraction for entry in path]),
                "energy": np.array([newton.energy(entry.nodal) for entry in path]),
                "reaction_x": reactions[:, 0],
                "reaction_y": reactions[:, 1],
            },
        )


@dataclass(frozen=True, eq=False)
class _Step:
    """Equilibrium at a fraction of the load; the residual is the internal force, shape (N, 2), N/mm."""

    fraction: float
    nodal: FloatArray
    residual: FloatArray | None = field(repr=False)


def _extrapolate(path: Sequence[_Step], fraction: float) -> FloatArray:
    """First guess at a fraction of the load: the last two states continued on a straight line."""
    last = path[-1]
    if len(path) < 2:
        return last.nodal
    before = path[-2]
    slope = (fraction - last.fraction) / (last.fraction - before.fraction)
    return last.nodal + slope * (last.nodal - before.nodal)


class _Newton:
    """Newton's method on the equilibrium with the load's conditions as constraints.

    A `mean` or `point` load is a constraint b_k . u = prescribed, whose multiplier is the force; a `patch`
    holds nodal components. With K the tangent, y = K^-1 (-r) and x_k = K^-1 b_k, the step is y + f_k x_k
    where f makes it meet the constraints.
    """

    def __init__(self, settings: FemNonlinearSolver, problem: Problem, space: LagrangeSpace) -> None:
        self._settings = settings
        self._load = problem.load
        self._distributed = DistributedSpace(space)
        self._clamped: BoolArray = held_components(problem, space)
        is_patch = problem.load.kind == "patch"
        self._held = patch_displacement(problem, space) if is_patch else np.zeros((len(space.nodes), 2))
        self._functionals = (
            np.zeros((0, len(space.nodes), 2)) if is_patch else load_functionals(problem, space)
        )
        self._targets = np.zeros(0) if is_patch else problem.load.values
        self._derivatives = space.shape_gradients(body_quadrature(problem.mesh, QUADRATURE_DEGREE).location)
        lame = problem.material.lame
        constants = Lame(self._distributed.constant(lame.λ), self._distributed.constant(lame.μ), lame.λ_out)
        u = self._distributed.function
        measure = ufl.dx(metadata={"quadrature_degree": QUADRATURE_DEGREE})
        energy = energy_density_of(problem.material.law, ufl.grad(u), constants, ufl.ln) * measure
        residual = ufl.derivative(energy, u, ufl.TestFunction(u.function_space))
        tangent = ufl.derivative(residual, u, ufl.TrialFunction(u.function_space))
        self._energy, self._residual, self._tangent = map(self._distributed.form, (energy, residual, tangent))
        self._conditions = [
            condition
            for axis in (0, 1)
            for condition in self._distributed.clamp(np.flatnonzero(self._clamped[:, axis]), (axis,))
        ]

    def energy(self, nodal: FloatArray) -> float:
        """Elastic energy per depth, N mm / mm."""
        self._distributed.set_function(nodal)
        return self._distributed.assemble_scalar(self._energy)

    def iterate(self, guess: FloatArray, fraction: float) -> tuple[FloatArray, FloatArray | None, int]:
        """Equilibrium at a fraction of the load.

        Returns:
            Nodal displacements and internal forces, both (N, 2), the forces None if the iteration failed; and
            the iterations taken.
        """
        nodal = guess.copy()
        held = self._clamped & (self._held != 0)
        forces = np.zeros(len(self._functionals))
        if np.allclose(guess, 0) and held.any():
            nodal = self._first_guess(fraction * self._held)
        nodal[held] = fraction * self._held[held]
        for iteration in range(self._settings.max_iterations + 1):
            if not self._possible(nodal):
                return nodal, None, iteration
            residual = self._internal_force(nodal)
            balance = np.where(
                self._clamped, 0.0, residual - np.einsum("k,knx->nx", forces, self._functionals)
            )
            gap = fraction * self._targets - np.einsum("knx,nx->k", self._functionals, nodal)
            size = max(float(np.abs(residual).max()), 1e-30)
            # The force multipliers are zero before the first solve, so equilibrium cannot be judged yet.
            solved = iteration > 0 and float(np.abs(balance).max()) <= self._settings.tolerance * size
            if solved and np.all(np.abs(gap) <= 1e-10):
                return nodal, residual, iteration
            if iteration == self._settings.max_iterations:
                break
            factors = self._factorise()
            step = factors.solve(-residual)
            if len(self._functionals):
                responses = np.array([factors.solve(functional) for functional in self._functionals])
                compliance = np.einsum("inx,jnx->ij", self._functionals, responses)
                missing = gap - np.einsum("knx,nx->k", self._functionals, step)
                forces = np.linalg.solve(compliance, missing)
                step = step + np.einsum("k,knx->nx", forces, responses)
            factors.destroy()
            nodal = nodal + step
        return nodal, None, self._settings.max_iterations

    def _first_guess(self, held: FloatArray) -> FloatArray:
        """The linear solution for held components, from the tangent of the undeformed finger."""
        zero = np.zeros_like(held)
        self._distributed.set_function(zero)
        factors = self._factorise()
        full = self._distributed.assemble_matrix(self._tangent, [])
        vector, product = full.createVecs()
        self._distributed.distribute(held, vector)
        full.mult(vector, product)
        nodal = held + factors.solve(-self._distributed.gather(product))
        for item in (vector, product, full, factors):
            item.destroy()
        return nodal

    def _internal_force(self, nodal: FloatArray) -> FloatArray:
        self._distributed.set_function(nodal)
        return self._distributed.assemble_nodal(self._residual)

    def _factorise(self) -> Factorisation:
        matrix = self._distributed.assemble_matrix(self._tangent, self._conditions)
        return Factorisation(self._distributed, matrix, self._clamped, positive_definite=False)

    def _possible(self, nodal: FloatArray) -> bool:
        """Whether the deformation turns no quadrature point inside out."""
        gradient = np.stack([derivative @ nodal for derivative in self._derivatives], axis=-1)
        return bool(np.isfinite(nodal).all() and (deformation_jacobian(gradient) > 0).all())
