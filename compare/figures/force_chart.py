"""Force over displacement of the indenter."""

from collections.abc import Sequence

import numpy as np

from compare.evaluation.force_displacement import ForceCurve, follows_load
from compare.figures.style import axes_at, heading, legend_above, legend_height, solver_colour
from geometry.figure import INK, WIDTH, Figure, figure

HEAD, HEIGHT, FOOT, LEFT, RIGHT = 0.3, 2.4, 0.45, 0.75, 0.65
"""Heights and the margins, inches."""


def draw_force_displacement(curves: Sequence[ForceCurve], *, depth: float) -> Figure:
    """Draw every curve: per mm of depth on the left axis, for the depth, mm, on the right one.

    A solver that follows the load has a mark at each of its equilibria, a linear one a dashed line.
    """
    labels = [
        f"{curve.evaluation.label}, {curve.force[-1]:.3g} N/mm at {curve.travel[-1]:.3g} mm"
        for curve in curves
    ]
    height = legend_height(labels)
    with figure(HEAD + height + HEIGHT + FOOT) as drawn:
        heading(drawn, "Force of the indenter along its travel")
        axes = axes_at(drawn, (LEFT, HEAD + height, WIDTH - LEFT - RIGHT, HEIGHT))
        straight = sum(not follows_load(curve.evaluation) for curve in curves)
        for number, (curve, label) in enumerate(zip(curves, labels, strict=True)):
            followed = follows_load(curve.evaluation)
            straight -= not followed
            axes.plot(
                curve.travel,
                curve.force,
                color=solver_colour(number),
                linestyle="-" if followed else (0, (3, 2)),
                # Straight lines often coincide: the later ones are narrower.
                linewidth=1.3 if followed else 1.2 + 1.4 * straight,
                marker="o" if followed or len(curve.travel) == 1 else "",
                markersize=3.2,
                label=label,
                zorder=3 if followed else 2,
            )
        axes.set_xlim(0, 1.02 * max(curve.travel[-1] for curve in curves))
        forces = np.concatenate([curve.force for curve in curves])
        axes.set_ylim(min(0.0, 1.05 * float(forces.min())), 1.05 * (float(forces.max()) or 1.0))
        axes.set_xlabel("travel of the indenter, mm")
        axes.set_ylabel("force, N per mm of depth")
        axes.grid(color="#dddddd", linewidth=0.5)
        whole = axes.secondary_yaxis(
            "right",
            functions=(lambda force: np.asarray(force) * depth, lambda force: np.asarray(force) / depth),
        )
        whole.set_ylabel(f"force for {depth:g} mm of depth, N")
        whole.spines["right"].set(visible=True, color=INK)
        legend_above(axes)
    return drawn
