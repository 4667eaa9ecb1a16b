from dataclasses import replace

import numpy as np
import pytest

from pinnray.comparison.figures.solver_charts import (
    approaches_reference,
    draw_convergence,
    draw_losses,
    readable,
    records_by_kind,
    wants_log,
)
from tests.compare.figures.drawn_pages import page_of


def test_records_are_grouped_by_their_first_column(fem, pinn, evaluate):
    steps = np.array([0.0, 1.0])
    other = evaluate("other", history={"load_fraction": steps, "reaction": steps, "energy": steps})
    loss = evaluate("loss", history={"seconds": steps, "loss": steps})
    assert records_by_kind([fem, pinn, other, loss]) == {
        ("units", "energy"): [pinn],
        ("load_fraction", "energy"): [other],
        ("seconds", "loss"): [loss],
    }


def test_without_a_record_there_is_no_chart_of_energy(fem, compared):
    assert draw_convergence(compared(fem)) is None


@pytest.mark.parametrize(
    ("values", "expected"),
    [
        ([1.0, 30.0], True),  # more than a factor of twenty
        ([1.0, 10.0], False),  # less
        ([0.0, 30.0], False),  # zero has no logarithm
        ([-1.0, 30.0], False),  # nor has a negative number
        ([np.nan, 1.0, 30.0], True),  # gaps do not count
    ],
)
def test_axes_are_logarithmic_where_that_helps(values: list[float], expected: bool) -> None:
    assert wants_log(np.array(values)) is expected


def test_a_growing_load_does_not_approach_the_reference() -> None:
    assert approaches_reference(("units", "energy"))
    assert not approaches_reference(("load_fraction", "energy"))
    assert not approaches_reference(("units", "loss"))
    assert readable("newton_iterations") == "newton iterations"


def test_two_results_are_joined_by_dots_and_no_curve(fem, pinn, compared):
    short = {name: column[:2] for name, column in pinn.history.items()}
    drawn = draw_convergence(compared(fem, replace(pinn, history=short)))
    assert drawn is not None
    assert drawn.axes[0].lines[0].get_linestyle() == ":"


EPOCHS = np.array([1.0, 2.0, 3.0])
PLAIN = {"epoch": EPOCHS, "PDE": 1 / EPOCHS**4, "BC": EPOCHS, "total": EPOCHS, "energy": EPOCHS}


def test_every_term_has_a_chart_with_the_solvers_that_have_it(fem, pinn, compared):
    standard = replace(pinn, history=PLAIN)
    given = replace(pinn, solver="pinn-asm", in_sample=True, history={**PLAIN, "ASM": 0.1 * EPOCHS})
    page = page_of(draw_losses(compared(fem, standard, given)))
    assert [len(axes.get_lines()) for axes in page.figure.axes] == [2, 2, 1]
    assert [axes.get_yscale() for axes in page.figure.axes] == ["log", "linear", "linear"]
    assert page.text.count("pinn-asm †") == 1
    assert (page.cut_off(), page.overlaps()) == ([], [])


def test_without_such_a_network_there_is_no_chart(fem, pinn, compared):
    """The network that solves for its output layer has a record of its energy alone."""
    assert draw_losses(compared(fem, pinn)) is None
