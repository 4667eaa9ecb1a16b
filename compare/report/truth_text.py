"""Sentences on the stress of solvers that were given the markers, by the truth of the simulation."""

from compare.evaluation.comparison import Comparison
from compare.evaluation.labels import solver_label
from compare.evaluation.metrics import TruthDifferences, truth_differences
from compare.evaluation.number_format import percent


def truth_sentences(comparison: Comparison) -> list[str]:
    """Sentences on the change that given markers make to displacement and stress, against the reference.

    Empty without a truth, without such a solver, or if the reference was given the markers too.
    """
    reference, truth = comparison.reference, comparison.truth
    given = [evaluation for evaluation in comparison.evaluations if evaluation.in_sample]
    if truth is None or reference.in_sample or not given:
        return []
    plain, label = truth_differences(reference, truth), solver_label(reference)
    found = {solver_label(evaluation): truth_differences(evaluation, truth) for evaluation in given}
    sentences = [f"{name}, given the markers: {_changes(plain, own)}." for name, own in found.items()]
    return [
        f"{label}, which was given none: {_sizes(plain)} away from the simulated finger.",
        *sentences,
        f"Nearer than {label} in displacement: {_nearer('displacement', plain, found)}. Nearer in von Mises "
        f"stress: {_nearer('von_mises', plain, found)}.",
    ]


def _sizes(differences: TruthDifferences) -> str:
    return (
        f"displacement {percent(differences.displacement.rel_l2)}, "
        f"von Mises stress {percent(differences.von_mises.rel_l2)}"
    )


def _changes(plain: TruthDifferences, own: TruthDifferences) -> str:
    words = []
    for name, title in (("displacement", "displacement"), ("von_mises", "von Mises stress")):
        before, after = getattr(plain, name).rel_l2, getattr(own, name).rel_l2
        words.append(f"{title} {percent(after)} ({'nearer' if after < before else 'farther'})")
    return ", ".join(words)


def _nearer(field: str, plain: TruthDifferences, found: dict[str, TruthDifferences]) -> str:
    limit = getattr(plain, field).rel_l2
    names = [name for name, own in found.items() if getattr(own, field).rel_l2 < limit]
    return ", ".join(names) or "none"
