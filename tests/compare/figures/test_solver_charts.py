from dataclasses import replace

import numpy as np
import pytest

from pinnray.comparison.figures.solver_charts import draw_losses, wants_log
from tests.compare.figures.drawn_pages import page_of


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
