from collections.abc import Callable
from dataclasses import replace
from math import hypot
from pathlib import Path

import numpy as np
import pytest

from pinnray.comparison.evaluation.comparison import Results
from pinnray.comparison.evaluation.evaluation import Evaluation
from pinnray.comparison.report.tables import (
    PRINTED,
    RIGID,
    marker_table,
    printed_rows,
    table_one,
    write_markers,
    write_summary,
    write_table_one,
)
from pinnray.geometry import Design, load_design
from pinnray.geometry.mesh.triangle_mesh import TriangleMesh
from pinnray.geometry.picture_frame import FIXED, HAND_HELD
from tests.compare.tables import rows_of

Rows = list[dict[str, str]]
Comparing = Callable[..., Results]
UNITS = ("_mm", "_N", "_MPa", "_1", "_N_mm_per_mm", "_N_per_mm", "_s", "_rel_l2", "_rel")
WITHOUT_UNIT = {"marker", "observations", "visible", "solver", "converged", "reference", "status"}
WITHOUT_UNIT |= {"misses_energy", "in_sample"}
WITHOUT_UNIT |= {f"{name}_{flag}" for name in ("fem", "pinn-std") for flag in ("converged", "in_sample")}


@pytest.fixture
def markers(tmp_path, fem, pinn, observe, compared) -> Rows:
    seen = observe(fem.marker_displacement + np.array([0.3, -0.4]), hidden=(1,))
    write_markers(tmp_path / "markers.csv", compared(fem, pinn, observations=seen))
    return rows_of(tmp_path / "markers.csv")


@pytest.fixture
def summary(tmp_path: Path, fem: Evaluation, failed: Evaluation, compared: Comparing) -> Rows:
    write_summary(tmp_path / "summary.csv", compared(fem, failed))
    return rows_of(tmp_path / "summary.csv")


@pytest.mark.parametrize("table", ["markers", "summary"])
def test_every_number_has_its_unit_in_the_header(table: str, request: pytest.FixtureRequest) -> None:
    headers = set(request.getfixturevalue(table)[0])
    assert {header for header in headers - WITHOUT_UNIT if not header.endswith(UNITS)} == set()


def test_numbers_come_back_to_the_last_digit(markers: Rows, pinn: Evaluation, mesh: TriangleMesh) -> None:
    assert (float(markers[0]["fem_ae_u_mm"]), float(markers[2]["fem_ae_v_mm"])) == pytest.approx((0.3, 0.4))
    got = [[float(row[f"pinn-std_{axis}_mm"]) for axis in "uv"] for row in markers]
    assert got == pinn.marker_displacement.tolist()
    assert [[float(row["x_mm"]), float(row["y_mm"])] for row in markers] == mesh.markers.tolist()


def test_displacements_are_of_the_frame_of_their_errors(tmp_path, fem, observations, compared):
    """In the picture whose frame the solver found, all markers lie another 0.2 mm along x."""
    found = replace(fem, solver="found", shown=fem.marker_displacement + np.array([0.2, 0.0]))
    write_markers(tmp_path / "markers.csv", compared(fem, found, observations=observations))
    for row in rows_of(tmp_path / "markers.csv"):
        off = [float(row[f"found_{axis}_mm"]) - float(row[f"observed_{axis}_mm"]) for axis in "uv"]
        errors = [float(row[f"found_ae_{axis}_mm"]) for axis in "uv"]
        assert np.abs(off) == pytest.approx(errors)
        assert errors == pytest.approx([0.1, 0.4])


def test_a_marker_that_was_not_seen_has_no_observation_and_no_error(markers: Rows) -> None:
    empty = {name for name, cell in markers[1].items() if cell == ""}
    kinds = ("ae", "held_out_ae")
    errors = {f"{name}_{kind}_{axis}_mm" for name in ("fem", "pinn-std") for kind in kinds for axis in "uv"}
    assert empty == errors | {"observed_u_mm", "observed_v_mm"}
    assert [row["visible"] for row in markers] == ["1", "0", "1"]


