"""Warning where linear triangles lock: nearly incompressible material in plane strain."""

from solvers.elasticity import lame_constants
from solvers.problem import Material

ONSET = 0.4
"""Poisson's ratio up to which the energy error of linear elements is within a fifth of that at 0.3."""

GROWTH = 0.09
"""Growth of the energy error of linear elements with λ/μ, as a fraction of that at Poisson's ratio 0.3.

Measured on the fingers `default` and `slender` with elements of 1, 0.5 and 0.25 mm: 0.06 to 0.11 up to 0.49.
"""

MOST = 5.0
"""Largest factor stated: beyond Poisson's ratio 0.49 the elements hardly move, and the error grows less."""


def locking_advice(degree: int, material: Material) -> str:
    """A clause for the status of a solution: empty where elements of that degree do not lock.

    Every linear triangle has to keep its volume, and there are more of them than nodes: they are too stiff
    (T. J. R. Hughes, The Finite Element Method, Prentice-Hall, 1987, chapter 4).
    """
    if degree > 1 or material.plane == "stress" or material.poisson <= ONSET:
        return ""
    factor = locking_factor(material.poisson)
    times = f"more than {MOST:g}" if factor > MOST else f"about {factor:.1f}"
    return (
        f"linear elements lock in plane strain at Poisson's ratio {material.poisson:g}: "
        f"their energy is {times} times as far off as at 0.3; take degree=2"
    )


def locking_factor(poisson: float) -> float:
    """Error of linear elements in energy in plane strain, over that at Poisson's ratio 0.3."""
    ratio, usual = (lame.λ / lame.μ for lame in (lame_constants(1.0, ν, "strain") for ν in (poisson, 0.3)))
    return float(1 + GROWTH * (ratio - usual))
