"""Stress and tangent against automatic differentiation of the energy densities."""

import numpy as np
import pytest
import torch

from pinnray.solvers.elasticity import lame_constants, piola_stress_and_tangent
from pinnray.solvers.pinn.finite_basis.energy import energy_density


@pytest.mark.parametrize(
    ("law", "plane", "axes"),
    [
        ("linear", "strain", 2),
        ("linear", "stress", 2),
        ("linear", "strain", 3),
        ("neo-hookean", "strain", 2),
        ("neo-hookean", "strain", 3),
        ("st-venant-kirchhoff", "strain", 2),
        ("st-venant-kirchhoff", "strain", 3),
        ("gent", "strain", 2),
        ("gent", "strain", 3),
    ],
)
def test_stress_and_tangent_are_derivatives_of_the_density(law, plane, axes):
    lame = lame_constants(11.4, 0.45, plane)
    gradient = torch.from_numpy(np.random.default_rng(0).uniform(-0.2, 0.2, (5, axes, axes)))

    def density(one: torch.Tensor) -> torch.Tensor:
        return energy_density(one, lame, law)

    stress, tangent = piola_stress_and_tangent(law, gradient, lame, torch)
    torch.testing.assert_close(stress, torch.vmap(torch.func.grad(density))(gradient))
    torch.testing.assert_close(tangent, torch.vmap(torch.func.hessian(density))(gradient))
    for same, found in zip(
        piola_stress_and_tangent(law, gradient.numpy(), lame), (stress, tangent), strict=True
    ):
        np.testing.assert_allclose(same, found, rtol=1e-12, atol=1e-12)
