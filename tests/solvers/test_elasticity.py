"""The constitutive laws against closed forms and finite differences."""

import numpy as np
import pytest
import torch

from solvers.elasticity import (
    PlaneTensor,
    energy_density_of,
    lame_constants,
    lame_derivatives,
    linear_energy_density,
    linear_stress,
    small_strain,
    strain_of,
    stress_of,
    von_mises,
)
from solvers.problem import Material

YOUNG, POISSON = 11.4, 0.45
FINITE = ("neo-hookean", "st-venant-kirchhoff", "gent")


def rotation(angle: float) -> np.ndarray:
    return np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])


def test_printed_constants_of_the_paper_are_plane_stress():
    assert lame_constants(YOUNG, POISSON, "stress").λ == pytest.approx(6.43, abs=5e-3)
    assert lame_constants(YOUNG, POISSON, "strain").λ == pytest.approx(35.38, abs=5e-3)


@pytest.mark.parametrize("plane", ["strain", "stress"])
def test_derivatives_of_the_lame_constants_are_those_by_a_complex_step(plane):
    step = 1e-30
    moved = lame_constants(YOUNG, complex(POISSON, step), plane)
    slopes = [complex(constant).imag / step for constant in moved]
    assert lame_derivatives(YOUNG, POISSON, plane) == pytest.approx(tuple(slopes), rel=1e-12)


def test_gents_stiffness_has_grown_by_a_third_at_a_quarter_of_its_limit():
    """In simple shear J = 1 and tr C - 3 = γ^2: the shear stress is μ γ / (1 - γ^2 / LIMIT)."""
    shear = np.array([[[0.0, 0.5], [0.0, 0.0]]])
    lame = lame_constants(YOUNG, POISSON, "strain")
    stress = stress_of("gent", shear, lame, np.log)
    assert stress.xy[0] == pytest.approx(4 / 3 * lame.μ * 0.5, rel=1e-12)


@pytest.mark.parametrize(
    ("plane", "modulus", "stress_zz"),
    [
        ("stress", YOUNG, 0.0),  # sigma = E eps, nothing out of plane
        ("strain", YOUNG / (1 - POISSON**2), POISSON),  # E / (1 - nu^2), sigma_zz = nu sigma_xx
    ],
)
def test_uniaxial_tension(plane, modulus, stress_zz):
    lame = lame_constants(YOUNG, POISSON, plane)
    contraction = POISSON if plane == "stress" else POISSON / (1 - POISSON)
    stress = linear_stress(np.array([[[0.01, 0.0], [0.0, -contraction * 0.01]]]), lame)
    assert stress.xx[0] == pytest.approx(modulus * 0.01, rel=1e-12)
    assert stress.yy[0] == pytest.approx(0.0, abs=1e-14)
    assert stress.zz[0] == pytest.approx(stress_zz * stress.xx[0], abs=1e-14)


def test_plane_stress_thickness_strain_is_that_of_uniaxial_tension():
    lame = lame_constants(YOUNG, POISSON, "stress")
    strain = small_strain(np.array([[[0.01, 0.0], [0.0, -POISSON * 0.01]]]), lame)
    assert strain.zz[0] == pytest.approx(-POISSON * 0.01, rel=1e-12)


@pytest.mark.parametrize("law", ["linear", *FINITE])
def test_plane_strain_has_no_strain_along_the_thickness(law):
    lame = lame_constants(YOUNG, POISSON, "strain")
    assert strain_of(law, np.array([[[0.01, 0.0], [0.0, 0.02]]]), lame).zz[0] == 0.0


def test_the_linear_law_has_small_strain_and_hookes_stress():
    gradient = np.random.default_rng(1).normal(size=(5, 2, 2))
    lame = lame_constants(YOUNG, POISSON, "strain")
    for found, expected in (
        (strain_of("linear", gradient, lame), small_strain(gradient, lame)),
        (stress_of("linear", gradient, lame, np.log), linear_stress(gradient, lame)),
    ):
        np.testing.assert_array_equal(found, expected)


@pytest.mark.parametrize("plane", ["strain", "stress"])
def test_linear_energy_is_half_stress_times_strain(plane):
    gradient = np.random.default_rng(0).normal(size=(50, 2, 2))
    lame = lame_constants(YOUNG, POISSON, plane)
    stress, strain = linear_stress(gradient, lame), small_strain(gradient, lame)
    work = 0.5 * (stress.xx * strain.xx + stress.yy * strain.yy + 2 * stress.xy * strain.xy)
    np.testing.assert_allclose(linear_energy_density(gradient, lame), work, rtol=1e-12)


def test_infinitesimal_rotation_has_no_stress():
    stress = linear_stress(np.array([[[0.0, -0.3], [0.3, 0.0]]]), lame_constants(YOUNG, POISSON, "strain"))
    assert max(abs(component).max() for component in stress) == 0.0


