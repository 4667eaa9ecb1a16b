"""Mistakes made on purpose: each has to be seen by the cases that are there to see it."""

import pytest
import ufl

from benchmarks.verification.cases.cantilever import CANTILEVER
from benchmarks.verification.cases.cook import COOK
from benchmarks.verification.cases.finite_strain import FINITE_STRAIN
from benchmarks.verification.cases.manufactured import MANUFACTURED
from benchmarks.verification.cases.plate_with_hole import KIRSCH
from pinnray.runtime.errors import UserError
from pinnray.solvers import elasticity
from pinnray.solvers.fem import equilibrium
from pinnray.solvers.problem import Material

pytestmark = pytest.mark.release


def passes(rows, **properties):
    """Whether all rows pass that have the properties."""
    chosen = [row for row in rows if all(getattr(row, name) == value for name, value in properties.items())]
    assert chosen
    return all(row.passed for row in chosen)


def too_much(lame):
    return lame._replace(λ=1.01 * lame.λ)


def too_much_λ(law, gradient, lame, log):
    return elasticity.energy_density_of(law, gradient, too_much(lame))


def half_the_shear(law, gradient, lame, log):
    shear = elasticity.strain_of(law, gradient)[0][1]
    return elasticity.energy_density_of(law, gradient, lame) - lame.μ * shear * shear


def plane_strain_always(young, poisson, plane):
    return elasticity.lame_constants(young, poisson, "strain")


@pytest.mark.parametrize(("mistake", "case"), [(too_much_λ, MANUFACTURED), (half_the_shear, CANTILEVER)])
def test_wrong_law(mistake, case, monkeypatch):
    monkeypatch.setattr(equilibrium, "energy_density_of", mistake)
    assert not passes(case.measure(), degree=2)


def test_wrong_law_of_finite_strain(monkeypatch):
    right = Material.lame.fget  # type: ignore[attr-defined]
    monkeypatch.setattr(Material, "lame", property(lambda self: too_much(right(self))))
    rows = FINITE_STRAIN.measure()
    assert not passes(rows, degree=1)
    assert not passes(rows, degree=2)


@pytest.mark.parametrize("case", [COOK, KIRSCH], ids=lambda case: case.name)
def test_plane_strain_for_plane_stress(case, monkeypatch):
    monkeypatch.setattr("pinnray.solvers.material.lame_constants", plane_strain_always)
    assert not passes(case.measure(), degree=2, plane="stress")


def test_too_few_integration_points(monkeypatch):
    """One point a triangle leaves P2 motions without energy: MUMPS fails, or rounding spoils its solution."""
    monkeypatch.setattr(equilibrium.ufl, "dx", ufl.dx(metadata={"quadrature_degree": 1}))  # type: ignore[attr-defined]
    rows, refused = (), ""
    try:
        rows = MANUFACTURED.measure()
    except UserError as error:
        refused = str(error)
    told = ("cannot factorise", "rounding has spoilt")
    assert any(words in refused for words in told) if refused else not passes(rows, degree=2)
