"""Constitutive laws, in the plane and in space, for NumPy arrays, torch tensors and UFL expressions alike.

A gradient is `H[..., i, j] = du_i/dx_j` of the displacement, 2 by 2 or 3 by 3. Linear elasticity is
Hooke's law (Timoshenko and Goodier, Theory of Elasticity, 3rd ed., chapter 2). The laws of finite strain, for
plane strain or three dimensions, are compressible neo-Hookean and St Venant-Kirchhoff (Bonet and Wood,
Nonlinear Continuum Mechanics for Finite Element Analysis, 2nd ed., section 6.4.3 and chapter 6), and
A. N. Gent's (Rubber Chem. Technol. 69 (1996) 59-61), which stiffens as chains are stretched out, with the
volumetric part of the neo-Hookean.
"""

from collections.abc import Callable
from typing import Any, assert_never, get_args

import numpy as np

from pinnray.runtime.arrays import FloatArray
from pinnray.solvers.material import Lame as Lame
from pinnray.solvers.material import LawName as LawName
from pinnray.solvers.material import check_known as check_known
from pinnray.solvers.material import lame_constants as lame_constants
from pinnray.solvers.material import lame_derivatives as lame_derivatives

LIMIT = 1.0
"""Value of tr C - 3 - 2 ln J that Gent's law cannot reach: of much filler; gum has 30 to 100.

The stiffness has grown by a third where it is a quarter, at a stretch of about 1.3.
"""

Field = Any
"""A NumPy array, a torch tensor or a UFL expression."""


def _dimension(gradient: Field) -> int:
    shape = gradient.ufl_shape if hasattr(gradient, "ufl_shape") else gradient.shape
    return int(shape[-1])


def deformation_jacobian(gradient: Field) -> Field:
    """J = det(I + H); positive unless the material is turned inside out."""
    if _dimension(gradient) == 2:
        xx, yy = 1 + gradient[..., 0, 0], 1 + gradient[..., 1, 1]
        return xx * yy - gradient[..., 0, 1] * gradient[..., 1, 0]
    f = [[gradient[..., i, j] + (1.0 if i == j else 0.0) for j in range(3)] for i in range(3)]
    return (
        f[0][0] * (f[1][1] * f[2][2] - f[1][2] * f[2][1])
        - f[0][1] * (f[1][0] * f[2][2] - f[1][2] * f[2][0])
        + f[0][2] * (f[1][0] * f[2][1] - f[1][1] * f[2][0])
    )


def strain_of(law: LawName, gradient: Field) -> list[list[Field]]:
    """Components of the infinitesimal strain for the linear law, else of Green-Lagrange's (F^T F - I) / 2.

    Raises:
        UserError: If there is no such law; the same holds for energy and stress.
    """
    check_known("law", law, get_args(LawName))
    axes = range(_dimension(gradient))

    def component(i: int, j: int) -> Field:
        linear = gradient[..., i, j] + gradient[..., j, i]
        if law == "linear":
            return 0.5 * linear
        return 0.5 * (linear + sum(gradient[..., k, i] * gradient[..., k, j] for k in axes))

    return [[component(i, j) for j in axes] for i in axes]


def energy_density_of(
    law: LawName, gradient: Field, lame: Lame, log: Callable[[Field], Field] = np.log
) -> Field:
    """Strain energy of a law per reference volume, MPa; `log` is the library's logarithm.

    With the law's strain E, ψ is λ/2 (tr E)^2 + μ E : E for the linear and the St Venant-Kirchhoff law, which
    is unsuitable for strong compression: it stays finite as J tends to zero. Neo-Hookean it is
    μ tr E - μ ln J + λ/2 (ln J)^2, and Gent's -μ/2 I_m ln(1 - (2 tr E - 2 ln J) / I_m) + λ/2 (ln J)^2.
    """
    strain = strain_of(law, gradient)
    axes = range(len(strain))
    trace = sum(strain[i][i] for i in axes)
    if law == "linear" or law == "st-venant-kirchhoff":
        squares = sum(strain[i][i] * strain[i][i] for i in axes)
        shears = sum(strain[i][j] * strain[i][j] for i in axes for j in axes if i < j)
        return 0.5 * lame.λ * trace * trace + lame.μ * (squares + 2 * shears)
    log_j = log(deformation_jacobian(gradient))
    if law == "neo-hookean":
        isochoric = lame.μ * trace - lame.μ * log_j
    elif law == "gent":
        isochoric = -0.5 * lame.μ * LIMIT * log(1 - 2 * (trace - log_j) / LIMIT)
    else:
        assert_never(law)
    return isochoric + 0.5 * lame.λ * log_j * log_j


def stress_of(law: LawName, gradient: FloatArray, lame: Lame) -> tuple[FloatArray, FloatArray]:
    """Cauchy stress of gradients (n, d, d), MPa: shape (n, d, d), and its component σ_zz, shape (n,).

    Hooke's σ = λ tr E I + 2 μ E; F σ F^T / J for the St Venant-Kirchhoff law. Neo-Hookean it is
    (μ (F F^T - I) + λ ln J I) / J; Gent's law has μ / (1 - (2 tr E - 2 ln J) / I_m) in the place of μ.
    """
    strain: FloatArray = np.moveaxis(np.array(strain_of(law, gradient)), -1, 0)
    trace = np.trace(strain, axis1=1, axis2=2)
    unit, transposed = np.eye(len(strain[0])), gradient.swapaxes(1, 2)
    volume = lame.λ * trace
    across = lame.λ_out * trace
    if law == "linear" or law == "st-venant-kirchhoff":
        stress = volume[:, None, None] * unit + 2 * lame.μ * strain
        if law == "st-venant-kirchhoff":
            jacobian = deformation_jacobian(gradient)
            stress = (unit + gradient) @ stress @ (unit + transposed) / jacobian[:, None, None]
            across = across / jacobian
    elif law == "neo-hookean" or law == "gent":
        jacobian = deformation_jacobian(gradient)
        log_j = np.log(jacobian)
        μ = lame.μ / (1 - 2 * (trace - log_j) / LIMIT) if law == "gent" else np.full(len(trace), lame.μ)
        left = gradient + transposed + gradient @ transposed
        across = lame.λ * log_j / jacobian
        stress = (μ / jacobian)[:, None, None] * left + across[:, None, None] * unit
    else:
        assert_never(law)
    return stress, across if len(unit) == 2 else stress[:, 2, 2]


