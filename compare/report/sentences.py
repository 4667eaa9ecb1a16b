"""Sentences of the report: the certificate of a result, and the effect of the markers on the stress."""

from compare.evaluation.certificate import Certificate
from compare.evaluation.certification import REGIONS
from compare.evaluation.comparison import Comparison
from compare.evaluation.evaluation import Evaluation
from compare.evaluation.metrics import force_error, truth_differences
from compare.runtime.tables import distance, percent


def certificate_sentences(evaluation: Evaluation, load: str = "mean") -> str:
    """Sentences on the certificate of a result under a kind of load, or the reason why there is none."""
    label, certificate = evaluation.label, evaluation.certificate
    if evaluation.law != "linear":
        return f"{label} has no certificate: there is one for the linear law only."
    if evaluation.in_sample:
        return f"{label} has no certificate: it pays energy for the markers that it was given."
    if evaluation.solid:
        return f"{label} has no certificate: the least energy of the plane says nothing of three dimensions."
    if load == "cylinder":
        return f"{label} has no certificate: the least energy is that of a contact that is given, not found."
    if certificate is None:
        reason = "DOLFINx, which makes it, is not installed" if evaluation.finite else "it is not finite"
        return f"{label} has no certificate: {reason}."
    if not certificate.has_excess and not certificate.faults:
        return f"{label} is the finite-element solution itself: nothing is left out of balance."
    excess, residual = percent(certificate.rel_excess), percent(certificate.weak_residual)
    verdict = f"is converged to {excess} of the energy" if evaluation.converged else "is not to be relied on"
    base, contact = distance(certificate.base), distance(certificate.off_at_contact)
    sentences = [
        f"{label} {verdict}: its displacement, taken over to the elements of fem, has {excess} more energy "
        "than the least with the same values at base and contact, and its own stress is out of balance by "
        f"{residual} in the energy norm.",
        _where(certificate),
        f"At the base it is off by at most {base} mm, at the contact by {contact} mm.",
        _reported(certificate),
    ]
    return " ".join(filter(None, sentences))


def _where(certificate: Certificate) -> str:
    if not certificate.has_excess:
        return ""
    name, region = max(certificate.regions.items(), key=lambda item: item[1].excess)
    return f"{percent(region.excess)} of the excess sits {REGIONS[name]}, {percent(region.area)} of the area."


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


def truth_sentences(comparison: Comparison) -> list[str]:
    """Sentences on the change that given markers make to displacement and stress, against the reference.

    Empty without a truth, without such a solver, or if the reference was given the markers too.
    """
    reference, truth = comparison.reference, comparison.truth
    given = [evaluation for evaluation in comparison.evaluations if evaluation.in_sample]
    if truth is None or reference.in_sample or not given:
        return []
    label, plain = reference.label, _distances(reference, truth)
    found = {evaluation.label: _distances(evaluation, truth) for evaluation in given}
    sizes = ", ".join(f"{field} {percent(before)}" for field, before in plain.items())
    sentences = [f"{label}, which was given none: {sizes} away from the simulated finger."]
    for name, own in found.items():
        changes = [
            f"{field} {percent(own[field])} ({'nearer' if own[field] < before else 'farther'})"
            for field, before in plain.items()
        ]
        sentences.append(f"{name}, given the markers: {', '.join(changes)}.")
    nearer = {
        field: ", ".join(name for name, own in found.items() if own[field] < before) or "none"
        for field, before in plain.items()
    }
    answer = f"Nearer than {label} in displacement: {nearer['displacement']}. "
    answer += f"Nearer in von Mises stress: {nearer['von Mises stress']}. "
    return [*sentences, f"{answer}Nearer in the indenter's force: {nearer['force']}."]


def _distances(evaluation: Evaluation, truth: Evaluation) -> dict[str, float]:
    """Relative L2 distances from the truth by field, and the relative error of the force."""
    differences = truth_differences(evaluation, truth)
    return {
        "displacement": differences.displacement.rel_l2,
        "von Mises stress": differences.von_mises.rel_l2,
        "force": abs(force_error(evaluation, truth)),
    }
