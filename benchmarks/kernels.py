"""Kernels of `gp` and `statfem`: evidence, and leave-one-out errors at the markers.

Four designs with markers along the front wall and at the joints, in the virtual experiment, with noise of
0.005 mm. The evidence of the given markers chooses the default kernel; the leave-one-out errors do not. A
minute.
"""

from dataclasses import replace
from itertools import product

import numpy as np
from rich.table import Table

from compare.evaluation.virtual_experiment import virtual_experiment
from geometry.cache import finger_mesh
from geometry.finger.presets import load_design, preset_names
from geometry.mesh.settings import MeshSettings
from solvers.problem import Problem
from solvers.solution import Solution
from solvers.statistics.gaussian_process import GaussianProcessSolver
from solvers.statistics.kernel_field import SMOOTHNESS
from solvers.statistics.statistical_fem import StatFemSolver

LAYOUTS = ("front", "joints")
ELEMENT = 0.7
NOISE = 0.005
"""Standard deviation of a coordinate, mm."""


def main() -> Table:
    """Condition both solvers on the markers of every finger, with every kernel."""
    table = Table(title="Kernels: log evidence, and left-out markers")
    for column in ("finger", "solver", "kernel", "evidence", "left out, mm", "in 2 std, %"):
        named = column in ("finger", "solver", "kernel")
        table.add_column(column, justify="left" if named else "right", no_wrap=True)
    problems = {case: _problem(*case) for case in product(preset_names(), LAYOUTS)}
    for solver in (GaussianProcessSolver, StatFemSolver):
        for kernel in SMOOTHNESS:
            rows = {
                case: _figures(solver(kernel=kernel).solve(problem)) for case, problem in problems.items()
            }
            for (design, layout), row in rows.items():
                table.add_row(f"{design}, {layout}", solver.name, kernel, *_texts(row))
            total = np.array(list(rows.values()))
            summary = np.array([total[:, 0].sum(), *total[:, 1:].mean(axis=0)])
            table.add_row("all", solver.name, kernel, *_texts(summary), style="bold", end_section=True)
    return table


def _problem(design: str, layout: str) -> Problem:
    finger = load_design(design, {"marker_layout": layout})
    problem = Problem(finger_mesh(finger, settings=MeshSettings(size=ELEMENT)))
    exact, _ = virtual_experiment(problem, finger.marker_radius)
    noise = np.random.default_rng(0).normal(0, NOISE, exact.displacements.shape)
    observations = replace(
        exact,
        displacements=exact.displacements + noise,
        standard_deviations=np.full_like(exact.displacements, NOISE),
    )
    return replace(problem, observations=observations)


def _figures(solution: Solution) -> np.ndarray:
    """Log evidence, mean |Δu| + |Δv| of left-out markers in mm, share within two standard deviations."""
    observations = solution.problem.observations
    assert observations is not None
    assert solution.left_out is not None
    missed = np.abs(solution.left_out - observations.displacements).sum(axis=1).mean()
    evidence, within = (float(solution.stats[name]) for name in ("log_evidence", "left_out_within_2sd"))
    return np.array([evidence, missed, within])


def _texts(figures: np.ndarray) -> tuple[str, str, str]:
    evidence, missed, within = figures
    return f"{evidence:.1f}", f"{missed:.3f}", f"{100 * within:.0f}"
