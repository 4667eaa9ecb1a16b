"""Table I of the paper, and the same of a run."""

import csv
from dataclasses import replace
from math import hypot

import pytest

from compare.report.tables import PRINTED, printed_rows, table_one, write_table_one
from geometry import Design, load_design


def test_disp_of_the_paper_is_the_root_of_the_sum_of_squares():
    for row in PRINTED:
        (means,) = [means for means in (row.given, row.held_out) if means is not None]
        u, v, _, rss = means
        assert hypot(u, v) == pytest.approx(rss, abs=5e-4)


def test_a_solver_that_does_not_tell_what_it_leaves_out_has_no_held_out_error(pinn, compared):
    (row,) = table_one(compared(replace(pinn, in_sample=True)))
    assert row.given is not None
    assert row.held_out is None


def test_the_file_has_this_run_and_the_paper(fem, pinn, observations, compared, tmp_path):
    given = replace(pinn, in_sample=True, left_out=observations.displacements + 0.125, converged=False)
    write_table_one(tmp_path / "t.csv", compared(fem, given))
    with (tmp_path / "t.csv").open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert [row["observations"] for row in rows] == ["simulated"] * 2 + ["paper"] * 3
    assert [(row["solver"], row["converged"]) for row in rows[:3]] == [
        (fem.solver, "1"),
        (pinn.solver, "0"),
        ("FEM", ""),
    ]
    assert [row["held_out_mae_v_mm"][:5] for row in rows] == ["0.400", "0.125", "0.39", "0.48", ""]
    assert [bool(row["in_sample_mae_v_mm"]) for row in rows] == [False, True, False, False, True]


def test_the_papers_numbers_stand_beside_the_papers_finger_alone() -> None:
    assert printed_rows(Design()) == printed_rows(Design(marker_layout="front", fillet_radius=1)) == PRINTED
    assert printed_rows(Design(rib_count=3)) == ()
    assert printed_rows(load_design("csiro")) == ()
