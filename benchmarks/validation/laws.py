"""Strain energies of `fem-nonlinear` in three dimensions, with a pressure p as a second unknown.

Where p is stationary, p = λ ln J or p = λ tr E, these are the laws of `solvers.elasticity`. With p of its own
elements an energy is finite for ν towards 1/2 and does not lock.

Source: J. Bonet, R. D. Wood, Nonlinear Continuum Mechanics for Finite Element Analysis, 2nd edition,
Cambridge University Press, 2008, section 6.4.
"""

from collections.abc import Callable
from typing import Any

import ufl

Law = Callable[[Any, Any, Any, Any], Any]


def neo_hookean(F: Any, p: Any, λ: Any, μ: Any) -> Any:
    """μ/2 (tr C - 3) - μ ln J + p ln J - p²/2λ per volume at rest, MPa, of a deformation gradient in UFL."""
    log_j = ufl.ln(ufl.det(F))
    return μ / 2 * (ufl.inner(F, F) - 3) + (p - μ) * log_j - p**2 / (2 * λ)


def st_venant_kirchhoff(F: Any, p: Any, λ: Any, μ: Any) -> Any:
    """μ E:E + p tr E - p²/2λ per volume at rest, MPa, with Green's strain E = (F^T F - I)/2."""
    strain = (F.T * F - ufl.Identity(3)) / 2
    return μ * ufl.inner(strain, strain) + p * ufl.tr(strain) - p**2 / (2 * λ)


LAWS: dict[str, Law] = {"neo-hookean": neo_hookean, "st-venant-kirchhoff": st_venant_kirchhoff}
