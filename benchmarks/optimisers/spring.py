"""Natural gradient by Woodbury's identity, with momentum, for sums of squares over random samples.

If a sample has fewer residuals m than parameters n, the damped Gauss-Newton step needs a matrix of order m
instead of n (energy natural gradient in the sample space, ENGD-W). With momentum, SPRING, the damping
regularises the difference from μ times the last step:

    φ_k = μ φ_{k-1} + J^T (J J^T + λ I)^-1 (r - μ J φ_{k-1})        θ_{k+1} = θ_k - η φ_k

Sources: G. Goldshlager, N. Abrahamsen, L. Lin: A Kaczmarz-inspired approach to accelerate the optimization
of neural network wavefunctions, J. Comput. Phys. 516 (2024) 113351, the regularised projection and its
solution; A. Guzmán-Cordero, F. Dangel, G. Goldshlager, M. Zeinhofer: Improving energy natural gradient
descent through Woodbury, momentum, and randomization, arXiv:2505.12149 (2025), for residuals of
differential equations.
"""

from collections.abc import Iterable, Iterator

import torch

from benchmarks.optimisers.least_squares import Iterate, Residuals, half_square


def spring(
    samples: Iterable[Residuals],
    start: torch.Tensor,
    *,
    rate: float,
    damping: float,
    momentum: float = 0.9,
) -> Iterator[Iterate]:
    """Minimise the mean of |r|² / 2 over samples; yields after every step, one for each sample.

    Args:
        samples: Residuals of each step.
        start: Parameters, shape (n,).
        rate: η, the length of the steps.
        damping: λ relative to the mean diagonal entry of J J^T.
        momentum: μ; zero is the natural gradient without momentum.
    """
    parameters, step = start.clone(), torch.zeros_like(start)
    for sample in samples:
        values, jacobian = sample.linearised(parameters)
        kernel = jacobian @ jacobian.T
        kernel.diagonal().add_(damping * kernel.diagonal().mean())
        remaining = values - momentum * (jacobian @ step)
        dual = torch.cholesky_solve(remaining[:, None], torch.linalg.cholesky(kernel))[:, 0]
        step = momentum * step + dual @ jacobian
        parameters = parameters - rate * step
        yield Iterate(parameters, half_square(values))
