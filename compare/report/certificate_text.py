"""The certificate in words."""

from compare.evaluation.certificate import Certificate
from compare.evaluation.convergence import CERTIFIED_LAW
from compare.evaluation.evaluation import Evaluation
from compare.evaluation.labels import solver_label
from compare.evaluation.number_format import distance, percent
from compare.evaluation.regions import REGIONS


def certificate_sentences(evaluation: Evaluation) -> str:
    """Sentences on the certificate of a result, or the reason why there is none."""
    label, certificate = solver_label(evaluation), evaluation.certificate
    if evaluation.law != CERTIFIED_LAW:
        return f"{label} has no certificate: there is one for the {CERTIFIED_LAW} law only."
    if evaluation.in_sample:
        return f"{label} has no certificate: it pays energy for the markers that it was given."
    if certificate is None:
        reason = "DOLFINx, which makes it, is not installed" if evaluation.finite else "it is not finite"
        return f"{label} has no certificate: {reason}."
    if not certificate.has_excess and not certificate.faults:
        return f"{label} is the finite-element solution itself: nothing is left out of balance."
    sentences = [_verdict(label, evaluation.converged, certificate), _where(certificate)]
    sentences += [_conditions(certificate), _reported(certificate)]
    return " ".join(filter(None, sentences))


def _verdict(label: str, converged: bool, certificate: Certificate) -> str:
    excess, residual = percent(certificate.rel_excess), percent(certificate.weak_residual)
    verdict = f"is converged to {excess} of the energy" if converged else "is not to be relied on"
    return (
        f"{label} {verdict}: its displacement, taken over to the elements of fem, has {excess} more energy "
        "than the least with the same values at base and contact, and its own stress is out of balance by "
        f"{residual} in the energy norm."
    )


def _where(certificate: Certificate) -> str:
    if not certificate.has_excess:
        return ""
    name, region = max(certificate.regions.items(), key=lambda item: item[1].excess)
    return f"{percent(region.excess)} of the excess sits {REGIONS[name]}, {percent(region.area)} of the area."


def _conditions(certificate: Certificate) -> str:
    base, contact = distance(certificate.base), distance(certificate.off_at_contact)
    return f"At the base it is off by at most {base} mm, at the contact by {contact} mm."


def _reported(certificate: Certificate) -> str:
    missed = certificate.missed / certificate.fem_energy
    if missed <= 0 or not certificate.has_excess:
        return ""
    reason = (
        "its quadrature misses energy"
        if certificate.misses_energy
        else "it is nearer to the exact solution than fem on this mesh, or its quadrature misses a little"
    )
    return f"It reports {percent(missed)} less energy than that least: {reason}."
