"""Stress and tangent against automatic differentiation of the energy densities."""

import numpy as np
import pytest
import torch

from pinnray.solvers.elasticity import lame_constants
from pinnray.solvers.pinn.finite_basis.energy import energy_density, piola_stress_and_tangent


@pytest.mark.parametrize(
    ("law", "plane"),
    [
        ("linear", "strain"),
        ("linear", "stress"),
        ("neo-hookean", "strain"),
        ("st-venant-kirchhoff", "strain"),
    ],
)
def test_stress_and_tangent_are_derivatives_of_the_density(law, plane):
    lame = lame_constants(11.4, 0.45, plane)
    gradient = torch.from_numpy(np.random.default_rng(0).uniform(-0.3, 0.3, (5, 2, 2)))

    def density(one: torch.Tensor) -> torch.Tensor:
        return energy_density(one, lame, law)

    stress, tangent = piola_stress_and_tangent(gradient, lame, law)
    torch.testing.assert_close(stress, torch.vmap(torch.func.grad(density))(gradient))
    torch.testing.assert_close(tangent, torch.vmap(torch.func.hessian(density))(gradient))
