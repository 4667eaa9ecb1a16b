"""The tables that a run prints."""

from collections.abc import Callable
from dataclasses import replace
from io import StringIO

import pytest
from rich.console import Console
from rich.table import Table

from pinnray.comparison.evaluation.comparison import Results
from pinnray.comparison.evaluation.evaluation import Evaluation
from pinnray.comparison.report.tables import body_table, marker_table

Comparing = Callable[..., Results]


def printed(table: Table, *, width: int = 80) -> str:
    stream = StringIO()
    Console(file=stream, width=width).print(table)
    return stream.getvalue()


def cells(text: str, solver: str) -> list[str]:
    (line,) = [line for line in text.splitlines() if line.strip().startswith(solver)]
    return line.removeprefix("  " + solver).split()


def test_errors_at_markers_that_were_given_stand_apart_from_those_left_out(pinn, observations, compared):
    """What is said of a marker left out is 0.125 mm off in either component."""
    fitted = replace(pinn, in_sample=True, marker_displacement=observations.displacements)
    told = replace(fitted, left_out=observations.displacements + 0.125)
    assert cells(printed(marker_table(compared(fitted))), "pinn-std") == ["0.000"] * 4 + ["–"] * 4
    found = cells(printed(marker_table(compared(told))), "pinn-std")
    assert found == ["0.000"] * 4 + ["0.125", "0.125", "0.250", "0.177"]


def test_distances_over_the_body(estimated: Evaluation, pinn: Evaluation, compared: Comparing):
    """The network is 10 % off, and the reference 1 % by its own estimate."""
    whole = printed(body_table(compared(estimated, pinn, truth=pinn)))
    text = whole.split("from ref.:")[0]
    assert cells(text, "fem") == ["–", "–", "9.1", "%", "9.1", "%", "−9.1", "%", "1.25"]
    assert cells(text, "pinn-std") == ["10", "%", "–", "0", "%", "0", "%", "0", "%", "1.25"]
    assert "fem itself is off by 1.0\N{NO-BREAK SPACE}%" in whole


@pytest.mark.parametrize("width", [80, 120])
def test_both_tables_fit_eighty_columns(estimated, failed, compared, width):
    slow = replace(failed, stats={"seconds": 12345.2}, in_sample=True, left_out=failed.marker_displacement)
    both = compared(estimated, slow, truth=failed)
    long = compared(replace(estimated, solver="fem-nonlinear"), slow, truth=failed)
    tables = [marker_table(both), body_table(both), body_table(long)]
    text = "".join(printed(table, width=width) for table in tables)
    assert "12345 " in text
    assert "fem-nonlinear" in text
    assert "(not converged)" in text
    assert "…" not in text
    assert max(map(len, text.splitlines())) <= 80
