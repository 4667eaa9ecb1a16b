"""The conclusions of a cross-validation in sentences."""

from collections.abc import Iterator, Mapping, Sequence

from compare.crossval.folds import ALL
from compare.crossval.result import CaseResult, CrossvalResult
from compare.crossval.scores import BASELINES, FIELD_NAMES
from compare.crossval.study import CrossvalStudy
from compare.evaluation.truths import Truth
from compare.runtime.tables import percent
from solvers.solver import Traits, with_law

NULL_MODELS = ("gp", "statfem")
OPPONENTS = (*NULL_MODELS, "fem-asm")
"""Solvers that the others are compared with, truth by truth."""


def conclusions(result: CrossvalResult) -> dict[str, list[str]]:
    """Sentences on the solvers that assimilate, by question; a question without an answer is not asked.

    With several truths the question is with which of them a solver is better.
    """
    given = [variant.label for variant in result.study.variants if Traits.of(variant.make(0)).assimilates]
    if len(result.truths) > 1:
        question = "With which truths is a solver better than the null models and fem-asm?"
        return {
            question: [
                sentence if len(result.layouts) == 1 else f"{layout}: {sentence}"
                for layout in result.layouts
                for sentence in verdict_sentences(result.of_layout(layout), result.main_scheme)
            ]
        }
    predictions, stresses = [], []
    for case, each in result.cases.items():
        scored = [label for label in given if label in each.scores]
        before = f"{case.layout}: " if case.said_among(result.cases) else ""
        predictions += [before + sentence for sentence in _predictions(each, scored)]
        stresses += [before + sentence for sentence in _stresses(each, scored)]
    found = {
        "Are held-out markers better predicted with the others than without?": predictions,
        "Do these verdicts depend on the layout of the markers?": _contrasts(result, given),
        "Is the stress better after assimilation?": stresses,
    }
    return {question: sentences for question, sentences in found.items() if sentences}


def _predictions(result: CaseResult, given: Sequence[str]) -> Iterator[str]:
    """Verdicts on each solver's held-out error against every baseline, grouped by verdict."""
    for label in given:
        for baseline, schemes in result.differences[label].items():
            verdicts: dict[str, list[str]] = {}
            for scheme, found in schemes.items():
                if "mae_sum" in found:
                    verdicts.setdefault(found["mae_sum"].verdict, []).append(scheme)
            if verdicts:
                said = "; ".join(f"{verdict} in {', '.join(names)}" for verdict, names in verdicts.items())
                yield f"{label} against {baseline}: {said}."


def _contrasts(result: CrossvalResult, given: Sequence[str]) -> list[str]:
    """Verdicts on held-out errors that differ between layouts; none if there is one layout."""
    sentences = []
    for label in given:
        for baseline in BASELINES:
            for scheme in result.schemes:
                verdicts = {
                    case.layout: verdict
                    for case, each in result.cases.items()
                    if label in each.scores and (verdict := each.verdict(label, baseline, scheme, "mae_sum"))
                }
                if len(set(verdicts.values())) > 1:
                    said = ", ".join(f"{verdict} with {layout}" for layout, verdict in verdicts.items())
                    sentences.append(f"{label} against {baseline} in {scheme}: {said}.")
    return sentences or ["No."] * (len(result.cases) > 1)


def _stresses(result: CaseResult, given: Sequence[str]) -> Iterator[str]:
    """Distances of the fields from the truth, all markers given, beside the distances of `fem`."""
    if "fem" not in result.scores or not (plain := result.scores["fem"][ALL].fields):
        return
    for label in given:
        own = result.scores[label][ALL].fields
        parts = [
            f"{words} {percent(plain[name].mean, 2)} to {percent(own[name].mean, 2)} "
            f"({result.verdict(label, 'fem', ALL, name) or 'not told apart'})"
            for name, words in FIELD_NAMES.items()
        ]
        yield f"{label}, given every marker, against fem: {', '.join(parts)} away from the truth."


def verdict_sentences(by_truth: Mapping[str, CaseResult], scheme: str) -> list[str]:
    """For each solver but the null models with which truths it is better or worse than each opponent."""
    compared = {
        "mae_sum": (scheme, "held-out error"),
        "von_mises": (ALL, "von Mises stress"),
        "force": (ALL, "force"),
    }
    sentences = []
    for label in scored_solvers(by_truth):
        for opponent in OPPONENTS if label not in NULL_MODELS else ():
            clauses: dict[str, list[str]] = {}
            for what, (at, words) in compared.items():
                verdicts: dict[str, list[str]] = {}
                for truth, each in by_truth.items():
                    if label in each.scores and (verdict := each.verdict(label, opponent, at, what)):
                        verdicts.setdefault(verdict, []).append(truth)
                if verdicts:
                    clauses.setdefault(_grouped(verdicts, len(by_truth)), []).append(words)
            if clauses:
                said = "; ".join(f"{verdict} in {', '.join(words)}" for verdict, words in clauses.items())
                sentences.append(f"{label} against {opponent}: {said}.")
    return sentences


def scored_solvers(by_truth: Mapping[str, CaseResult]) -> list[str]:
    """The solvers that have a score with some truth."""
    return list(dict.fromkeys(label for each in by_truth.values() for label in each.scores))


def _grouped(verdicts: Mapping[str, Sequence[str]], truths: int) -> str:
    """Verdicts with their truths in words, the most frequent one last if every truth has a verdict."""
    ordered = sorted(verdicts.items(), key=lambda item: len(item[1]))
    named = {verdict: f"with {' '.join(names)}" for verdict, names in ordered}
    if sum(map(len, verdicts.values())) == truths:
        named[ordered[-1][0]] = "with the others" if len(ordered) > 1 else "with every truth"
    return ", ".join(f"{verdict} {names}" for verdict, names in named.items())


def shared_sentence(study: CrossvalStudy, truth: Truth) -> str:
    """Law, walls and load that the solvers of a study share with a truth, in words."""
    stroke = -float(study.load.displacement[1] or 0.0)
    true, parts = truth.material(study.material), []
    alike, found = [], []
    for variant in study.variants:
        solver = variant.make(0)
        own = with_law(study.material, solver)
        if variant.settings.get("law") == "evidence" and true.law in solver.laws:
            found.append(variant.label)
        elif (own.law, own.poisson) == (true.law, true.poisson):
            alike.append(variant.label)
    if alike:
        parts.append(f"same law as {', '.join(alike)}")
    if found:
        parts.append(f"law among those of {', '.join(found)}")
    if truth.keeps_walls:
        parts.append("walls as drawn")
    if truth.load(stroke) == study.load:
        parts.append("same load as every solver")
    if truth.solid:
        parts.append("in three dimensions")
    return f"{truth.name}: {', '.join(parts) or 'other law, walls and load than every solver'}"
