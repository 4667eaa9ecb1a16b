"""Every solver gives the numbers that are stored, on every machine and with all versions of its libraries."""

import json

import pytest

from tests.solvers.contract.golden import JOBS, NUMBERS, golden

TOLERANCES = {"fem-id": 1e-6, "pinn-std": 3e-7, "pinn-asm": 1e-6}
"""Relative; about ten times the largest difference between Debian 12 and 13, one and two threads.

`docs/reliability.md` has the largest of these differences. `fem-id` searches for a least value, the
networks' equations have large condition numbers.
"""

TIGHT = 5e-9
"""Of all others: ten times the largest difference, in a displacement that is a thousandth of the largest."""

SLOW = ("pinn", "fem-id", "fem-nonlinear")


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=[pytest.mark.release] * name.startswith(SLOW)) for name in JOBS]
)
def test_the_numbers_are_those_that_are_stored(name):
    stored = json.loads(NUMBERS.read_text(encoding="utf-8"))["jobs"][name]
    assert golden(name) == pytest.approx(stored, rel=TOLERANCES.get(name, TIGHT), abs=0)
