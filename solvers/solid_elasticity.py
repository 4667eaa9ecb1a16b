"""Constitutive laws in three dimensions, for NumPy arrays and UFL expressions alike.

The laws of `elasticity` without an assumption on the third direction (Bonet and Wood, 2nd ed., section 6.4.3
and chapter 6). Where u_z is zero and nothing depends on z, they are the laws of plane strain.
"""

from collections.abc import Callable
from itertools import product

import numpy as np

from geometry.arrays import FloatArray
from solvers.elasticity import Field, Lame, LawName

AXES = range(3)


def solid_jacobian(gradient: Field) -> Field:
    """J = det(I + H) of gradients H[..., i, j] = du_i/dx_j of shape (..., 3, 3)."""
    f = [[gradient[..., i, j] + (1.0 if i == j else 0.0) for j in AXES] for i in AXES]
    return (
        f[0][0] * (f[1][1] * f[2][2] - f[1][2] * f[2][1])
        - f[0][1] * (f[1][0] * f[2][2] - f[1][2] * f[2][0])
        + f[0][2] * (f[1][0] * f[2][1] - f[1][1] * f[2][0])
    )


def solid_strain(law: LawName, gradient: Field) -> list[list[Field]]:
    """Components of the infinitesimal strain for the linear law, else of Green-Lagrange's (F^T F - I) / 2."""
    quadratic = 0 if law == "linear" else 1

    def component(i: int, j: int) -> Field:
        squares = sum(gradient[..., k, i] * gradient[..., k, j] for k in AXES) if quadratic else 0
        return 0.5 * (gradient[..., i, j] + gradient[..., j, i] + squares)

    return [[component(i, j) for j in AXES] for i in AXES]


def solid_energy_density(law: LawName, gradient: Field, lame: Lame, log: Callable[[Field], Field]) -> Field:
    """Strain energy of a law per reference volume, MPa; `log` is the library's logarithm.

    λ/2 (tr E)^2 + μ E : E; for the neo-Hookean law μ/2 (tr C - 3) - μ ln J + λ/2 (ln J)^2.
    """
    strain = solid_strain(law, gradient)
    trace = strain[0][0] + strain[1][1] + strain[2][2]
    if law == "neo-hookean":
        log_j = log(solid_jacobian(gradient))
        return lame.μ * trace - lame.μ * log_j + 0.5 * lame.λ * log_j * log_j
    squares = sum(strain[i][j] * strain[i][j] for i, j in product(AXES, AXES))
    return 0.5 * lame.λ * trace * trace + lame.μ * squares


def solid_stress(law: LawName, gradient: FloatArray, lame: Lame) -> FloatArray:
    """Cauchy stress of displacement gradients of shape (n, 3, 3), MPa: shape (n, 3, 3)."""
    unit, transposed = np.eye(3), gradient.transpose(0, 2, 1)
    if law == "neo-hookean":
        # μ/J (B - I) + λ ln(J)/J I with B - I = H + H^T + H H^T
        jacobian = solid_jacobian(gradient)[:, None, None]
        left = gradient + transposed + gradient @ transposed
        return np.asarray((lame.μ * left + lame.λ * np.log(jacobian) * unit) / jacobian)
    strain: FloatArray = np.moveaxis(np.array(solid_strain(law, gradient)), -1, 0)
    stress = lame.λ * np.trace(strain, axis1=1, axis2=2)[:, None, None] * unit + 2 * lame.μ * strain
    if law == "linear":
        return np.asarray(stress)
    deformation = unit + gradient
    jacobian = solid_jacobian(gradient)[:, None, None]
    return np.asarray(deformation @ stress @ deformation.transpose(0, 2, 1) / jacobian)


def solid_von_mises(stress: FloatArray) -> FloatArray:
    """Von Mises stress sqrt(3/2 s : s) with the deviator s of stresses (n, 3, 3), MPa: shape (n,)."""
    deviator = stress - np.trace(stress, axis1=1, axis2=2)[:, None, None] / 3 * np.eye(3)
    return np.asarray(np.sqrt(1.5 * np.einsum("nij,nij->n", deviator, deviator)))
