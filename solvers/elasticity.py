"""Constitutive laws for NumPy arrays, torch tensors and UFL expressions alike.

Every function takes the displacement gradient `H[..., i, j] = du_i/dx_j` and uses only arithmetic and
indexing on it. Linear elasticity is Hooke's law for the plane states (Timoshenko and Goodier, Theory of
Elasticity, 3rd ed., chapter 2). The finite-strain laws are in plane strain: compressible neo-Hookean and
St Venant-Kirchhoff (Bonet and Wood, Nonlinear Continuum Mechanics for Finite Element Analysis, 2nd ed.,
section 6.4.3 and chapter 6), and A. N. Gent's (Rubber Chem. Technol. 69 (1996) 59-61), which stiffens as
chains are stretched out, with the volumetric part of the neo-Hookean.
"""

from collections.abc import Callable
from typing import Any, Literal, NamedTuple

LawName = Literal["linear", "neo-hookean", "st-venant-kirchhoff", "gent"]

LIMIT = 1.0
"""Value of tr C - 3 - 2 ln J that Gent's law cannot reach: of much filler; gum has 30 to 100.

The stiffness has grown by a third where it is a quarter, at a stretch of about 1.3.
"""

Field = Any
"""A NumPy array, a torch tensor or a UFL expression."""


class Lame(NamedTuple):
    """Lamé constants of a plane problem, MPa.

    Attributes:
        λ: First constant as it stands in the plane law; in plane stress the reduced one, 2 λ μ / (λ + 2 μ).
        μ: Shear modulus.
        λ_out: sigma_zz over the trace of the in-plane strain: λ in plane strain, 0 in plane stress.
    """

    λ: float
    μ: float
    λ_out: float


class PlaneTensor(NamedTuple):
    """Components of a symmetric tensor of a plane state."""

    xx: Field
    yy: Field
    xy: Field
    zz: Field


def lame_constants(young: float, poisson: float, plane: str) -> Lame:
    """Lamé constants from Young's modulus (MPa) and Poisson's ratio for plane "strain" or "stress"."""
    μ = young / (2 * (1 + poisson))
    if plane == "stress":
        return Lame(λ=young * poisson / ((1 + poisson) * (1 - poisson)), μ=μ, λ_out=0.0)
    λ = young * poisson / ((1 + poisson) * (1 - 2 * poisson))
    return Lame(λ=λ, μ=μ, λ_out=λ)


def lame_derivatives(young: float, poisson: float, plane: str) -> Lame:
    """Derivatives of the Lamé constants by Poisson's ratio, MPa; λ_out's is λ's, or 0 in plane stress."""
    μ = -young / (2 * (1 + poisson) ** 2)
    if plane == "stress":
        return Lame(λ=young * (1 + poisson**2) / (1 - poisson**2) ** 2, μ=μ, λ_out=0.0)
    λ = young * (1 + 2 * poisson**2) / ((1 + poisson) * (1 - 2 * poisson)) ** 2
    return Lame(λ=λ, μ=μ, λ_out=λ)


def small_strain(gradient: Field, lame: Lame) -> PlaneTensor:
    """Infinitesimal strain, tensor components (the shear is half the engineering shear)."""
    xx, yy = gradient[..., 0, 0], gradient[..., 1, 1]
    xy = 0.5 * (gradient[..., 0, 1] + gradient[..., 1, 0])
    # Plane stress: sigma_zz = 0 fixes eps_zz; there the reduced λ = 2 λ3 μ/(λ3 + 2 μ) gives eps_zz = -λ/(2 μ)
    # (xx + yy).
    zz = 0 * xx if lame.λ_out else (-lame.λ / (2 * lame.μ)) * (xx + yy)
    return PlaneTensor(xx, yy, xy, zz)


def linear_energy_density(gradient: Field, lame: Lame) -> Field:
    """Strain energy density 1/2 sigma : eps, MPa (= N mm / mm^3)."""
    return _quadratic_energy_density(small_strain(gradient, lame), lame)


def linear_stress(gradient: Field, lame: Lame) -> PlaneTensor:
    """Cauchy stress of Hooke's law, MPa."""
    strain = small_strain(gradient, lame)
    trace = strain.xx + strain.yy
    return PlaneTensor(
        xx=lame.λ * trace + 2 * lame.μ * strain.xx,
        yy=lame.λ * trace + 2 * lame.μ * strain.yy,
        xy=2 * lame.μ * strain.xy,
        zz=lame.λ_out * trace,
    )


def deformation_jacobian(gradient: Field) -> Field:
    """J = det(I + H); positive unless the material is turned inside out."""
    return (1 + gradient[..., 0, 0]) * (1 + gradient[..., 1, 1]) - gradient[..., 0, 1] * gradient[..., 1, 0]


def green_lagrange_strain(gradient: Field) -> PlaneTensor:
    """E = (F^T F - I) / 2 of a plane-strain deformation."""
    a, b, c, d = gradient[..., 0, 0], gradient[..., 0, 1], gradient[..., 1, 0], gradient[..., 1, 1]
    return PlaneTensor(
        xx=a + 0.5 * (a * a + c * c),
        yy=d + 0.5 * (b * b + d * d),
        xy=0.5 * (b + c + a * b + c * d),
        zz=0 * a,
    )


def neo_hookean_energy_density(gradient: Field, lame: Lame, log: Callable[[Field], Field]) -> Field:
    """ψ = μ/2 (tr C - 3) - μ ln J + λ/2 (ln J)^2 per reference volume, MPa."""
    strain = green_lagrange_strain(gradient)
    log_j = log(deformation_jacobian(gradient))
    return lame.μ * (strain.xx + strain.yy) - lame.μ * log_j + 0.5 * lame.λ * log_j * log_j


