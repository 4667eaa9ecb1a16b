"""Gauss-Newton with Levenberg's and Marquardt's damping, for sums of squares.

Source: K. Madsen, H. B. Nielsen, O. Tingleff: Methods for non-linear least squares problems, 2nd ed.,
Technical University of Denmark 2004: step (3.13), gain ratio (3.14), and algorithm 3.16 with Nielsen's rule
for the damping.
"""

from collections.abc import Iterator

import torch

from benchmarks.optimisers.least_squares import Iterate, Residuals, half_square

LARGEST_DAMPING = 1e20
"""Relative to the start; there the steps no longer change the parameters."""


def levenberg_marquardt(
    residuals: Residuals, start: torch.Tensor, *, damping: float = 1e-3
) -> Iterator[Iterate]:
    """Minimise |r|² / 2; yields after every accepted step and ends where no step decreases it.

    Args:
        residuals: The functions.
        start: Parameters, shape (n,), double precision.
        damping: Damping of the first step relative to the largest diagonal entry of J^T J.
    """
    parameters = start.clone()
    values, jacobian = residuals.linearised(parameters)
    hessian, gradient, value = jacobian.T @ jacobian, jacobian.T @ values, half_square(values)
    first = μ = damping * float(hessian.diagonal().max())
    growth = 2.0
    while μ <= LARGEST_DAMPING * first and bool(gradient.any()):
        factor, failed = torch.linalg.cholesky_ex(hessian + μ * torch.eye(len(hessian), dtype=hessian.dtype))
        gain = -1.0
        if not int(failed):
            step = -torch.cholesky_solve(gradient[:, None], factor)[:, 0]
            predicted = 0.5 * float(step @ (μ * step - gradient))
            gain = (value - half_square(residuals.values(parameters + step))) / predicted
        if gain > 0:
            parameters = parameters + step
            values, jacobian = residuals.linearised(parameters)
            hessian, gradient, value = jacobian.T @ jacobian, jacobian.T @ values, half_square(values)
            yield Iterate(parameters, value)
            μ, growth = μ * max(1 / 3, 1 - (2 * gain - 1) ** 3), 2.0
        else:
            μ, growth = μ * growth, 2 * growth
