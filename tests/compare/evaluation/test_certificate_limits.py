"""Certificates of given energies: every limit from both sides, and every number in closed form."""

from dataclasses import replace

import numpy as np
import pytest

from pinnray.comparison.evaluation.certificate import Certificate
from pinnray.comparison.evaluation.certifier import with_certificate
from pinnray.comparison.report.text import missed_energy

GOOD = Certificate(
    energy=4.04,
    fem_energy=4.0,
    excess=0.04,
    violation=0.12,
    missed=-0.02,
    weak_residual=0.1,
    imbalance=0.3,
    base=0.05,
    load=np.array([np.nan, 0.1]),
    work=8.2,
    stroke=10.0,
)
"""A converged solution: its energy is 4 N mm/mm under `fem`, its stroke 10 mm."""

INSIDE, OUTSIDE = 1 - 1e-9, 1 + 1e-9


def changed(**numbers) -> Certificate:
    return replace(GOOD, **numbers)


def test_a_verdict_can_only_take_convergence_away(fem, failed):
    assert GOOD.faults == []
    assert with_certificate(fem, GOOD).converged
    assert not with_certificate(failed, GOOD).converged
    bad = with_certificate(fem, changed(work=-2.0))
    assert not bad.converged
    assert bad.message.startswith("solved directly; it reports a force")


@pytest.mark.parametrize(
    ("name", "limit", "sign", "fault"),
    [
        # 2 % of energy: its root in the energy norm
        ("weak_residual", 0.02**0.5, 1, "stress is out of balance by 14 % in the energy norm (limit 14 %)"),
        # 2 % of the stroke, at base or contact
        ("base", 0.2, 1, "misses the conditions by up to 0.2 mm (limit 0.2 mm)"),
        ("load", 0.2, 1, "misses the conditions by up to 0.2 mm (limit 0.2 mm)"),
        # 5 % of the energy of fem
        ("excess", 0.2, 1, "energy is 5.0 % above that of fem (limit 5 %)"),
        ("missed", -0.2, -1, "reports an energy 5.0 % above that of fem (limit 5 %)"),
        ("work", 8.4, 1, "reports a force whose work is 5.0 % off twice the energy of fem (limit 5 %)"),
        ("work", 7.6, -1, "reports a force whose work is −5.0 % off twice the energy of fem (limit 5 %)"),
    ],
)
def test_every_limit_from_both_sides(name, limit, sign, fault):
    def at(factor: float) -> Certificate:
        value = limit * (factor if sign * limit > 0 else 2 - factor)
        return changed(**{name: np.array([np.nan, value]) if name == "load" else value})

    assert at(INSIDE).faults == []
    assert [found.split(maxsplit=1)[1] for found in at(OUTSIDE).faults] == [fault]


@pytest.mark.parametrize("name", ["weak_residual", "base", "excess", "missed", "work"])
def test_no_number_is_a_fault(name):
    assert len(changed(**{name: float("nan")}).faults) == 1


def test_the_larger_of_the_deviations_counts():
    (fault,) = changed(base=0.5, load=np.array([0.3, np.nan])).faults
    assert "by up to 0.5 mm (limit 0.2 mm)" in fault
    assert changed(load=np.array([0.3, 0.7])).off_at_contact == 0.7
    assert GOOD.off_at_contact == 0.1


def test_shares_of_the_energy_of_fem():
    assert GOOD.rel_excess == pytest.approx(0.01, rel=1e-12)  # rounding of a division
    assert GOOD.rel_violation == pytest.approx(0.03, rel=1e-12)
    assert GOOD.energy_norm_error == pytest.approx(0.2, rel=1e-12)  # the root of 1 + 3 %


@pytest.mark.parametrize(
    ("missed", "misses"), [(0.0801, True), (0.0799, False), (0.08, False), (-1.0, False)]
)
def test_a_quadrature_that_misses_two_percent_of_the_energy(missed, misses):
    assert changed(missed=missed).misses_energy is misses


def test_the_solution_of_fem_has_no_excess_but_rounding():
    assert not changed(excess=0.0).has_excess
    assert not changed(fem_energy=1.0, excess=1e-8**2).has_excess
    assert changed(fem_energy=1.0, excess=1.01e-16).has_excess
    assert not changed(fem_energy=1.0, excess=0.99e-16).has_excess


def test_a_result_that_misses_energy_says_so(pinn):
    missing = with_certificate(pinn, replace(GOOD, missed=0.1))
    assert "reports 2.5\xa0% less energy" in missed_energy(missing)
    assert missed_energy(with_certificate(pinn, replace(GOOD, missed=0.01))) == ""
