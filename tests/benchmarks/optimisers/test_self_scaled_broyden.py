import itertools

import pytest
import torch
from scipy.optimize import rosen, rosen_der

from benchmarks.optimisers.self_scaled_broyden import self_scaled_broyden, update


def rosenbrock(x: torch.Tensor) -> tuple[float, torch.Tensor]:
    return float(rosen(x.numpy())), torch.from_numpy(rosen_der(x.numpy()))


def test_it_solves_rosenbrocks_function_in_ten_dimensions():
    start = torch.tensor([-1.2, 1.0] * 5, dtype=torch.float64)
    iterates = list(itertools.islice(self_scaled_broyden(rosenbrock, start), 200))
    torch.testing.assert_close(
        iterates[-1].parameters, torch.ones(10, dtype=torch.float64), rtol=0, atol=1e-6
    )
    assert all(second.value <= first.value for first, second in itertools.pairwise(iterates))


def test_it_solves_an_ill_conditioned_quadratic_in_about_as_many_steps_as_there_are_dimensions():
    eigenvalues = torch.logspace(0, 6, 30, dtype=torch.float64)

    def quadratic(x: torch.Tensor) -> tuple[float, torch.Tensor]:
        return 0.5 * float(eigenvalues @ x**2), eigenvalues * x

    *_, last = itertools.islice(self_scaled_broyden(quadratic, torch.ones(30, dtype=torch.float64)), 150)
    assert last.value < 1e-12 * quadratic(torch.ones(30, dtype=torch.float64))[0]


@pytest.mark.parametrize("scale", [0.01, 1.0, 100.0])  # H too small, about right, too large
def test_the_updated_matrix_maps_the_change_of_gradient_to_the_step_and_stays_definite(scale):
    generator = torch.Generator().manual_seed(0)
    s, y = torch.randn(2, 8, generator=generator, dtype=torch.float64)
    y = y + (1 - min(float(s @ y), 0.0)) * s / float(s @ s)  # s·y is positive
    inverse = scale * torch.eye(8, dtype=torch.float64)
    update(inverse, s, y, float(s @ s) / scale)
    torch.testing.assert_close(inverse @ y, s)
    assert float(torch.linalg.eigvalsh(inverse)[0]) > 0


def test_it_ends_where_the_gradient_vanishes():
    assert list(self_scaled_broyden(rosenbrock, torch.ones(4, dtype=torch.float64))) == []
