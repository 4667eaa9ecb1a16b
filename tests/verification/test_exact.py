"""The closed forms are solutions: a misprint in one must not pass for a bug of the finite elements."""

import numpy as np
import pytest

from benchmarks.verification.cases.cantilever import end_loaded
from benchmarks.verification.cases.manufactured import waves
from benchmarks.verification.cases.plate_with_hole import kirsch
from benchmarks.verification.hooke import PlaneLaw
from benchmarks.verification.hyperelastic import Hyperelastic
from pinnray.solvers.problem import Material

CLOSED_FORMS = {
    "waves": lambda material: waves(PlaneLaw.of(material)),
    "cantilever": end_loaded,
    "hole": lambda material: kirsch(PlaneLaw.of(material)),
}
STEP = 1e-5
AXES = np.eye(2)


@pytest.mark.parametrize("plane", ["strain", "stress"])
@pytest.mark.parametrize("name", CLOSED_FORMS)
def test_closed_form_obeys_hooke_and_is_in_equilibrium(name, plane):
    material = Material(poisson=0.37, plane=plane)
    exact = CLOSED_FORMS[name](material)
    points = np.random.default_rng(0).uniform(1, 3, (50, 2))

    def derivative(function):
        pairs = [function(points + STEP * axis) - function(points - STEP * axis) for axis in AXES]
        return np.stack(pairs, axis=-1) / (2 * STEP)

    stress = exact.stress(points)
    scale = np.abs(stress).max()
    of_displacement = PlaneLaw.of(material).stress(derivative(exact.displacement))
    np.testing.assert_allclose(of_displacement, stress, atol=1e-8 * scale)
    divergence = np.einsum("nijj->ni", derivative(exact.stress))
    force = exact.body_force(points) if exact.body_force else np.zeros_like(points)
    np.testing.assert_allclose(divergence + force, 0, atol=1e-8 * scale)


@pytest.mark.parametrize("law", ["neo-hookean", "st-venant-kirchhoff"])
@pytest.mark.parametrize("size", [2, 3])
def test_stress_is_the_derivative_of_the_energy(law, size):
    elastic = Hyperelastic.of(Material(law=law))
    rng = np.random.default_rng(0)
    deformation, change = np.eye(size) + 0.2 * rng.normal(size=(2, 20, size, size))

    def derivative(function):
        return (function(deformation + STEP * change) - function(deformation - STEP * change)) / (2 * STEP)

    stress = elastic.nominal_stress(deformation)
    np.testing.assert_allclose(
        derivative(elastic.energy_density), (stress * change).sum(axis=(1, 2)), rtol=1e-6
    )
    np.testing.assert_allclose(
        derivative(elastic.nominal_stress), elastic.change_of_stress(deformation, change), atol=1e-6
    )