def test_the_held_out_error_of_a_single_marker_is_there(tmp_path, fem, observations, compared):
    left_out = observations.displacements + np.array([[0.1, -0.2], [0.0, 0.0], [0.3, 0.4]])
    asm = replace(fem, solver="fem-asm", in_sample=True, left_out=left_out)
    silent = replace(asm, solver="silent", left_out=None)
    write_markers(tmp_path / "markers.csv", compared(fem, asm, silent))
    first, _, last = rows_of(tmp_path / "markers.csv")
    assert float(first["fem-asm_held_out_ae_v_mm"]) == pytest.approx(0.2)
    assert float(last["fem-asm_held_out_ae_u_mm"]) == pytest.approx(0.3)
    assert first["silent_held_out_ae_u_mm"] == ""
    assert first["fem_held_out_ae_u_mm"] == first["fem_ae_u_mm"]  # it was given none


def test_the_distance_from_the_truth_is_there_if_the_markers_are_simulated(
    fem, pinn, summary, compared, tmp_path
):
    """The network's field is 1.1 times the true one."""
    write_summary(tmp_path / "s.csv", compared(fem, pinn, truth=fem))
    names = [f"to_truth_{name}_rel_l2" for name in ("displacement", "strain", "von_mises")]
    for row, off in zip(rows_of(tmp_path / "s.csv"), (0.0, 0.1), strict=True):
        assert [float(row[name]) for name in names] == pytest.approx([off] * 3)
    assert {row[name] for row in summary for name in names} == {""}


def test_the_own_error_of_the_reference_stands_beside_the_difference(estimated, pinn, compared, tmp_path):
    write_summary(tmp_path / "s.csv", compared(estimated, pinn))
    _, row = rows_of(tmp_path / "s.csv")
    assert float(row["reference_uncertainty_displacement_rel_l2"]) == pytest.approx(0.01)
    assert float(row["reference_uncertainty_energy_rel"]) == pytest.approx(-1e-4)


def test_disp_of_the_paper_is_the_root_of_the_sum_of_squares():
    for row in PRINTED:
        (means,) = [means for means in (row.given, row.held_out) if means is not None]
        assert hypot(means.mae_u, means.mae_v) == pytest.approx(means.mae_rss, abs=5e-4)


def test_the_file_has_this_run_and_the_paper(fem, pinn, observations, compared, tmp_path):
    given = replace(pinn, in_sample=True, left_out=observations.displacements + 0.125, converged=False)
    write_table_one(tmp_path / "t.csv", compared(fem, given))
    rows = rows_of(tmp_path / "t.csv")
    assert [row["observations"] for row in rows] == ["simulated"] * 2 + ["paper"] * 3
    shown = [(row["solver"], row["converged"]) for row in rows[:3]]
    assert shown == [(fem.solver, "1"), (pinn.solver, "0"), ("FEM", "")]
    assert [row["held_out_mae_v_mm"][:5] for row in rows] == ["0.400", "0.125", "0.39", "0.48", ""]
    assert [bool(row["in_sample_mae_v_mm"]) for row in rows] == [False, True, False, False, True]


def test_the_papers_numbers_stand_beside_the_papers_finger_alone() -> None:
    assert printed_rows(Design()) == printed_rows(Design(marker_layout="front", fillet_radius=1)) == PRINTED
    assert printed_rows(Design(rib_count=3)) == ()
    assert printed_rows(load_design("csiro")) == ()


def test_a_rigid_motion_is_taken_off_where_the_frame_is_unknown(fem, pinn, observations, compared, tmp_path):
    """Of what is only turned and shifted nothing remains, and both errors are named."""
    turn = np.radians(2.0)
    rotation = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    moved = observations.points + fem.marker_displacement
    shown = moved @ rotation.T + [0.3, -0.2] - observations.points
    turned = replace(observations, displacements=shown, pressed=HAND_HELD)
    given = replace(pinn, in_sample=True, left_out=shown)
    comparison = compared(fem, given, observations=turned)
    names = [row.solver for row in table_one(comparison.scores)]
    assert names == [fem.solver, f"{fem.solver}, {RIGID}", pinn.solver]
    as_it_is, off, _ = (row.held_out for row in table_one(comparison.scores))
    assert as_it_is.mae_sum > 0.1
    assert off.mae_sum == pytest.approx(0, abs=1e-9)
    write_table_one(tmp_path / "t.csv", comparison)
    assert [row["solver"] for row in rows_of(tmp_path / "t.csv")][1] == f"{fem.solver}, {RIGID}"
    assert "turned and shifted to be nearest" in str(marker_table(comparison).caption)
    assert comparison.scores[pinn.solver].rigid_motion_off is None
    known = compared(fem, given, observations=replace(turned, pressed=FIXED))
    assert [row.solver for row in table_one(known.scores)] == [fem.solver, pinn.solver]
