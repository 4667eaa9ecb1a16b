"""The constitutive laws against closed forms and differences of the energy."""

import numpy as np
import pytest
import torch

from pinnray.solvers.elasticity import (
    deformation_jacobian,
    energy_density_of,
    lame_constants,
    lame_derivatives,
    piola_stress,
    stress_of,
    von_mises,
)
from pinnray.solvers.problem import Material, Problem
from pinnray.solvers.solution import State

YOUNG, POISSON = 11.4, 0.45
LAME = lame_constants(YOUNG, POISSON, "strain")
FINITE = ("neo-hookean", "st-venant-kirchhoff", "gent")


@pytest.fixture(params=[2, 3], ids=["plane", "solid"])
def gradients(request):
    """Twenty gradients with strains and rotations of up to 0.2, within Gent's limit."""
    return np.random.default_rng(3).uniform(-0.2, 0.2, (20, request.param, request.param))


@pytest.fixture
def flat():
    return np.random.default_rng(0).uniform(-0.2, 0.2, (5, 2, 2))


def rotation(angle: float) -> np.ndarray:
    return np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])


def test_printed_constants_of_the_paper_are_plane_stress():
    assert lame_constants(YOUNG, POISSON, "stress").λ == pytest.approx(6.43, abs=5e-3)
    assert pytest.approx(35.38, abs=5e-3) == LAME.λ


@pytest.mark.parametrize("plane", ["strain", "stress"])
def test_derivatives_of_the_lame_constants_are_those_by_a_complex_step(plane):
    step = 1e-30
    moved = lame_constants(YOUNG, complex(POISSON, step), plane)
    slopes = [complex(constant).imag / step for constant in moved]
    assert lame_derivatives(YOUNG, POISSON, plane) == pytest.approx(tuple(slopes), rel=1e-12)


def test_gents_stiffness_has_grown_by_a_third_at_a_quarter_of_its_limit():
    """In simple shear J = 1 and tr C - 3 = γ^2: the shear stress is μ γ / (1 - γ^2 / LIMIT)."""
    stress, _ = stress_of("gent", np.array([[[0.0, 0.5], [0.0, 0.0]]]), LAME)
    assert stress[0, 0, 1] == pytest.approx(4 / 3 * LAME.μ * 0.5, rel=1e-12)


@pytest.mark.parametrize(
    ("plane", "modulus", "across"),
    [
        ("stress", YOUNG, 0.0),  # sigma = E eps, nothing out of plane
        ("strain", YOUNG / (1 - POISSON**2), POISSON),  # E / (1 - nu^2), sigma_zz = nu sigma_xx
    ],
)
def test_uniaxial_tension(plane, modulus, across):
    contraction = POISSON if plane == "stress" else POISSON / (1 - POISSON)
    gradient = np.diag([0.01, -contraction * 0.01])[None]
    stress, stress_zz = stress_of("linear", gradient, lame_constants(YOUNG, POISSON, plane))
    assert stress[0, 0, 0] == pytest.approx(modulus * 0.01, rel=1e-12)
    assert stress[0, 1, 1] == pytest.approx(0.0, abs=1e-14)
    assert stress_zz[0] == pytest.approx(across * stress[0, 0, 0], abs=1e-14)


@pytest.mark.parametrize("law", FINITE)
def test_rotated_state_has_the_same_energy_and_the_rotated_stress(law, gradients):
    """Objectivity: F -> Q F leaves ψ as it is and makes σ into Q σ Q^T."""
    one = np.eye(gradients.shape[-1])
    q = one.copy()
    q[:2, :2] = rotation(0.7)
    after = q @ (one + gradients) - one
    energies = [energy_density_of(law, each, LAME) for each in (gradients, after)]
    np.testing.assert_allclose(*energies, rtol=1e-12)
    (stress, stress_zz), (turned, turned_zz) = (stress_of(law, each, LAME) for each in (gradients, after))
    np.testing.assert_allclose(turned, q @ stress @ q.T, atol=1e-12)
    np.testing.assert_allclose(turned_zz, stress_zz, rtol=1e-11)


@pytest.mark.parametrize("law", ["linear", *FINITE])
def test_stress_is_the_derivative_of_the_energy(law, gradients):
    tensor = torch.tensor(gradients, requires_grad=True)
    energy_density_of(law, tensor, LAME, torch.log).sum().backward()
    cauchy, piola = stress_of(law, gradients, LAME)[0], tensor.grad.numpy()
    if law == "linear":
        np.testing.assert_allclose(cauchy, piola, rtol=1e-10)
        return
    deformation = np.eye(gradients.shape[-1]) + gradients
    jacobian = np.linalg.det(deformation)[:, None, None]
    np.testing.assert_allclose(deformation_jacobian(gradients), jacobian[:, 0, 0], rtol=1e-13)
    # Cauchy stress = P F^T / J with the first Piola stress P = dψ/dF.
    expected = piola @ deformation.transpose(0, 2, 1) / jacobian
    np.testing.assert_allclose(cauchy, expected, rtol=1e-10, atol=1e-12)
    if gradients.shape[-1] == 2:
        np.testing.assert_allclose(piola_stress(law, gradients, cauchy), piola, rtol=1e-10, atol=1e-12)


@pytest.mark.parametrize("law", FINITE)
def test_finite_strain_tends_to_hooke(law, flat):
    linear, finite = stress_of("linear", 1e-6 * flat, LAME), stress_of(law, 1e-6 * flat, LAME)
    for a, b in zip(linear, finite, strict=True):
        np.testing.assert_allclose(b, a, atol=1e-9)


@pytest.mark.parametrize("law", ["linear", *FINITE])
def test_a_plane_deformation_of_a_solid_has_the_state_of_plane_strain(law, flat, coarse_mesh):
    problem = Problem(coarse_mesh, Material(law=law))
    solid = State.from_gradient(np.pad(flat, ((0, 0), (0, 1), (0, 1))), problem)
    plane = State.from_gradient(flat, problem)
    for name in ("strain", "stress", "stress_zz", "von_mises", "energy_density"):
        np.testing.assert_allclose(getattr(solid, name), getattr(plane, name), rtol=1e-11, atol=1e-13)


def test_plane_stress_is_a_state_without_stress_across(flat, coarse_mesh):
    plane = Problem(coarse_mesh, Material(plane="stress"))
    lame = plane.material.solid_lame
    thinned = np.pad(flat, ((0, 0), (0, 1), (0, 1)))
    thinned[:, 2, 2] = -lame.λ / (lame.λ + 2 * lame.μ) * (flat[:, 0, 0] + flat[:, 1, 1])
    solid, expected = State.from_gradient(thinned, plane), State.from_gradient(flat, plane)
    np.testing.assert_allclose(solid.stress_zz, 0, atol=1e-13)
    assert not expected.stress_zz.any()
    np.testing.assert_allclose(solid.von_mises, expected.von_mises, rtol=1e-12)


def test_von_mises_stress_of_pulling_and_of_shearing_across():
    states = np.zeros((2, 3, 3))
    states[0, 2, 2] = -4.0
    states[1, 0, 2] = states[1, 2, 0] = 1.0
    found = von_mises(states, stress_zz=states[:, 2, 2])
    np.testing.assert_allclose(found, [4.0, np.sqrt(3)])
    np.testing.assert_allclose(von_mises(np.zeros((1, 2, 2)), stress_zz=np.array([-4.0])), [4.0])
