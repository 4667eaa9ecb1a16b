"""The page on plane strain: it has what the figures say, and the figures are those of the program."""

import re

import pytest

from benchmarks.elements.plane_strain import (
    COARSE,
    DRAWN,
    FINE,
    LAYERS,
    PAGE,
    PRESETS,
    Case,
    finger_rows,
    kept,
    measured,
    tables,
)
from benchmarks.tables import table_of

DEPTHS = sorted(set(LAYERS) - {20.0})
"""Depths of the default finger other than its own, mm."""


def test_the_page_has_the_tables_of_the_figures():
    for name, table in tables(kept()).items():
        assert table_of(PAGE, name) == table


def test_every_case_is_there():
    """Without drawing the random fingers again, which takes half a minute."""
    rows = kept()
    assert len({row.key for row in rows}) == len(rows)
    for size in (COARSE, FINE):
        those = [row for row in rows if row.size == size and row.model == "strain"]
        fingers = [row.design for row in those if row.law == "linear" and row.depth not in DEPTHS]
        assert sorted(fingers) == sorted(PRESETS + DRAWN)
        assert {row.depth for row in those if row.design == "default"} == {*DEPTHS, 20.0}
        assert {row.design for row in those if row.law == "neo-hookean"} == {"default", "stiff"}


@pytest.mark.slow
def test_the_figures_are_those_of_the_program():
    """Of the thinnest body; Gmsh's versions differ by a few elements."""
    case = Case("default", "linear", 5.0, COARSE)
    those = {row.model: row for row in kept() if row[:4] == case}
    for row in measured(case):
        assert row[5:] == pytest.approx(those[row.model][5:], rel=0.03, abs=1e-3)


@pytest.mark.parametrize(
    ("said", "model", "name", "scale"),
    [
        (r"by ([\d.]+) to ([\d.]+) mm in linear elasticity", "strain", "side_markers", 1),
        (r"too large by (\d+) to (\d+) %", "strain", "force", 100),
        (r"too small by (\d+) to (\d+) %", "stress", "force", -100),
        (r"is within (\d+) to (\d+) %", "strain", "middle_von_mises", 100),
    ],
)
def test_the_ranges_in_the_text_are_those_of_the_presets(said, model, name, scale):
    text = " ".join(PAGE.read_text(encoding="utf-8").split())
    rows = [row for row in finger_rows(kept(), PRESETS) if row.law == "linear" and row.model == model]
    values = sorted(scale * getattr(row, name) for row in rows)
    digits = 2 if scale == 1 else 0
    ((low, high),) = re.findall(said, text)
    assert (float(low), float(high)) == (round(values[0], digits), round(values[-1], digits))


def test_plane_stress_is_no_better_at_the_markers():
    rows = {row.key: row for row in finger_rows(kept(), PRESETS) if row.law == "linear"}
    for key, row in rows.items():
        if row.model == "strain":
            assert rows[(*key[:4], "stress")].side_markers > 0.95 * row.side_markers
