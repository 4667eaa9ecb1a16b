"""A tensile test and the laws that were fitted to it."""

from collections.abc import Sequence

import numpy as np

from pinnray.comparison.figures.layout import axes_at, write_heading
from pinnray.comparison.figures.solver_colours import solver_colour
from pinnray.runtime.figure import MEASURED, WIDTH, Figure, figure
from pinnray.solvers.materials import TensileFit, TensileTest


def draw_tensile_test(test: TensileTest, fits: Sequence[TensileFit]) -> Figure:
    """Draw nominal stress over nominal strain: the test's points, and a line for each law."""
    left, top, height = 0.75, 0.62, 2.6  # inches
    with figure(top + height + 0.5) as drawn:
        write_heading(drawn, "Tensile test and the laws fitted to it")
        axes = axes_at(drawn, (left, top, WIDTH - left - 0.2, height))
        order = np.argsort(test.strain)
        axes.plot(
            100 * test.strain, test.stress, "o", ms=3, mew=0, color=MEASURED, label="measured", zorder=3
        )
        for number, fit in enumerate(fits):
            label = f"{fit.material.law}, E = {fit.material.young:.4g} MPa"
            axes.plot(100 * test.strain[order], fit.stress[order], color=solver_colour(number), label=label)
        axes.set(xlim=(0, None), ylim=(0, None), xlabel="nominal strain, %", ylabel="nominal stress, MPa")
        axes.grid()
        axes.legend(loc="lower right")
    return drawn
