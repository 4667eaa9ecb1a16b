"""The minimisers by marker forces, against those of the unknowns themselves, refits and a density."""

from typing import NamedTuple

import numpy as np
import pytest
from scipy.stats import multivariate_normal

from geometry.arrays import FloatArray
from solvers.assimilation.marker_forces import MarkerForces

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


@pytest.mark.parametrize("factor", [0.2, 1.0, 30.0])
def test_the_evidence_is_the_density_of_what_is_seen(springs: Springs, factor: float) -> None:
    """By SciPy: the errors' variances scale / W on top of the prior's covariance of the markers."""
    scale, forces = 0.3, springs.forces()
    variances = scale / springs.weights
    covariance = np.diag(variances) + factor * scale * forces.compliance
    density = multivariate_normal.logpdf(forces.prior_residual.ravel(), cov=covariance)
    constant = -0.5 * np.log(2 * np.pi * variances).sum()
    assert forces.log_evidence(scale, factor) + constant == pytest.approx(density, rel=1e-10)


def test_a_direction_in_which_nothing_gives_way_stays_as_it_is() -> None:
    """The compliance of rounding's sign there is none: the residual is all that was to be moved."""
    direction = np.array([1.0, 2.0, -1.0, 0.5])
    compliance = np.outer(direction, direction) - 1e-14 * np.eye(4)
    stiff = np.array([2.0, -1.0, 0.0, 0.0])
    forces = MarkerForces(compliance, np.ones((2, 2)), stiff.reshape(2, 2))
    np.testing.assert_allclose(forces.fit(1e14).residual.ravel(), stiff, atol=0.05)