def piola_stress_and_tangent(
    law: LawName, gradient: Field, lame: Lame, library: Any = np
) -> tuple[Field, Field]:
    """First Piola-Kirchhoff stress P = dψ/dH and tangent A = dP/dH at gradients H, (..., d, d), MPa.

    With G = F^-T, the neo-Hookean law has P = μ (F - G) + λ ln(J) G and, as dG = -G dF^T G,

        A_ijkl = μ δ_ik δ_jl + (μ - λ ln J) G_il G_kj + λ G_ij G_kl

    Gent's has m = μ / (1 - (2 tr E - 2 ln J) / I_m) in the place of μ, which changes by dm = 2 m^2 / (μ I_m)
    (F - G) : dF. The St Venant-Kirchhoff law has P = F S with S = λ tr(E) I + 2 μ E and

        A_ijkl = δ_ik S_jl + λ F_ij F_kl + μ ((F F^T)_ik δ_jl + F_il F_kj)

    Hooke's law has their tangent at H = 0, whatever H. `library` is NumPy or torch.

    Returns:
        P, shape (..., d, d), not a number where a finite deformation turns the material inside out, and A,
        shape (..., d, d, d, d).

    Raises:
        UserError: If there is no such law.
    """
    check_known("law", law, get_args(LawName))
    λ, μ, einsum = lame.λ, lame.μ, library.einsum
    one = library.eye(_dimension(gradient), dtype=gradient.dtype)
    same, swapped = einsum("ik,jl->ijkl", one, one), einsum("il,kj->ijkl", one, one)
    if law == "linear":
        tangent = λ * einsum("ij,kl->ijkl", one, one) + μ * (same + swapped)
        stress = einsum("ijkl,...kl->...ij", tangent, gradient)
        return stress, library.broadcast_to(tangent, (*gradient.shape, *one.shape))
    deformation, jacobian = one + gradient, deformation_jacobian(gradient)[..., None, None]
    if law == "st-venant-kirchhoff":
        strain = 0.5 * (deformation.swapaxes(-1, -2) @ deformation - one)
        second_piola = λ * einsum("...ii->...", strain)[..., None, None] * one + 2 * μ * strain
        tangent = (
            einsum("ik,...jl->...ijkl", one, second_piola)
            + λ * einsum("...ij,...kl->...ijkl", deformation, deformation)
            + μ * einsum("...ik,jl->...ijkl", deformation @ deformation.swapaxes(-1, -2), one)
            + μ * einsum("...il,...kj->...ijkl", deformation, deformation)
        )
        return library.where(jacobian > 0, deformation @ second_piola, library.nan), tangent
    log_j = library.log(jacobian)
    if len(one) == 2:  # cofactors
        inverse = library.flip(deformation, (-2, -1)) * (2 * one - 1) / jacobian
    else:
        inverse = library.linalg.inv(deformation).swapaxes(-1, -2)
    stretched = deformation - inverse
    if law == "gent":
        squares = einsum("...ij,...ij->...", deformation, deformation)[..., None, None] - len(one)
        left = 1 - (squares - 2 * log_j) / LIMIT
        m = μ / left
        stiffening = einsum("...ij,...kl->...ijkl", 2 / LIMIT * m / left * stretched, stretched)
        shear = m[..., None, None] * same + stiffening
    elif law == "neo-hookean":
        m, shear = μ, μ * same
    else:
        assert_never(law)
    tangent = (
        shear
        + einsum("...il,...kj->...ijkl", (m - λ * log_j) * inverse, inverse)
        + λ * einsum("...ij,...kl->...ijkl", inverse, inverse)
    )
    return m * stretched + λ * log_j * inverse, tangent


def piola_stress(law: LawName, gradient: FloatArray, stress: FloatArray) -> FloatArray:
    """First Piola-Kirchhoff stress J σ F^-T of plane states, (n, 2, 2), MPa; σ itself at small strain."""
    check_known("law", law, get_args(LawName))
    if law == "linear":
        return stress
    trace = np.trace(gradient, axis1=1, axis2=2)[:, None, None] + 1
    return np.asarray(stress @ (trace * np.eye(2) - gradient.swapaxes(1, 2)))  # cofactors of two by two


def von_mises(stress: FloatArray, *, stress_zz: FloatArray) -> FloatArray:
    """Von Mises stress sqrt(3/2 s : s) with the deviator s of stresses (n, d, d), MPa: shape (n,).

    Args:
        stress: Cauchy stress, in the plane or in space.
        stress_zz: Out-of-plane stress, shape (n,), which a plane state needs, too.
    """
    across = stress_zz if stress.shape[-1] == 2 else np.zeros(len(stress))
    mean = (np.trace(stress, axis1=1, axis2=2) + across) / 3
    deviator = stress - mean[:, None, None] * np.eye(stress.shape[-1])
    squares = np.einsum("nij,nij->n", deviator, deviator)
    if stress.shape[-1] == 2:
        squares = squares + (stress_zz - mean) ** 2
    return np.asarray(np.sqrt(1.5 * squares))
