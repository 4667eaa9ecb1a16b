"""The choice of the markers' weights, on a compliance of three markers that is given."""

from dataclasses import replace

import numpy as np
import pytest

from geometry.errors import UserError
from solvers.assimilation.marker_forces import MarkerForces
from solvers.assimilation.marker_weighting import FACTORS, MarkerWeighting
from solvers.assimilation.misfit import misfit_of
from solvers.problem import Load, Material, Problem
from tests.solvers.conftest import observed_at

PAPER = MarkerWeighting(solver_name="a-solver")
PRECISE = replace(PAPER, weights="precision", scale=0.3)


@pytest.fixture
def forces() -> MarkerForces:
    """Two directions in which the body gives way, and errors of the observations."""
    random = np.random.default_rng(6)
    root = random.normal(size=(6, 2)) @ random.normal(size=(2, 6))
    moved = (3 * root @ random.normal(size=6)).reshape(3, 2) + 0.3 * random.normal(size=(3, 2))
    return MarkerForces(root @ root.T, random.uniform(0.5, 2, (3, 2)), moved)


@pytest.fixture
def problem(coarse_mesh) -> Problem:
    moved = np.full_like(coarse_mesh.markers, 0.1)
    return Problem(coarse_mesh, observations=observed_at(coarse_mesh.markers, moved, 0.02))


def test_the_compliance_of_the_contact_is_its_variance_over_the_scale():
    assert replace(PRECISE, contact_deviation=0.3).slack == pytest.approx(0.09 / 0.3)
    assert PAPER.slack == 0


def test_markers_without_weight_are_no_markers(problem):
    assert PAPER.misfit(problem).value(np.zeros((9, 2))) == misfit_of(problem).value(np.zeros((9, 2)))
    assert replace(PAPER, asm_weight=0.0).misfit(problem) is None
    assert replace(PAPER, scale=0.0).misfit(problem) is None
    assert PAPER.misfit(replace(problem, observations=None)) is None


def test_a_factor_is_chosen_for_the_linear_law_only(problem):
    bent = replace(problem, material=Material(law="neo-hookean"))
    chosen = replace(PAPER, choose="left-out")
    with pytest.raises(UserError, match="a-solver: choose=left-out is for the linear law; take given"):
        chosen.misfit(bent)
    assert PAPER.misfit(bent) is not None
    assert chosen.misfit(problem) is not None


def test_a_patch_has_no_deviation(problem):
    pressed, uncertain = replace(problem, load=Load(kind="patch")), replace(PAPER, contact_deviation=0.1)
    with pytest.raises(UserError, match="every point of a patch moves as prescribed; contact_deviation"):
        uncertain.misfit(pressed)
    assert PAPER.misfit(pressed) is not None
    assert uncertain.misfit(problem) is not None


def test_the_curve_has_every_factors_fit(forces):
    curve = PAPER.curve(forces)
    assert list(curve) == ["weight_factor", "curve_energy", "curve_in_sample_mm", "curve_left_out_mm"]
    fit = forces.fit(FACTORS[30])
    found = [curve[name][30] for name in ("curve_energy", "curve_in_sample_mm", "curve_left_out_mm")]
    means = [np.sqrt((values**2).mean()) for values in (fit.residual, fit.residual_without)]
    np.testing.assert_allclose(found, [fit.energy, *means], rtol=1e-14)
    likely = PRECISE.curve(forces)["curve_log_evidence"]
    assert likely[30] == forces.log_evidence(0.3, FACTORS[30])


def test_the_factor_is_the_best_on_the_curve(forces):
    assert PAPER.factor(forces) == 1
    left_out = [np.linalg.norm(forces.fit(factor).residual_without) for factor in FACTORS]
    likely = [forces.log_evidence(0.3, factor) for factor in FACTORS]
    best, likeliest = FACTORS[np.argmin(left_out)], FACTORS[np.argmax(likely)]
    assert len({1.0, best, likeliest}) == 3, "else one could stand for another"
    assert replace(PAPER, choose="left-out").factor(forces) == best
    assert replace(PRECISE, choose="left-out").factor(forces) == best
    assert replace(PRECISE, choose="evidence").factor(forces) == likeliest
