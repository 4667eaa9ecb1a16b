"""Contact, force and law in words, and as numbers for tables."""

import numpy as np
from scipy.stats import norm, t

from geometry.arrays import FloatArray
from solvers.assimilation.estimation import LEVEL, Estimate, degrees_of_freedom
from solvers.identification.fit import Fit, Identified
from solvers.solution import Estimated, IdentifiedForce

MENTIONED = 0.2
"""Least coefficient of a parameter named in a combination."""


def estimate_stats(found: Estimate) -> dict[str, float | int | str]:
    """An estimate for tables: each parameter, how well it is known, and the singular values."""
    numbers: dict[str, float | int | str] = {"evaluations": found.evaluations, "inflation": found.inflation}
    columns = zip(
        found.parameters, found.values, found.deviations, found.intervals, found.resolution, strict=True
    )
    for parameter, value, deviation, (low, high), resolution in columns:
        numbers |= {
            parameter.name: float(value),
            f"{parameter.name}_deviation": float(deviation),
            f"{parameter.name}_low": float(low),
            f"{parameter.name}_high": float(high),
            f"{parameter.name}_resolution": float(resolution),
        }
    singular = {f"singular_value_{n}": float(value) for n, value in enumerate(found.singular_values, 1)}
    return numbers | singular | {"condition": found.condition}


def estimate_sentence(found: Estimate, missed: FloatArray) -> str:
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
    return "; ".join(filter(None, [*parts, *quality(found, missed)]))


def quality(found: Estimate, missed: FloatArray) -> list[str]:
    """Goodness of fit, and what the markers do not determine, for missed displacements (m, 2), mm."""
    parts = [f"markers missed by {np.sqrt((missed**2).mean()):.2g} mm (root mean square)"]
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
    return parts


def combination(found: Estimate) -> str:
    """The least determined combination of parameters, in standard deviations of their priors."""
    least = found.least_determined
    direction = least * np.sign(least[np.abs(least).argmax()])
    order = np.argsort(-np.abs(direction))
    text = " ".join(
        f"{direction[i]:+.2f} {found.parameters[i].name}" for i in order if abs(direction[i]) >= MENTIONED
    )
    return f"{text.removeprefix('+')}, singular value {found.singular_values[-1]:.2g}"


def quantile(found: Estimate) -> float:
    """Half the interval of `LEVEL` over the standard deviation; Student's where φ was estimated."""
    upper = (1 + LEVEL) / 2
    if found.inflation == 1:
        return float(norm.ppf(upper))
    return float(t.ppf(upper, degrees_of_freedom(found.sensitivities)))


def standard_errors(found: Estimate) -> FloatArray:
    """Independent errors in the values, columns of shape (p, p), of one standard deviation each.

    They are widened where Student's interval is wider than the normal one.
    """
    slopes = [u.derivative(z) for u, z in zip(found.parameters, found.z, strict=True)]
    wider = quantile(found) / float(norm.ppf((1 + LEVEL) / 2))
    return np.asarray(wider * np.array(slopes)[:, None] * np.linalg.cholesky(found.covariance))


def force_of(fit: Fit) -> tuple[float, float]:
    """Size of the indenter's force and its standard deviation, N/mm."""
    unknowns, force = fit.markers.unknowns, fit.response.hypothesis.force
    size = float(np.linalg.norm(force))
    along = force / size if size else unknowns.directions[0]
    errors = (unknowns.force_slopes() @ along) @ standard_errors(fit.estimate)
    return size, float(np.linalg.norm(errors))


def force_interval(found: Identified) -> tuple[float, float, float]:
    """The force of the most probable law, N/mm, and its interval, which the other laws widen."""
    size, _ = force_of(found.best)
    variance = 0.0
    for fit, probability in zip(found.fits, found.probabilities, strict=True):
        own, deviation = force_of(fit)
        variance += float(probability) * (deviation**2 + (own - size) ** 2)
    half = float(norm.ppf((1 + LEVEL) / 2)) * float(np.sqrt(variance))
    return size, max(size - half, 0.0), size + half


def identified_force(found: Identified) -> IdentifiedForce:
    """Size and place of the force, with their intervals."""
    estimate = found.best.estimate
    places = [
        Estimated(float(value), float(low), float(high))
        for parameter, value, (low, high) in zip(
            estimate.parameters, estimate.values, estimate.intervals, strict=True
        )
        if parameter.name == "position"
    ]
    return IdentifiedForce(Estimated(*force_interval(found)), places[0] if places else None)


def identified_stats(found: Identified) -> dict[str, float | int | str]:
    """Everything that was found, for tables."""
    size, low, high = force_interval(found)
    numbers = estimate_stats(found.best.estimate)
    numbers |= {"law": found.best.law, "force": size, "force_low": low, "force_high": high}
    for fit, probability in zip(found.fits, found.probabilities, strict=True):
        numbers |= {f"probability {fit.law}": float(probability), f"log_evidence {fit.law}": fit.log_evidence}
    return numbers | {"doubtful_markers": len(found.doubtful)}


def identified_sentence(found: Identified, missed: FloatArray) -> str:
    """Force, place and law, goodness of fit, doubtful markers, and what is not determined.

    Args:
        found: The fits.
        missed: Displacements of the markers that were believed, computed minus observed, (m, 2), mm.
    """
    best = found.best
    size, low, high = force_interval(found)
    parts = []
    if not best.estimate.converged:
        parts.append("the minimum was not found: take fewer parameters or a smaller prior")
    elif not best.exact:
        parts.append(
            "the equilibrium was not found to the last digit, or not by the finest discretisation: the field "
            "is that of the search; take another mesh or fewer parameters"
        )
    parts.append(f"force {size:.4g} ({low:.4g} to {high:.4g}) N/mm, intervals of {LEVEL:.0%}")
    columns = zip(best.estimate.parameters, best.estimate.values, best.estimate.intervals, strict=True)
    parts.append(
        ", ".join(
            f"{u.name} {value:.4g} ({low:.4g} to {high:.4g}) {u.unit}".rstrip()
            for u, value, (low, high) in columns
        )
    )
    if len(found.fits) > 1:
        shares = zip(found.fits, found.probabilities, strict=True)
        parts.append("law " + ", ".join(f"{fit.law} {share:.1%}" for fit, share in shares) + " probable")
    for number, off in found.doubtful.items():
        far = np.linalg.norm(off)
        parts.append(f"MARKER {number + 1} of those seen CONTRADICTS the others by {far:.2g} mm: not used")
    return "; ".join(filter(None, [*parts, *quality(best.estimate, missed)]))