def neo_hookean_stress(gradient: Field, lame: Lame, log: Callable[[Field], Field]) -> PlaneTensor:
    """Cauchy stress μ/J (B - I) + λ ln(J)/J I, MPa, with B = F F^T."""
    a, b, c, d = gradient[..., 0, 0], gradient[..., 0, 1], gradient[..., 1, 0], gradient[..., 1, 1]
    jacobian = deformation_jacobian(gradient)
    pressure = lame.λ * log(jacobian) / jacobian
    return PlaneTensor(
        xx=lame.μ / jacobian * (2 * a + a * a + b * b) + pressure,
        yy=lame.μ / jacobian * (2 * d + c * c + d * d) + pressure,
        xy=lame.μ / jacobian * (b + c + a * c + b * d),
        zz=pressure,
    )


def _stretched(gradient: Field, log: Callable[[Field], Field]) -> Field:
    """Tr C - 3 - 2 ln J: zero at rest, with its derivative."""
    strain = green_lagrange_strain(gradient)
    return 2 * (strain.xx + strain.yy) - 2 * log(deformation_jacobian(gradient))


def gent_energy_density(gradient: Field, lame: Lame, log: Callable[[Field], Field]) -> Field:
    """ψ = -μ/2 I_m ln(1 - (tr C - 3 - 2 ln J) / I_m) + λ/2 (ln J)^2 per reference volume, MPa."""
    log_j = log(deformation_jacobian(gradient))
    left = log(1 - _stretched(gradient, log) / LIMIT)
    return -0.5 * lame.μ * LIMIT * left + 0.5 * lame.λ * log_j * log_j


def gent_stress(gradient: Field, lame: Lame, log: Callable[[Field], Field]) -> PlaneTensor:
    """Cauchy stress, MPa: neo-Hookean with μ over 1 - (tr C - 3 - 2 ln J) / I_m in the place of μ."""
    stiffened = lame.μ / (1 - _stretched(gradient, log) / LIMIT)
    return neo_hookean_stress(gradient, lame._replace(μ=stiffened), log)


def _quadratic_energy_density(strain: PlaneTensor, lame: Lame) -> Field:
    """λ/2 (tr ε)^2 + μ ε : ε of an in-plane strain ε, MPa."""
    trace = strain.xx + strain.yy
    squares = strain.xx * strain.xx + strain.yy * strain.yy + 2 * strain.xy * strain.xy
    return 0.5 * lame.λ * trace * trace + lame.μ * squares


def st_venant_kirchhoff_stress(gradient: Field, lame: Lame) -> PlaneTensor:
    """Cauchy stress F S F^T / J, MPa, of the second Piola-Kirchhoff stress S = λ tr(E) I + 2 μ E."""
    a, b, c, d = 1 + gradient[..., 0, 0], gradient[..., 0, 1], gradient[..., 1, 0], 1 + gradient[..., 1, 1]
    strain, jacobian = green_lagrange_strain(gradient), deformation_jacobian(gradient)
    trace = lame.λ * (strain.xx + strain.yy)
    xx, yy, xy = trace + 2 * lame.μ * strain.xx, trace + 2 * lame.μ * strain.yy, 2 * lame.μ * strain.xy
    return PlaneTensor(
        xx=(a * a * xx + 2 * a * b * xy + b * b * yy) / jacobian,
        yy=(c * c * xx + 2 * c * d * xy + d * d * yy) / jacobian,
        xy=(a * c * xx + (a * d + b * c) * xy + b * d * yy) / jacobian,
        zz=trace / jacobian,
    )


def strain_of(law: LawName, gradient: Field, lame: Lame) -> PlaneTensor:
    """The strain of a law: infinitesimal for the linear one, else Green-Lagrange."""
    return small_strain(gradient, lame) if law == "linear" else green_lagrange_strain(gradient)


def energy_density_of(law: LawName, gradient: Field, lame: Lame, log: Callable[[Field], Field]) -> Field:
    """Strain energy of a law per reference volume, MPa; `log` is the library's logarithm.

    St Venant-Kirchhoff: ψ = λ/2 (tr E)^2 + μ E : E with the Green-Lagrange strain E; it stays finite as J tends
    to zero, and so is unsuitable for strong compression.
    """
    if law == "neo-hookean":
        return neo_hookean_energy_density(gradient, lame, log)
    if law == "gent":
        return gent_energy_density(gradient, lame, log)
    return _quadratic_energy_density(strain_of(law, gradient, lame), lame)


def stress_of(law: LawName, gradient: Field, lame: Lame, log: Callable[[Field], Field]) -> PlaneTensor:
    """Cauchy stress of a law, MPa; `log` is the library's logarithm."""
    if law == "linear":
        return linear_stress(gradient, lame)
    if law == "st-venant-kirchhoff":
        return st_venant_kirchhoff_stress(gradient, lame)
    if law == "gent":
        return gent_stress(gradient, lame, log)
    return neo_hookean_stress(gradient, lame, log)


def von_mises(stress: PlaneTensor, sqrt: Callable[[Field], Field]) -> Field:
    """Von Mises stress, MPa, with the out-of-plane stress that plane strain needs."""
    xx, yy, xy, zz = stress
    return sqrt(0.5 * ((xx - yy) * (xx - yy) + (yy - zz) * (yy - zz) + (zz - xx) * (zz - xx)) + 3 * xy * xy)
