"""Laplace's approximation of `fem-id` against Markov chains of the same posterior, on the default finger.

Markers of the virtual experiment with noise of 0.005 mm; elements of 2 mm, linear; the law is given. The
chains are emcee's (extra `bench`), from walkers of the Laplace approximation. A row a parameter, and the
force: mean and standard deviation by both, and the ends of the 95 % interval of the chains, in standard
deviations of Laplace's, and the samples' number over their autocorrelation time. Half an hour on one core.

Source of the chains' steps: C. J. F. ter Braak, A Markov chain Monte Carlo version of the genetic algorithm
differential evolution, Statistics and Computing 16 (2006) 239-249.
"""

from typing import Any

import numpy as np
from rich.table import Table

from pinnray.comparison.evaluation.truths import SLIDING, virtual_experiment
from pinnray.geometry.cache import finger_mesh
from pinnray.geometry.finger.design import Design
from pinnray.geometry.mesh.settings import MeshSettings
from pinnray.geometry.observations import Observations
from pinnray.runtime.arrays import FloatArray
from pinnray.runtime.tables import terminal_table
from pinnray.solvers.assimilation.estimation import values_of
from pinnray.solvers.fem.identification import FemBody, FemIdSolver
from pinnray.solvers.identification.model import EXACT, MarkerModel
from pinnray.solvers.identification.search import Identifier
from pinnray.solvers.problem import Load, Material, Problem
from pinnray.solvers.solver import silent

NOISE = 0.005
WALKERS, STEPS, BURNED = 32, 2500, 500


def main() -> Table:
    """A row a parameter."""
    design = Design()
    problem = Problem(
        finger_mesh(design, settings=MeshSettings(size=2.0)), Material(law="neo-hookean"), Load()
    )
    seen, _ = virtual_experiment(problem, design.marker_radius, silent, SLIDING)
    errors = np.random.default_rng(0).normal(0, NOISE, seen.displacements.shape)
    observed = Observations(
        **{
            **vars(seen),
            "displacements": seen.displacements + errors,
            "standard_deviations": np.full_like(errors, NOISE),
        }
    )
    settings = FemIdSolver(degree=1, law="given")
    identifier = Identifier(settings, problem, lambda unknowns: FemBody(unknowns, settings.degree))
    fit = identifier.identify(observed).best
    found, parameters = fit.estimate, identifier.parameters
    samples, times = chains(fit.model, MarkerModel(fit.model, fit.measurement), found)
    independent = WALKERS * (STEPS - BURNED) / times
    forces = np.linalg.norm(
        [fit.model.unknowns.hypothesis(values_of(parameters, z)[0]).force for z in samples], axis=1
    )
    size, deviation = fit.force
    named = {
        parameter.name: (found.z[n], found.covariance[n, n] ** 0.5, samples[:, n])
        for n, parameter in enumerate(parameters)
    }
    rows = [
        _row(name, *numbers, count)
        for (name, numbers), count in zip(
            {**named, "force, N/mm": (size, deviation, forces)}.items(),
            [*independent, independent.min()],
            strict=True,
        )
    ]
    heads = ("parameter, standardised", "Laplace", "chains", "deviation", "chains")
    return terminal_table(
        "Posterior of fem-id on the default finger", (*heads, "2.5 %", "97.5 %", "samples"), rows
    )


def chains(model: Any, markers: MarkerModel, found: Any) -> tuple[FloatArray, FloatArray]:
    """Samples of the standardised values, shape (n, p), and their autocorrelation times (p,), steps."""
    import emcee  # type: ignore[import-not-found]

    data, parameters = markers.measurement, found.parameters
    bounds = np.array([parameter.bounds for parameter in parameters])

    def log_posterior(z: FloatArray) -> float:
        if (z < bounds[:, 0]).any() or (z > bounds[:, 1]).any():
            return -np.inf
        response = model.response(values_of(parameters, z)[0], EXACT)
        if response is None:
            return -np.inf
        away = (markers.predicted(response)[0] - data.observed) / data.noise
        return -0.5 * float(away @ away + z @ z)

    start = np.random.default_rng(1).multivariate_normal(found.z, found.covariance, WALKERS)
    moves = [(emcee.moves.DEMove(), 0.8), (emcee.moves.DESnookerMove(), 0.2)]
    sampler = emcee.EnsembleSampler(WALKERS, len(parameters), log_posterior, moves=moves)
    sampler.random_state = np.random.RandomState(1).get_state()
    sampler.run_mcmc(np.clip(start, *bounds.T), STEPS)
    times = sampler.get_autocorr_time(discard=BURNED, tol=0)
    return np.asarray(sampler.get_chain(discard=BURNED, thin=5, flat=True)), np.asarray(times)


def _row(name: str, mean: float, deviation: float, samples: FloatArray, count: float) -> tuple[str, ...]:
    low, high = (np.quantile(samples, [0.025, 0.975]) - mean) / deviation
    numbers = (mean, samples.mean(), deviation, samples.std())
    return (name, *(f"{number:.4g}" for number in numbers), f"{low:+.2f}", f"{high:+.2f}", f"{count:.0f}")
