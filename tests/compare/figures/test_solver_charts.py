from dataclasses import replace

import numpy as np

from pinnray.comparison.figures.solver_charts import draw_losses
from tests.compare.figures.drawn_pages import page_of

EPOCHS = np.array([1.0, 2.0, 3.0])
PLAIN = {"epoch": EPOCHS, "PDE": 1 / EPOCHS**4, "BC": EPOCHS, "total": EPOCHS, "energy": EPOCHS}


def test_every_term_has_a_chart_with_the_solvers_that_have_it(fem, pinn, compared):
    standard = replace(pinn, history=PLAIN)
    given = replace(pinn, solver="pinn-asm", in_sample=True, history={**PLAIN, "ASM": 0.1 * EPOCHS})
    page = page_of(draw_losses(compared(fem, standard, given)))
    assert [len(axes.get_lines()) for axes in page.figure.axes] == [2, 2, 1]
    assert [axes.get_yscale() for axes in page.figure.axes] == ["log"] * 3
    assert page.text.count("pinn-asm †") == 1
    assert (page.cut_off(), page.overlaps()) == ([], [])


def test_without_such_a_network_there_is_no_chart(fem, pinn, compared):
    """The network that solves for its output layer has a record of its energy alone."""
    assert draw_losses(compared(fem, pinn)) is None
