"""The minimisers by marker forces, against those of the unknowns themselves, refits and a density."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np
import pytest

from pinnray.runtime.arrays import FloatArray
from pinnray.runtime.errors import UserError
from pinnray.solvers.assimilation.marker_forces import MarkerForces
from pinnray.solvers.assimilation.misfit import FACTORS, MarkerSettings
from pinnray.solvers.problem import Material, Problem
from tests.solvers.conftest import observed_at

MARKERS, UNKNOWNS = 3, 9


class Springs(NamedTuple):
    """Springs of a stiffness, shape (n, n), at rest in `before`, and where some of them are to be."""

    stiffness: FloatArray
    before: FloatArray
    markers: FloatArray
    wanted: FloatArray
    weights: FloatArray

    def forces(self) -> MarkerForces:
        compliance = self.markers @ np.linalg.solve(self.stiffness, self.markers.T)
        missed = (self.wanted - self.markers @ self.before).reshape(-1, 2)
        return MarkerForces(compliance, self.weights.reshape(-1, 2), missed)

    def minimiser(self, factor: float, kept: FloatArray) -> FloatArray:
        """Of energy plus misfit, by its normal equations; `kept` is 1 for what counts, shape (2 m,)."""
        weighted = factor * kept * self.weights * self.markers.T
        right = self.stiffness @ self.before + weighted @ self.wanted
        return np.linalg.solve(self.stiffness + weighted @ self.markers, right)


@pytest.fixture
def springs() -> Springs:
    random = np.random.default_rng(11)
    root = random.normal(size=(UNKNOWNS, UNKNOWNS))
    return Springs(
        stiffness=root @ root.T + np.eye(UNKNOWNS),
        before=random.normal(size=UNKNOWNS),
        markers=random.normal(size=(2 * MARKERS, UNKNOWNS)),
        wanted=random.normal(size=2 * MARKERS),
        weights=random.uniform(0.5, 2, 2 * MARKERS),
    )


@pytest.mark.parametrize("factor", [0.2, 1.0, 30.0])
def test_the_fit_is_the_minimiser_of_energy_plus_misfit(springs: Springs, factor: float) -> None:
    fit = springs.forces().fit(factor)
    moved = springs.minimiser(factor, np.ones(2 * MARKERS))
    residual = springs.wanted - springs.markers @ moved
    away = moved - springs.before
    np.testing.assert_allclose(fit.residual.ravel(), residual, rtol=1e-10)
    np.testing.assert_allclose(fit.forces.ravel(), factor * springs.weights * residual, rtol=1e-10)
    assert fit.energy == pytest.approx(0.5 * away @ springs.stiffness @ away, rel=1e-10)
    assert fit.forces.shape == fit.residual.shape == fit.residual_without.shape == (MARKERS, 2)


@pytest.mark.parametrize("factor", [0.2, 30.0])
def test_what_is_left_out_is_what_a_fit_to_the_others_misses(springs: Springs, factor: float) -> None:
    left_out = springs.forces().fit(factor).residual_without
    for marker in range(MARKERS):
        rows = [2 * marker, 2 * marker + 1]
        kept = np.ones(2 * MARKERS)
        kept[rows] = 0
        missed = springs.wanted - springs.markers @ springs.minimiser(factor, kept)
        np.testing.assert_allclose(left_out[marker], missed[rows], rtol=1e-9)


def test_a_direction_in_which_nothing_gives_way_stays_as_it_is() -> None:
    """The compliance of rounding's sign there is none: the residual is all that was to be moved."""
    direction = np.array([1.0, 2.0, -1.0, 0.5])
    compliance = np.outer(direction, direction) - 1e-14 * np.eye(4)
    stiff = np.array([2.0, -1.0, 0.0, 0.0])
    forces = MarkerForces(compliance, np.ones((2, 2)), stiff.reshape(2, 2))
    np.testing.assert_allclose(forces.fit(1e14).residual.ravel(), stiff, atol=0.05)


class Settings(MarkerSettings):
    """Those of a solver with a name."""

    name = "a-solver"


PAPER = Settings()
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


def test_markers_without_weight_are_no_markers(problem):
    assert PAPER.misfit(problem).value(np.zeros((9, 2))) > 0
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


def test_the_curve_has_every_factors_fit(forces):
    curve = PAPER.curve(forces)
    assert list(curve) == ["weight_factor", "curve_energy", "curve_in_sample_mm", "curve_left_out_mm"]
    fit = forces.fit(FACTORS[30])
    found = [curve[name][30] for name in ("curve_energy", "curve_in_sample_mm", "curve_left_out_mm")]
    means = [np.sqrt((values**2).mean()) for values in (fit.residual, fit.residual_without)]
    np.testing.assert_allclose(found, [fit.energy, *means], rtol=1e-14)


def test_the_factor_is_the_best_on_the_curve(forces):
    assert PAPER.factor(forces) == 1
    left_out = [np.linalg.norm(forces.fit(factor).residual_without) for factor in FACTORS]
    best = FACTORS[np.argmin(left_out)]
    assert best != 1
    assert replace(PAPER, choose="left-out").factor(forces) == best
    assert replace(PRECISE, choose="left-out").factor(forces) == best
