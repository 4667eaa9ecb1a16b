"""The figures of a finger as a sweep computes them, and what the training of a network gives besides."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from pinnray.comparison.evaluation.differences import relative_l2
from pinnray.geometry.mesh.quadrature import body_quadrature, edge_quadrature
from pinnray.solvers.fem.linear import FemSolver
from pinnray.solvers.finger_figures import Quantity, figures_at_rest, figures_of
from pinnray.solvers.problem import Load, Problem, contact_functional
from pinnray.solvers.solution import Solution
from pinnray.solvers.solver import Solver, TrainedSolver, solved, with_law

TRAINING: Mapping[str, Quantity] = {
    "rel_l2_displacement": Quantity("", "relative L2 difference of the displacement from that by fem"),
    "rel_energy": Quantity("", "signed relative difference of the energy from fem's"),
    "boundary_violation": Quantity("", "largest error of the boundary conditions over the stroke"),
    "energy": Quantity("N_mm/mm", "elastic energy per depth"),
    "loss": Quantity("MPa", "last value of the total loss"),
}
"""What a training gives besides, compared with `fem`."""


def quantities(problem: Problem, solver: Solver, *, density: float) -> tuple[Solution, dict[str, float]]:
    """Solve a problem and evaluate every quantity.

    Args:
        problem: The problem, with its finger; its material's law is replaced by one that the solver has.
        solver: The solver.
        density: Of the material, g/cm^3.

    Returns:
        The solution, and the quantities by the names of `QUANTITIES`; NaN where the solver does not give one.
    """
    linear = replace(problem, material=problem.material.model_copy(update={"law": "linear"}))
    plain = replace(solver, estimate=False) if isinstance(solver, FemSolver) else FemSolver(estimate=False)
    if isinstance(solver, FemSolver):
        prepared = plain.prepare(linear)
        solution = prepared.solve(problem.load)
    else:
        lawful = replace(problem, material=with_law(problem.material, solver))
        solution = solved(solver, lawful)
        prepared = plain.prepare(replace(linear, load=Load(position=problem.load.position)))
    rest = figures_at_rest(problem, density=density, solve=prepared.solve)
    prepared.destroy()
    values = figures_of(solution, rest).values()
    return solution, values | (training(solution) if isinstance(solver, TrainedSolver) else {})


def training(solution: Solution) -> dict[str, float]:
    """The quantities of `TRAINING`, for a solver that records its loss."""
    problem = solution.problem
    fem = FemSolver().solve(replace(problem, material=problem.material.model_copy(update={"law": "linear"})))
    rule = body_quadrature(problem.mesh)
    own, reference = (each.displacement(rule.location) for each in (solution, fem))
    return {
        "rel_l2_displacement": relative_l2(own, reference, rule.weights),
        "rel_energy": float(solution.energy) / float(fem.energy) - 1,
        "boundary_violation": max(boundary_violations(solution)) / float(np.linalg.norm(problem.load.values)),
        "energy": float(solution.energy),
        "loss": float(solution.history["total"][-1]),
    }


def boundary_violations(solution: Solution) -> tuple[float, float]:
    """Root mean square of the displacement along the base, and the error of the load's functional, mm."""
    problem = solution.problem
    points, lengths = edge_quadrature(problem.mesh, "base")
    squares = (solution.displacement(points) ** 2).sum(axis=1)
    contact, weights = contact_functional(problem)
    mean = (weights @ solution.displacement(contact))[problem.load.prescribed]
    base = float(np.sqrt(lengths @ squares / lengths.sum()))
    return base, float(np.linalg.norm(mean - problem.load.values))
