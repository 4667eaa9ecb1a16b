"""The losses of networks that are trained by gradients, over the epochs."""

from compare.evaluation.comparison import Comparison
from compare.figures.energy_chart import wants_log
from compare.figures.style import axes_at, heading, legend_above, legend_height, solver_colour
from geometry.figure import WIDTH, Figure, figure

LOSSES = {"PDE": "MPa", "BC": "mm²", "ASM": "mm²"}
"""The terms of the paper's loss, without their weights, and their units."""
EPOCH = "epoch"
HEAD, HEIGHT, GAP, FOOT, LEFT = 0.3, 1.15, 0.15, 0.42, 0.85
"""Heights and the left margin, inches."""


def draw_losses(comparison: Comparison) -> Figure | None:
    """Draw a chart for each term of the loss, with a line for every solver that has it (Fig. 7 of the paper).

    None without a record.
    """
    trained = {
        number: evaluation
        for number, evaluation in enumerate(comparison.evaluations)
        if {EPOCH, "PDE"} <= evaluation.history.keys()
    }
    if not trained:
        return None
    terms = [name for name in LOSSES if any(name in each.history for each in trained.values())]
    legend = legend_height([evaluation.label_at_markers for evaluation in trained.values()])
    with figure(HEAD + legend + len(terms) * (HEIGHT + GAP) + FOOT) as drawn:
        heading(drawn, "Losses over the epochs, without their weights")
        for row, term in enumerate(terms):
            top = HEAD + legend + row * (HEIGHT + GAP)
            axes = axes_at(drawn, (LEFT, top, WIDTH - LEFT - 0.15, HEIGHT))
            for number, evaluation in trained.items():
                if term in evaluation.history:
                    losses = evaluation.history[term]
                    label = evaluation.label_at_markers
                    axes.plot(
                        evaluation.history[EPOCH], losses, color=solver_colour(number), lw=1, label=label
                    )
                    if wants_log(losses):
                        axes.set_yscale("log")
            axes.set_ylabel(rf"$\mathcal{{L}}_\mathrm{{{term}}}$, {LOSSES[term]}")
            axes.grid(color="#dddddd", linewidth=0.5)
            if row == 0:
                legend_above(axes)
            if row < len(terms) - 1:
                axes.tick_params(labelbottom=False)
        axes.set_xlabel(EPOCH)
    return drawn
