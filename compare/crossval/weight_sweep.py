"""The L-curve of `fem-asm`: its errors for other weights of the markers."""

from dataclasses import replace

from compare.crossval.scores import FIELDS
from compare.crossval.solver_folds import FoldRunner, SolverTask
from solvers.assimilation.marker_forces import root_mean_square
from solvers.assimilation.marker_weighting import FACTORS
from solvers.fem.assimilating import FemAsmSolver
from solvers.lagrange import LagrangeField
from solvers.solver import Progress, silent

SWEPT = "fem-asm"
"""The solver whose minimisers for all weights come from one factorisation."""


def sweep_weights(task: SolverTask, progress: Progress = silent) -> dict[str, list[float]]:
    """The minimisers for all `FACTORS` of the weights, all markers given, for the first seed.

    Returns:
        Columns: `factor`; `in_sample_mm` and `left_out_mm`, root mean squares over the markers' components;
        relative L2 distances from the truth by the names of `FIELDS`.
    """
    solver = task.variant.make(0)
    if not isinstance(solver, FemAsmSolver):
        raise TypeError(f"{solver.name} has no minimisers for all weights")
    runner = FoldRunner(task, solver)
    problem = replace(runner.problem, observations=task.observations[0][0])
    solution = solver.solve(problem)
    finger, misfit = solver.prepare(problem)
    forces, space = finger.forces(misfit), finger.equilibrium.elasticity.distributed.space
    rows = []
    for number, factor in enumerate(FACTORS.tolist()):
        progress(number / len(FACTORS), f"{factor:.3g} times the weight")
        fit = forces.fit(factor)
        weighted = replace(solution, field=LagrangeField(space, finger.under(fit.forces)))
        distances = runner.distances(runner.sampler.of_solution(weighted, problem.mesh), 0)
        errors = [root_mean_square(fit.residual), root_mean_square(fit.residual_without)]
        rows.append([factor, *errors, *(distances[name] for name in FIELDS)])
    finger.equilibrium.factors.destroy()
    names = ("factor", "in_sample_mm", "left_out_mm", *FIELDS)
    return {name: list(column) for name, column in zip(names, zip(*rows, strict=True), strict=True)}
