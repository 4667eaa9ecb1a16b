"""The self-scaled Broyden method: quasi-Newton with a full approximation H of the inverse Hessian, (n, n).

With the step s, the change y of the gradient g, and

    b = s·H⁻¹s / s·y = -α s·g / s·y      h = y·Hy / s·y      a = b h - 1      c = sqrt(a / (1 + a))
    ρ⁻ = min(1, h (1 - c))      θ⁻ = (ρ⁻ - 1) / a      θ⁺ = 1 / ρ⁻      θ = max(θ⁻, min(θ⁺, (1 - b) / b))
    σ = 1 + a θ      ρ = min(1, 1 / b)      φ = (1 - θ) / σ      v = s / s·y - Hy / y·Hy
    τ = min(ρ σ^(1/(1-n)), σ) if θ <= 0 else ρ min(σ^(1/(1-n)), 1 / θ)

the update is H <- (H - Hy (Hy)^T / y·Hy + φ y·Hy v v^T) / τ + s s^T / s·y; φ = τ = 1 is BFGS.

Sources: J. F. Urbán, P. Stefanou, J. A. Pons: Unveiling the optimization process of physics informed neural
networks: How accurate and competitive can PINNs be?, J. Comput. Phys. 523 (2025) 113656
(SSBroyden), after M. Al-Baali, H. Khalfan: Wide interval for efficient self-scaling quasi-Newton
algorithms, Optim. Methods Softw. 20 (2005) 679-691. The first H is scaled as in J. Nocedal, S. Wright:
Numerical Optimization, 2nd ed., (6.20).
"""

import warnings
from collections.abc import Callable, Iterator

import numpy as np
import torch
from scipy.optimize import line_search

from benchmarks.optimisers.least_squares import Iterate
from geometry.arrays import FloatArray

Objective = Callable[[torch.Tensor], tuple[float, torch.Tensor]]
"""Value and gradient (n,) at parameters (n,)."""

SMALLEST = 1e-14
"""The least a: rounding may leave less where s and Hy are parallel, as at the first step in one dimension."""


def self_scaled_broyden(objective: Objective, start: torch.Tensor) -> Iterator[Iterate]:
    """Minimise a function; yields after every step and ends where the line search finds no better point.

    Args:
        objective: The function with its gradient.
        start: Parameters, shape (n,), double precision.
    """
    known: dict[bytes, tuple[float, FloatArray]] = {}

    def evaluate(x: FloatArray) -> tuple[float, FloatArray]:
        key = x.tobytes()
        if key not in known:
            value, gradient = objective(torch.from_numpy(x))
            known[key] = value, gradient.numpy().copy()
        return known[key]

    x = start.numpy().copy()
    value, gradient = evaluate(x)
    before = value + float(np.linalg.norm(gradient)) / 2  # the line search tries a step of length one first
    inverse: torch.Tensor | None = None
    while gradient.any():
        direction = -gradient if inverse is None else -(inverse @ torch.from_numpy(gradient)).numpy()
        with warnings.catch_warnings(action="ignore", category=RuntimeWarning):
            length = line_search(
                lambda x: evaluate(x)[0], lambda x: evaluate(x)[1], x, direction, gradient, value, before
            )[0]
        if length is None:
            return
        s, old_gradient, before = length * direction, gradient, value
        x = x + s
        known = {x.tobytes(): evaluate(x)}
        value, gradient = evaluate(x)
        y = gradient - old_gradient
        scale = 1.0
        if inverse is None:
            scale = float((s @ y) / (y @ y))
            inverse = scale * torch.eye(len(x), dtype=torch.float64)
        curvature_before = -length * float(s @ old_gradient) / scale
        update(inverse, torch.from_numpy(s), torch.from_numpy(y), curvature_before)
        yield Iterate(torch.from_numpy(x), value)


def update(inverse: torch.Tensor, s: torch.Tensor, y: torch.Tensor, curvature: float) -> None:
    """Update H in place.

    Args:
        inverse: H, shape (n, n).
        s: Step, shape (n,).
        y: Change of the gradient, shape (n,), with s·y > 0.
        curvature: s·H⁻¹s.
    """
    image = inverse @ y
    sy, yhy = float(s @ y), float(y @ image)
    b, h = curvature / sy, yhy / sy
    a = max(b * h - 1, SMALLEST)
    ρ_low = min(1.0, h * (1 - (a / (1 + a)) ** 0.5))
    θ = max((ρ_low - 1) / a, min(1 / ρ_low, (1 - b) / b))
    σ, ρ = 1 + a * θ, min(1.0, 1 / b)
    root = abs(σ) ** (1 / (1 - max(len(s), 2)))
    τ = min(ρ * root, σ) if θ <= 0 else ρ * min(root, 1 / θ)
    φ = (1 - θ) / σ
    v = s / sy - image / yhy
    vectors = torch.stack([image, v, s], dim=1)
    factors = inverse.new_tensor([-1 / (yhy * τ), φ * yhy / τ, 1 / sy])
    torch.addmm(inverse, vectors * factors, vectors.T, beta=1 / τ, out=inverse)
