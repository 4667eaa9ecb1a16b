"""The laws in three dimensions, against the plane ones, and stresses against differences of the energy."""

import numpy as np
import pytest

from solvers.elasticity import lame_constants
from solvers.problem import Material, Problem
from solvers.solid_elasticity import solid_energy_density, solid_jacobian, solid_stress, solid_von_mises
from solvers.solution import State

LAWS = ("linear", "neo-hookean", "st-venant-kirchhoff")
LAME = lame_constants(11.4, 0.45, "strain")


@pytest.fixture
def gradients():
    """Five gradients with strains and rotations of up to 0.3, none turned inside out."""
    return np.random.default_rng(0).uniform(-0.3, 0.3, (5, 3, 3))


@pytest.mark.parametrize("law", LAWS)
def test_stress_is_the_derivative_of_the_energy(law, gradients):
    step, slopes = 1e-6, np.empty_like(gradients)
    for i, j in np.ndindex(3, 3):
        change = np.zeros((3, 3))
        change[i, j] = step
        high, low = (solid_energy_density(law, gradients + sign * change, LAME, np.log) for sign in (1, -1))
        slopes[:, i, j] = (high - low) / (2 * step)
    stress = solid_stress(law, gradients, LAME)
    if law != "linear":  # per undeformed area: P = J σ F⁻ᵀ
        inverse = np.linalg.inv(np.eye(3) + gradients)
        stress = solid_jacobian(gradients)[:, None, None] * stress @ inverse.transpose(0, 2, 1)
    np.testing.assert_allclose(stress, slopes, atol=1e-7)  # central differences: about step² and eps / step


@pytest.mark.parametrize("law", LAWS)
def test_a_plane_deformation_has_the_state_of_plane_strain(law, gradients, coarse_mesh):
    problem = Problem(coarse_mesh, Material(law=law))
    flat = gradients[:, :2, :2]
    solid = State.from_solid_gradient(np.pad(flat, ((0, 0), (0, 1), (0, 1))), problem)
    plane = State.from_gradient(flat, problem)
    for name in ("strain", "stress", "stress_zz", "von_mises", "energy_density"):
        np.testing.assert_allclose(getattr(solid, name), getattr(plane, name), rtol=1e-12, atol=1e-14)


def test_plane_stress_is_a_state_without_stress_across(gradients, coarse_mesh):
    plane = Problem(coarse_mesh, Material(plane="stress"))
    flat, lame = gradients[:, :2, :2], plane.material.solid_lame
    thinned = np.pad(flat, ((0, 0), (0, 1), (0, 1)))
    thinned[:, 2, 2] = -lame.λ / (lame.λ + 2 * lame.μ) * (flat[:, 0, 0] + flat[:, 1, 1])
    solid, expected = State.from_solid_gradient(thinned, plane), State.from_gradient(flat, plane)
    np.testing.assert_allclose(solid.stress_zz, 0, atol=1e-13)
    np.testing.assert_allclose(solid.von_mises, expected.von_mises, rtol=1e-12)


def test_von_mises_of_pulling_and_of_shearing():
    states = np.zeros((2, 3, 3))
    states[0, 2, 2] = -4.0
    states[1, 0, 2] = states[1, 2, 0] = 1.0
    np.testing.assert_allclose(solid_von_mises(states), [4.0, np.sqrt(3)])
