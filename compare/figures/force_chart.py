"""Force over displacement of the indenter."""

from collections.abc import Sequence

import numpy as np

from compare.evaluation.force_displacement import ForceCurve, follows_load
from compare.figures.style import axes_at, heading, legend_above, legend_height, solver_colour
from geometry.figure import INK, MEASURED, WIDTH, Figure, figure

HEAD, HEIGHT, FOOT, LEFT, RIGHT = 0.3, 2.4, 0.45, 0.75, 0.65
"""Heights and the margins, inches."""

SIMULATED = "truth, simulated"


def draw_force_displacement(
    curves: Sequence[ForceCurve], *, depth: float, truth: ForceCurve | None = None
) -> Figure:
    """Draw every curve: per mm of depth on the left axis, for the depth, mm, on the right one.

    A solver that follows the load has a mark at each of its equilibria, a linear one a dashed line. A cross
    is the end of the simulated finger's curve.
    """
    labels = [_label(curve, curve.evaluation.label) for curve in curves]
    every = [*curves, truth] if truth else curves
    height = legend_height([*labels, _label(truth, SIMULATED)] if truth else labels)
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
        if truth:
            axes.plot(
                truth.travel[-1:],
                truth.force[-1:],
                linestyle="",
                marker="x",
                markersize=7,
                markeredgewidth=1.8,
                color=MEASURED,
                label=_label(truth, SIMULATED),
                zorder=4,
            )
        axes.set_xlim(0, 1.02 * max(curve.travel[-1] for curve in every))
        forces = np.concatenate([curve.force for curve in every])
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


def _label(curve: ForceCurve, name: str) -> str:
    return f"{name}, {curve.force[-1]:.3g} N/mm at {curve.travel[-1]:.3g} mm"
