"""A tensile test and the laws that were fitted to it."""

from collections.abc import Sequence

import numpy as np

from pinnray.comparison.figures.layout import axes_at, legend_above, legend_height, write_heading
from pinnray.runtime.figure import COLUMN, INK, MEASURED, Figure, figure
from pinnray.solvers.materials import TensileFit, TensileTest


def draw_tensile_test(test: TensileTest, fits: Sequence[TensileFit]) -> Figure:
    """Draw nominal stress over nominal strain: the test's points, and a line for each law."""
    left, height = 0.65, 1.9  # inches
    labels = [f"{fit.material.law}, E = {fit.material.young:.4g} MPa" for fit in fits]
    top = 0.3 + legend_height(["measured", *labels], COLUMN)
    with figure(top + height + 0.45, COLUMN) as drawn:
        write_heading(drawn, "Tensile test and the laws fitted to it")
        axes = axes_at(drawn, (left, top, COLUMN - left - 0.2, height))
        strain, order = 100 * test.strain, np.argsort(test.strain)
        axes.plot(strain, test.stress, "o", ms=3, mew=0, color=MEASURED, label="measured", zorder=3)
        for fit, label, line in zip(fits, labels, ("-", "--", "-.", ":"), strict=False):
            axes.plot(strain[order], fit.stress[order], color=INK, ls=line, label=label)
        axes.set(xlim=(0, None), ylim=(0, None), xlabel="nominal strain, %", ylabel="nominal stress, MPa")
        axes.grid()
        legend_above(axes, COLUMN)
    return drawn
