import pytest
import torch

from benchmarks.optimisers.levenberg_marquardt import levenberg_marquardt
from benchmarks.optimisers.spring import spring
from tests.benchmarks.optimisers.problems import (
    KowalikOsborne,
    LinearLeastSquares,
    RosenbrockResiduals,
    random_least_squares,
)


def test_levenberg_marquardt_solves_a_linear_problem_like_lstsq():
    # It ends where rounding hides the gain: at sqrt(1e-16 |r|²) / 0.01, the least singular value.
    problem = random_least_squares(60, 20, consistent=False, spread=100.0)
    *_, last = levenberg_marquardt(problem, torch.zeros(20, dtype=torch.float64))
    torch.testing.assert_close(last.parameters, problem.solution, rtol=0, atol=1e-6)


@pytest.mark.parametrize(
    ("problem", "least"),
    [
        (RosenbrockResiduals(), 0.0),  # no residual left: Gauss-Newton is quadratic
        (KowalikOsborne(), 3.07505e-4 / 2),  # published to six digits
    ],
)
def test_levenberg_marquardt_finds_published_minima_going_down(problem, least):
    iterates = list(levenberg_marquardt(problem, problem.start))
    values = [iterate.value for iterate in iterates]
    assert values == sorted(values, reverse=True)
    assert values[-1] == pytest.approx(least, rel=2e-6, abs=1e-25)
    assert len(iterates) < 60


def test_levenberg_marquardt_ends_at_once_where_the_gradient_vanishes():
    at_minimum = torch.ones(2, dtype=torch.float64)
    assert list(levenberg_marquardt(RosenbrockResiduals(), at_minimum)) == []


def test_spring_without_momentum_is_the_damped_gauss_newton_step():
    problem = _wide()
    start = torch.linspace(-1, 1, 30, dtype=torch.float64)
    (first,) = spring([problem], start, rate=1.0, damping=0.1, momentum=0.0)
    matrix = problem.matrix
    λ = 0.1 * (matrix @ matrix.T).trace() / len(matrix)
    normal = matrix.T @ matrix + λ * torch.eye(30, dtype=torch.float64)
    expected = start - torch.linalg.solve(normal, matrix.T @ problem.values(start))
    torch.testing.assert_close(first.parameters, expected, rtol=1e-10, atol=1e-10)


def test_the_second_step_minimises_what_defines_spring():
    problem, damping, momentum = _wide(), 0.1, 0.7
    start = torch.zeros(30, dtype=torch.float64)
    first, second = spring([problem] * 2, start, rate=0.5, damping=damping, momentum=momentum)
    before, after = (start - first.parameters) / 0.5, (first.parameters - second.parameters) / 0.5
    matrix, values = problem.matrix, problem.values(first.parameters)
    λ = damping * (matrix @ matrix.T).trace() / len(matrix)
    # The gradient over φ of |J φ - r|² + λ |φ - μ φ_before|², which is least there.
    slope = matrix.T @ (matrix @ after - values) + λ * (after - momentum * before)
    assert float(slope.abs().max()) < 1e-12


def test_momentum_makes_few_random_rows_at_a_time_enough():
    problem = random_least_squares(300, 40, consistent=True, spread=100.0)
    generator = torch.Generator().manual_seed(1)
    picks = [torch.randperm(300, generator=generator)[:20] for _ in range(600)]
    samples = [LinearLeastSquares(problem.matrix[rows], problem.right[rows]) for rows in picks]
    errors = []
    for momentum, rate in ((0.0, 1.0), (0.9, 0.3)):  # the longest steps that do not diverge
        start = torch.zeros(40, dtype=torch.float64)
        *_, last = spring(samples, start, rate=rate, damping=1e-3, momentum=momentum)
        errors.append(float((last.parameters - problem.solution).norm()))
    assert errors[1] < 1e-6 * errors[0]  # an accelerated Kaczmarz method: seen 1e-12 and 1e-3


def _wide() -> LinearLeastSquares:
    tall = random_least_squares(30, 12, consistent=True, spread=10.0)
    return LinearLeastSquares(tall.matrix.T.contiguous(), tall.right[:12])
