"""The conclusions of a cross-validation in sentences, by question."""

from collections.abc import Mapping

from compare.crossval.folds import ALL
from compare.crossval.result import BASELINES, CrossvalResult, LayoutResult
from compare.crossval.scores import FIELD_NAMES
from compare.crossval.truth_summary import held_out_scheme, verdict_sentences
from compare.runtime.tables import percent
from solvers.solver import Traits


def answers(result: CrossvalResult) -> Mapping[str, list[str]]:
    """Sentences on the solvers that assimilate, by question; questions without an answer are left out.

    With several truths the questions are about what holds with which of them.
    """
    given = [variant.label for variant in result.study.variants if Traits.of(variant.make(0)).assimilates]
    if len(result.truths) > 1:
        question = "With which truths is a solver better than the null models and fem-asm?"
        return {question: _by_truth(result)}
    found: dict[str, list[str]] = {
        "Are held-out markers better predicted with the others than without?": [],
        "Do these verdicts depend on the layout of the markers?": _contrasts(result, given),
        "Is the stress better after assimilation?": [],
    }
    predictions, _, stresses = found.values()
    for case, each in result.cases.items():
        scored = [label for label in given if label in each.scores]
        before = f"{case.layout}: " if case.said_among(result.cases) else ""
        predictions += [before + sentence for sentence in _predictions(each, scored)]
        stresses += [before + sentence for sentence in _stresses(each, scored)]
    return {question: sentences for question, sentences in found.items() if sentences}


def _by_truth(result: CrossvalResult) -> list[str]:
    """The verdicts of every solver by truth, for each layout."""
    layouts = list(dict.fromkeys(case.layout for case in result.cases))
    return [
        sentence if len(layouts) == 1 else f"{layout}: {sentence}"
        for layout in layouts
        for sentence in verdict_sentences(result.of_layout(layout), held_out_scheme(result))
    ]


def _predictions(result: LayoutResult, given: list[str]) -> list[str]:
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


def _contrasts(result: CrossvalResult, given: list[str]) -> list[str]:
    """Verdicts on held-out errors that are not the same with every layout; none if there is one layout."""
    sentences = []
    for label in given:
        for baseline in BASELINES:
            for scheme in result.schemes:
                verdicts = {
                    case.layout: found.verdict
                    for case, each in result.cases.items()
                    if label in each.scores
                    and (found := each.difference(label, baseline, scheme, "mae_sum")) is not None
                }
                if len(set(verdicts.values())) > 1:
                    said = ", ".join(f"{verdict} with {layout}" for layout, verdict in verdicts.items())
                    sentences.append(f"{label} against {baseline} in {scheme}: {said}.")
    return sentences or ["No."] * (len(result.cases) > 1)


def _stresses(result: LayoutResult, given: list[str]) -> list[str]:
    """Distances of the fields from the truth, all markers given, beside those of `fem`."""
    if "fem" not in result.scores or not (plain := result.scores["fem"][ALL].fields):
        return []
    sentences = []
    for label in given:
        own = result.scores[label][ALL].fields
        parts = []
        for name, words in FIELD_NAMES.items():
            difference = result.difference(label, "fem", ALL, name)
            said = difference.verdict if difference else "not told apart"
            parts.append(f"{words} {percent(plain[name].mean, 2)} to {percent(own[name].mean, 2)} ({said})")
        sentences.append(f"{label}, given every marker, against fem: {', '.join(parts)} away from the truth.")
    return sentences
