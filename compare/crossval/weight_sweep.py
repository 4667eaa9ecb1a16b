"""What more weight of the markers does to `fem-asm`: the L-curve, with distances from the truth."""

from dataclasses import replace

from compare.crossval.scores import FIELDS
from compare.crossval.solver_folds import SolverTask
from compare.crossval.true_fields import FieldSampler, TrueFields
from geometry.mesh.triangle_mesh import TriangleMesh
from solvers.assimilation.marker_forces import root_mean_square
from solvers.assimilation.marker_weighting import FACTORS
from solvers.fem.assimilating import FemAsmSolver
from solvers.lagrange import LagrangeField
from solvers.problem import Problem
from solvers.solver import Progress, silent, with_law

SWEPT = "fem-asm"
"""The solver whose minimisers for all weights are known at once."""


def sweep_weights(task: SolverTask, progress: Progress = silent) -> dict[str, list[float]]:
    """The minimisers for all `FACTORS` of the weights, all markers given, for the first seed.

    Returns:
        Columns: `factor`; `in_sample_mm` and `left_out_mm`, root mean squares over the markers' components;
        relative L2 distances from the truth by the names of `FIELDS`.
    """
    solver = task.variant.make(0)
    if not isinstance(solver, FemAsmSolver):
        raise TypeError(f"{solver.name} has no minimisers for all weights")
    mesh, observations = TriangleMesh.load(task.mesh), task.observations[0][0]
    material = with_law(task.material, solver)
    problem = Problem(mesh, material, task.load_cases[0].load, observations)
    law = task.material.model_copy(update={"law": "neo-hookean", "plane": "strain"})
    finite = replace(problem, material=law)
    sampler = FieldSampler.of(mesh, observations.points, observations.marker_radius)
    truth = TrueFields.load(task.truths[0])
    solution = solver.solve(problem)
    finger, misfit = solver.prepare(problem)
    forces, space = finger.forces(misfit), finger.equilibrium.elasticity.distributed.space
    columns: dict[str, list[float]] = {
        name: [] for name in ("factor", "in_sample_mm", "left_out_mm", *FIELDS)
    }
    for number, factor in enumerate(FACTORS.tolist()):
        progress(number / len(FACTORS), f"{factor:.3g} times the weight")
        fit = forces.fit(factor)
        weighed = replace(solution, field=LagrangeField(space, finger.under(fit.forces)))
        distances = truth.distance(sampler.of_solution(weighed, mesh), problem, finite, sampler.weights)
        row = (factor, root_mean_square(fit.residual), root_mean_square(fit.left_out), *distances.values())
        for column, value in zip(columns.values(), row, strict=True):
            column.append(value)
    finger.equilibrium.factors.destroy()
    return columns
