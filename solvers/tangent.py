"""Energy density, first Piola-Kirchhoff stress and tangent, for Newton's method on torch tensors.

Source: J. Bonet, R. D. Wood, Nonlinear Continuum Mechanics for Finite Element Analysis, 2nd ed., section
6.4.3; with d(F^-T) = -F^-T dF^T F^-T.
"""

import torch

from solvers.elasticity import Lame, LawName, energy_density_of


def energy_density(gradient: torch.Tensor, lame: Lame, law: LawName) -> torch.Tensor:
    """ψ of a law at displacement gradients (n, 2, 2): (n,), MPa."""
    return torch.as_tensor(energy_density_of(law, gradient, lame, torch.log))


def piola_stress_and_tangent(
    gradient: torch.Tensor, lame: Lame, law: LawName
) -> tuple[torch.Tensor, torch.Tensor]:
    """P = dψ/dH and A = dP/dH of the laws of `solvers.elasticity`.

    With G = F^-T, the neo-Hookean law has P = μ (F - G) + λ ln(J) G and

        A_ijkl = μ δ_ik δ_jl + (μ - λ ln J) G_il G_kj + λ G_ij G_kl

    Hooke's law has the same tangent at H = 0, whatever H.

    Args:
        gradient: H[n, i, j] = du_i/dx_j, shape (n, 2, 2), with det(I + H) > 0 for the law "neo-hookean".
        lame: Lamé constants of the plane law, MPa.
        law: "linear" or "neo-hookean".

    Returns:
        P, shape (n, 2, 2), and A, shape (n, 2, 2, 2, 2), MPa.
    """
    λ, μ = lame.λ, lame.μ
    one = torch.eye(2, dtype=gradient.dtype)
    linear = law == "linear"
    deformation = one + (torch.zeros_like(gradient) if linear else gradient)
    log_j = torch.linalg.det(deformation).log()[:, None, None]
    inverse = torch.linalg.inv(deformation).mT
    pressure = λ * log_j
    tangent = (
        μ * torch.einsum("ik,jl->ijkl", one, one)
        + torch.einsum("nil,nkj->nijkl", (μ - pressure) * inverse, inverse)
        + λ * torch.einsum("nij,nkl->nijkl", inverse, inverse)
    )
    if linear:
        return torch.einsum("nijkl,nkl->nij", tangent, gradient), tangent
    return μ * (deformation - inverse) + pressure * inverse, tangent
