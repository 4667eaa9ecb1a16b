"""Numbers as text, and cells of CSV files."""

import csv
from math import nan

import pytest

from pinnray.runtime.tables import distance, number, percent, write_csv


@pytest.mark.parametrize(
    ("value", "digits", "expected"),
    [
        (-0.25, 4, "−0.2500"),  # a typographic minus, and the digits that it has
        (float("inf"), 3, "–"),  # what is not known
        (1234.0, 4, "1234"),  # no full stop after a whole number
        (0.0, 4, "0.000"),
        (29471.4, 3, "29500"),  # no exponent where a reader does not need one
        (999.6, 3, "1000"),  # rounded up to a digit more
        (-0.02099, 3, "−0.0210"),  # a zero that is significant
        (114.2, 3, "114"),  # no point at the end
        (2.5e7, 3, "2.50e+07"),
    ],
)
def test_numbers_have_their_significant_digits(value, digits, expected):
    assert number(value, digits) == expected


def test_shares_and_distances_that_are_as_good_as_zero_are_bounds():
    assert [percent(value) for value in (-0.0123, 0, 9.4714)] == ["−1.23\xa0%", "0\xa0%", "947\xa0%"]
    assert [percent(value) for value in (23.94, -136)] == ["24\xa0times", "−136\xa0times"]
    assert [percent(value, 2, plus=True) for value in (36.5, 0.65, 0, -0.14)] == [
        *("+36\xa0times", "+65\xa0%", "0\xa0%", "−14\xa0%")
    ]
    assert [percent(value) for value in (6.1e-26, -6.1e-26)] == ["<\xa00.001\xa0%", ">\xa0−0.001\xa0%"]
    assert [percent(value, 2, sign=False) for value in (1.234, 0.05, nan)] == ["123", "5.0", "–"]
    assert [distance(value) for value in (nan, 3e-15, 9.44e-7, 0.21)] == ["–", "0", "<\xa00.0001", "0.21"]


def test_cells_keep_all_digits(tmp_path):
    write_csv(tmp_path / "t.csv", [{"a": 0.1 + 0.2, "b": "x, y"}, {"a": "", "b": None}])
    with (tmp_path / "t.csv").open() as file:
        assert list(csv.reader(file)) == [["a", "b"], ["0.30000000000000004", "x, y"], ["", ""]]
