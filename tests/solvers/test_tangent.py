"""Stress and tangent against automatic differentiation of the energy densities."""

import numpy as np
import pytest
import torch

from solvers.elasticity import lame_constants, linear_energy_density, neo_hookean_energy_density
from solvers.tangent import piola_stress_and_tangent


@pytest.mark.parametrize(
    ("law", "plane"), [("linear", "strain"), ("linear", "stress"), ("neo-hookean", "strain")]
)
def test_stress_and_tangent_are_derivatives_of_the_density(law, plane):
    lame = lame_constants(11.4, 0.45, plane)
    gradient = torch.from_numpy(np.random.default_rng(0).uniform(-0.3, 0.3, (5, 2, 2)))

    def density(one: torch.Tensor) -> torch.Tensor:
        if law == "linear":
            return linear_energy_density(one, lame)
        return neo_hookean_energy_density(one, lame, torch.log)

    stress, tangent = piola_stress_and_tangent(gradient, lame, law)
    torch.testing.assert_close(stress, torch.vmap(torch.func.grad(density))(gradient))
    torch.testing.assert_close(tangent, torch.vmap(torch.func.hessian(density))(gradient))
