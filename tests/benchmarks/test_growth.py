"""The growth of cost: its slopes, and the table on the page of large meshes."""

import pytest

from benchmarks.results.growth import FIGURES, PAGE, TABLE, Growth, page_table, power
from benchmarks.tables import kept_rows, table_of


def test_the_slope_is_the_power_of_the_cost() -> None:
    rows = [Growth("fem", count, 3e-6 * count**1.2, 0.3) for count in (50_000, 200_000, 1_000_000)]
    rows.insert(0, Growth("fem", 10_000, 9.0, 0.2))  # mostly what does not grow
    assert power(rows, "seconds") == pytest.approx((1.2, 3e-6))
    assert power(rows, "gigabytes") == pytest.approx((0.0, 0.3))


def test_the_page_has_the_kept_figures() -> None:
    assert table_of(PAGE, TABLE) == page_table(kept_rows(FIGURES, Growth))
