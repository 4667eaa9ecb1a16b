"""Cost and error of the networks over their units, their quadrature points and the finger's ribs.

Three pairs of curves in `out/benchmarks/sizes.png`; the reference of each finger has quadratic elements
graded to 0.01 mm at the corners. Five minutes.
"""

from collections.abc import Callable
from pathlib import Path

import matplotlib as mpl
import numpy as np
from rich.table import Table

from compare.evaluation.evaluation import Evaluation
from compare.evaluation.metrics import reference_differences
from geometry.cache import finger_mesh
from geometry.finger.design import Design
from geometry.mesh.settings import MeshSettings
from solvers.fem.linear import FemSolver
from solvers.pinn.finite_basis.local import PinnLocalSolver
from solvers.pinn.finite_basis.solver import FiniteBasisSolver
from solvers.pinn.finite_basis.standard import PinnStdSolver
from solvers.problem import Problem

PICTURE = Path("out/benchmarks/sizes.png")
KINDS: tuple[type[FiniteBasisSolver], ...] = (PinnStdSolver, PinnLocalSolver)
ONE_PAIR = {"tolerance": 1e9}
"""Settings for two levels, never a third."""


def _scaled(kind: type[FiniteBasisSolver], scale: float) -> FiniteBasisSolver:
    return kind(
        wall_spacing=scale * kind.wall_spacing,
        corner_spacing=scale * kind.corner_spacing,
        growth=scale * kind.growth,
        **ONE_PAIR,
    )


STUDIES: dict[str, tuple[str, Callable, tuple[float, ...]]] = {
    "units": (
        "units",
        lambda kind, scale: (_scaled(kind, scale), Design()),
        (4.0, 2.5, 1.6, 1.0, 0.8),
    ),
    "quadrature points": (
        "quadrature_points",
        lambda kind, cell: (kind(cell=cell * kind.cell, **ONE_PAIR), Design()),
        (3.0, 2.0, 1.4, 1.0, 0.7),
    ),
    "ribs": (
        "ribs",
        lambda kind, count: (kind(**ONE_PAIR), Design(rib_count=int(count))),
        (1, 2, 4, 6, 8),
    ),
}
"""Varied quantities: the place of its figure, the solver and the design for a value, and the values."""


def main() -> Table:
    """Train, compare, draw."""
    table = Table(title="Cost and error of the networks")
    for column in ("varied", "solver", "value", "L2, %", "von Mises, %", "time, s"):
        table.add_column(column, justify="left" if column in ("varied", "solver") else "right")
    references: dict[str, Evaluation] = {}
    curves: dict[tuple[str, str], np.ndarray] = {}
    for study, (key, case, values) in STUDIES.items():
        for kind in KINDS:
            rows = []
            for value in values:
                solver, design = case(kind, value)
                mesh = finger_mesh(design)
                if design.digest not in references:
                    graded = finger_mesh(design, settings=MeshSettings(corner_size=0.01))
                    references[design.digest] = Evaluation.of(FemSolver().solve(Problem(graded)), mesh)
                solution = solver.solve(Problem(mesh))
                differences = reference_differences(Evaluation.of(solution, mesh), references[design.digest])
                rows.append(
                    (
                        float(solution.stats.get(key, value)),
                        100 * differences.displacement.rel_l2,
                        100 * differences.von_mises.rel_l2,
                        float(solution.stats["seconds"]),
                    )
                )
                table.add_row(study, kind.name, *(f"{figure:.3g}" for figure in rows[-1]))
            curves[study, kind.name] = np.array(rows)
    _draw(curves)
    return table


TICKS = {"units": (1000, 3000, 10_000, 20_000), "quadrature points": (20_000, 50_000, 100_000, 200_000)}


def _draw(curves: dict[tuple[str, str], np.ndarray]) -> None:
    mpl.use("Agg")
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(
        2, len(STUDIES), figsize=(12, 6), sharex="col", sharey="row", layout="constrained"
    )
    for column, study in enumerate(STUDIES):
        for kind, colour in zip(KINDS, ("tab:blue", "tab:orange"), strict=True):
            values, displacement, stress, seconds = curves[study, kind.name].T
            axes[0, column].plot(values, displacement, "o-", color=colour, label=f"{kind.name}, displacement")
            axes[0, column].plot(values, stress, "s--", color=colour, label=f"{kind.name}, von Mises")
            axes[1, column].plot(values, seconds, "o-", color=colour, label=kind.name)
        axes[0, column].set_yscale("log")
        axes[1, column].set_yscale("log")
        if study != "ribs":
            axes[1, column].set_xscale("log")
            axes[1, column].set_xticks(TICKS[study], [f"{tick:,}" for tick in TICKS[study]], minor=False)
            axes[1, column].xaxis.set_minor_formatter(plt.NullFormatter())
        axes[1, column].set_xlabel(study)
    axes[0, 0].set_ylabel("relative L² difference, %")
    axes[1, 0].set_ylabel("time, s")
    axes[1, 0].set_yticks([2, 5, 10], ["2", "5", "10"])
    axes[1, 0].yaxis.set_minor_formatter(plt.NullFormatter())
    axes[0, 2].legend(fontsize=7, loc="upper right", ncols=2)
    axes[1, 0].legend(fontsize=8)
    PICTURE.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(PICTURE, dpi=150)
    plt.close(figure)
