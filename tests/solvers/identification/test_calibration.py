"""Simulation-based calibration: truths drawn from the priors lie in the intervals as often as these say.

At a small stroke, where the problem is nearly linear, so that only the statistics are tested. Source: S.
Talts, M. Betancourt, D. Simpson, A. Vehtari, A. Gelman, Validating Bayesian inference algorithms with
simulation-based calibration, arXiv:1804.06788.
"""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import binom, chi2, norm

from pinnray.geometry.picture_frame import Registration
from pinnray.solvers.fem.identification import FemBody, FemIdSolver
from pinnray.solvers.identification.model import MarkerModel
from pinnray.solvers.identification.search import Identifier
from pinnray.solvers.problem import Material, Problem
from tests.solvers.conftest import observed_at

NOISE, DRAWS = 0.01, 16


@pytest.mark.slow
@pytest.mark.parametrize(
    "pressed",
    [Registration(), pytest.param(Registration(turn=1.0, shift=0.2, scale=0.01), marks=pytest.mark.release)],
)
def test_truths_from_the_priors_are_where_the_intervals_say(coarse_mesh, pressed):
    problem = Problem(coarse_mesh, Material(law="neo-hookean"))
    settings = FemIdSolver(
        degree=1,
        law="given",
        prior=0.1,
        parameters="position,normal_force,shear_force,eccentricity,front_thickness,rib_thickness",
    )
    nothing = observed_at(coarse_mesh.markers, np.zeros_like(coarse_mesh.markers), NOISE)
    nothing = replace(nothing, pressed=pressed)
    identifier = Identifier(
        settings, replace(problem, observations=nothing), lambda unknowns: FemBody(unknowns, settings.degree)
    )
    model = identifier.model(problem.material.law)
    markers = MarkerModel(model, identifier.measurement(nothing))
    count = len(identifier.parameters)
    scores, misfits = [], []
    for seed in range(DRAWS):
        random = np.random.default_rng(seed)
        z = random.normal(size=count)
        true = np.array([float(each.value(at)) for each, at in zip(identifier.parameters, z, strict=True)])
        model.restart(None)
        shown = markers.predicted(model.response(true, 1e-6))[0].reshape(-1, 2)
        observed = replace(nothing, displacements=shown + random.normal(0, NOISE, shown.shape))
        found = identifier.identify(observed).best.estimate
        away = found.z - z
        misfits.append(
            float(away @ np.linalg.solve(found.covariance, away)) / (found.quantile / norm.ppf(0.975)) ** 2
        )
        scores += ((found.intervals[:, 0] < true) & (true < found.intervals[:, 1])).tolist()
    # The squared distance of all unknowns is chi square of their number, and independent intervals hold 95 %
    # of the truths; both within what chance leaves once in a thousand tests.
    low, high = chi2.ppf([0.0005, 0.9995], count * DRAWS)
    assert low < sum(misfits) < high
    assert np.sum(scores) >= binom.ppf(0.0005, len(scores), 0.95)
