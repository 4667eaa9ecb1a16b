"""The two questions of a cross-validation, answered in sentences."""

from collections.abc import Mapping

from compare.crossval.folds import ALL
from compare.crossval.result import CrossvalResult
from compare.evaluation.number_format import percent
from solvers.assimilation.misfit import assimilates

NAMES = {"displacement": "displacement", "strain": "strain", "von_mises": "von Mises stress"}
"""Names of the fields in sentences."""


def answers(result: CrossvalResult) -> Mapping[str, list[str]]:
    """Sentences on the solvers that assimilate, by question; questions without an answer are left out."""
    given = [
        variant.label
        for variant in result.study.variants
        if variant.label in result.scores and assimilates(variant.make(0))
    ]
    found = {
        "Are held-out markers better predicted with the others than without?": _predictions(result, given),
        "Is the stress better after assimilation?": _stresses(result, given),
    }
    return {question: sentences for question, sentences in found.items() if sentences}


def _predictions(result: CrossvalResult, given: list[str]) -> list[str]:
    """Verdicts on each solver's held-out error against every baseline, grouped by verdict."""
    sentences = []
    for label in given:
        for baseline, schemes in result.differences[label].items():
            verdicts: dict[str, list[str]] = {}
            for scheme, found in schemes.items():
                if "mae_sum" in found:
                    verdicts.setdefault(found["mae_sum"].verdict, []).append(scheme)
            if verdicts:
                said = "; ".join(f"{verdict} in {', '.join(names)}" for verdict, names in verdicts.items())
                sentences.append(f"{label} against {baseline}: {said}.")
    return sentences


def _stresses(result: CrossvalResult, given: list[str]) -> list[str]:
    """Distances of the fields from the truth, all markers given, beside those of `fem`."""
    if not result.has_fields or "fem" not in result.scores:
        return []
    plain = result.scores["fem"][ALL].fields
    sentences = []
    for label in given:
        own = result.scores[label][ALL].fields
        parts = []
        for name, words in NAMES.items():
            difference = result.difference(label, "fem", ALL, name)
            said = difference.verdict if difference else "not told apart"
            parts.append(f"{words} {percent(plain[name].mean, 2)} to {percent(own[name].mean, 2)} ({said})")
        sentences.append(f"{label}, given every marker, against fem: {', '.join(parts)} away from the truth.")
    return sentences
