"""Identified parameters in words."""

import numpy as np

from geometry.arrays import FloatArray
from solvers.assimilation.estimation import LEVEL, Estimate

MENTIONED = 0.2
"""Least coefficient of a parameter named in a combination."""


def sentence(found: Estimate, missed: FloatArray) -> str:
    """Values and intervals, goodness of fit, and parameters that the markers do not determine.

    Args:
        found: The parameters.
        missed: Displacements of the markers, computed minus observed, shape (m, 2), mm.
    """
    parts = ["" if found.converged else "the minimum was not found: take fewer parameters or a smaller prior"]
    columns = zip(found.parameters, found.values, found.intervals, strict=True)
    parts.append(
        ", ".join(
            f"{u.name} {value:.4g} ({low:.4g} to {high:.4g}) {u.unit}".rstrip()
            for u, value, (low, high) in columns
        )
        + f", intervals of {LEVEL:.0%}"
    )
    parts.append(f"markers missed by {np.sqrt((missed**2).mean()):.2g} mm (root mean square)")
    if found.inflation > 1:
        parts.append(
            f"{found.inflation:.3g} times their standard deviations: no values of these parameters explain "
            "them, so the model is wrong elsewhere and they make up for that; intervals are as much wider"
        )
    unresolved = [
        f"{u.name} ({share:.0%})"
        for u, share, known in zip(found.parameters, found.resolution, found.resolved, strict=True)
        if not known
    ]
    if unresolved:
        parts.append(f"NOT DETERMINED by the markers, but held by its prior: {', '.join(unresolved)}")
    if len(found.parameters) > 1:
        parts.append(f"least is known of {combination(found)}")
    return "; ".join(filter(None, parts))


def combination(found: Estimate) -> str:
    """The least determined combination of parameters, in standard deviations of their priors."""
    least = found.least_determined
    direction = least * np.sign(least[np.abs(least).argmax()])
    order = np.argsort(-np.abs(direction))
    text = " ".join(
        f"{direction[i]:+.2f} {found.parameters[i].name}" for i in order if abs(direction[i]) >= MENTIONED
    )
    return f"{text.removeprefix('+')}, singular value {found.singular_values[-1]:.2g}"
