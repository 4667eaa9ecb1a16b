"""What a cross-validation answers, in words."""

from collections.abc import Mapping

from compare.crossval.folds import ALL
from compare.crossval.result import CrossvalResult
from compare.crossval.tables import has_fields
from compare.evaluation.number_format import percent
from solvers.assimilation.misfit import assimilates

NAMES = {"displacement": "displacement", "strain": "strain", "von_mises": "von Mises stress"}
"""Of the fields, for people."""


def answers(result: CrossvalResult) -> Mapping[str, list[str]]:
    """Sentences on solvers that were given markers, by question; questions that have an answer."""
    found = {
        "Are held-out markers better predicted with the others than without?": _predictions(result),
        "Is the stress better after assimilation?": _stresses(result),
    }
    return {question: sentences for question, sentences in found.items() if sentences}


def _given(result: CrossvalResult) -> list[str]:
    given = {entry.label for entry in result.study.variants if assimilates(entry.make(0))}
    return [label for label in result.scores if label in given]


def _predictions(result: CrossvalResult) -> list[str]:
    """Where each solver's held-out error is below that of every baseline, and where it is not."""
    sentences = []
    for label in _given(result):
        for baseline, schemes in result.differences[label].items():
            verdicts = {
                scheme: found["mae_sum"].verdict for scheme, found in schemes.items() if "mae_sum" in found
            }
            if verdicts:
                sentences.append(f"{label} against {baseline}: {_grouped(verdicts)}.")
    return sentences


def _grouped(verdicts: Mapping[str, str]) -> str:
    """`better in one-out and random; worse in tip-out`."""
    having: dict[str, list[str]] = {}
    for scheme, verdict in verdicts.items():
        having.setdefault(verdict, []).append(scheme)
    return "; ".join(f"{verdict} in {', '.join(schemes)}" for verdict, schemes in having.items())


def _stresses(result: CrossvalResult) -> list[str]:
    """Distances of the fields from the truth, all markers given, beside those of `fem`."""
    if not has_fields(result) or "fem" not in result.scores:
        return []
    plain = result.scores["fem"][ALL].fields
    sentences = []
    for label in _given(result):
        own = result.scores[label][ALL].fields
        parts = []
        for name, words in NAMES.items():
            verdict = result.differences[label]["fem"][ALL].get(name)
            said = verdict.verdict if verdict else "not told apart"
            parts.append(f"{words} {percent(plain[name].mean, 2)} to {percent(own[name].mean, 2)} ({said})")
        sentences.append(f"{label}, given every marker, against fem: {', '.join(parts)} away from the truth.")
    return sentences