@pytest.mark.parametrize("law", FINITE)
@pytest.mark.parametrize("angle", [0.3, 2.0, 3.1])
def test_finite_rotation_has_no_stress(law, angle):
    lame = lame_constants(YOUNG, POISSON, "strain")
    stress = stress_of(law, rotation(angle)[None] - np.eye(2), lame, np.log)
    assert max(abs(component).max() for component in stress) < 1e-13


@pytest.mark.parametrize("law", FINITE)
def test_rotated_state_has_the_same_energy_and_the_rotated_stress(law):
    """Objectivity: F -> Q F leaves ψ as it is and makes σ into Q σ Q^T."""
    lame, q = lame_constants(YOUNG, POISSON, "strain"), rotation(0.7)
    deformation = np.eye(2) + np.random.default_rng(3).uniform(-0.2, 0.2, (20, 2, 2))  # within Gent's limit
    before, after = deformation - np.eye(2), q @ deformation - np.eye(2)
    np.testing.assert_allclose(
        energy_density_of(law, after, lame, np.log), energy_density_of(law, before, lame, np.log), rtol=1e-12
    )
    tensors = []
    for gradient in (before, after):
        xx, yy, xy, zz = stress_of(law, gradient, lame, np.log)
        tensors.append((np.array([[xx, xy], [xy, yy]]).transpose(2, 0, 1), zz))
    np.testing.assert_allclose(tensors[1][0], q @ tensors[0][0] @ q.T, atol=1e-12)
    np.testing.assert_allclose(tensors[1][1], tensors[0][1], rtol=1e-12)


@pytest.mark.parametrize("law", FINITE)
def test_stress_is_the_derivative_of_the_energy(law):
    lame = lame_constants(YOUNG, POISSON, "strain")
    gradient = torch.tensor(np.random.default_rng(1).uniform(-0.2, 0.2, (20, 2, 2)), requires_grad=True)
    energy_density_of(law, gradient, lame, torch.log).sum().backward()
    deformation = np.eye(2) + gradient.detach().numpy()
    # Cauchy stress = P F^T / J with the first Piola stress P = dψ/dF.
    cauchy = gradient.grad.numpy() @ deformation.transpose(0, 2, 1)
    cauchy /= np.linalg.det(deformation)[:, None, None]
    stress = stress_of(law, gradient.detach().numpy(), lame, np.log)
    np.testing.assert_allclose(stress.xx, cauchy[:, 0, 0], rtol=1e-10, atol=1e-12)
    np.testing.assert_allclose(stress.yy, cauchy[:, 1, 1], rtol=1e-10, atol=1e-12)
    np.testing.assert_allclose(stress.xy, cauchy[:, 0, 1], rtol=1e-10, atol=1e-12)
    np.testing.assert_allclose(stress.xy, cauchy[:, 1, 0], rtol=1e-10, atol=1e-12)


@pytest.mark.parametrize("law", FINITE)
def test_finite_strain_tends_to_hooke(law):
    lame = lame_constants(YOUNG, POISSON, "strain")
    gradient = 1e-6 * np.random.default_rng(2).normal(size=(20, 2, 2))
    linear, finite = linear_stress(gradient, lame), stress_of(law, gradient, lame, np.log)
    for a, b in zip(linear, finite, strict=True):
        np.testing.assert_allclose(b, a, atol=1e-9)


def test_st_venant_kirchhoff_stretch_has_the_stress_of_the_closed_form():
    """Stretch s along x: E_xx = (s^2 - 1) / 2, σ_xx = (λ + 2 μ) E_xx s, σ_yy = σ_zz = λ E_xx / s."""
    lame, s = lame_constants(YOUNG, POISSON, "strain"), 1.4
    stress = stress_of("st-venant-kirchhoff", np.array([[[s - 1, 0.0], [0.0, 0.0]]]), lame, np.log)
    strain = 0.5 * (s * s - 1)
    assert stress.xx[0] == pytest.approx((lame.λ + 2 * lame.μ) * strain * s, rel=1e-12)
    assert stress.yy[0] == pytest.approx(lame.λ * strain / s, rel=1e-12)
    assert stress.zz[0] == pytest.approx(lame.λ * strain / s, rel=1e-12)
    assert stress.xy[0] == 0.0


def test_von_mises_needs_the_out_of_plane_stress():
    xx, yy, xy = 2.0, 0.5, 0.7
    zz = POISSON * (xx + yy)
    tensor = np.array([[xx, xy, 0], [xy, yy, 0], [0, 0, zz]])
    deviator = tensor - np.trace(tensor) / 3 * np.eye(3)
    expected = np.sqrt(1.5 * (deviator**2).sum())
    assert von_mises(PlaneTensor(*map(np.array, (xx, yy, xy, zz))), np.sqrt) == pytest.approx(
        expected, rel=1e-12
    )


@pytest.mark.parametrize("law", FINITE)
def test_finite_strain_in_plane_stress_is_refused(law):
    with pytest.raises(ValueError, match=f"the {law} law is given for plane strain only"):
        Material(plane="stress", law=law)
