"""A cross-validation as tables for the terminal and the report, and its conclusions in sentences."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from math import isnan

from rich.table import Table
from rich.text import Text

from pinnray.comparison.crossval.folds import ALL, SCHEMES
from pinnray.comparison.crossval.result import CaseResult, CrossvalResult
from pinnray.comparison.crossval.scores import BASELINES, FIELD_NAMES, FIELDS, LEVEL, ScoreInterval
from pinnray.comparison.crossval.study import CrossvalStudy
from pinnray.comparison.evaluation.truths import Truth
from pinnray.runtime.tables import NONE, TextTable, distance, percent, significant, terminal_table
from pinnray.solvers.solver import Traits, with_law

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


CAPTION = (
    "Given: in-sample, at markers that were given. Held out: at markers that were not. sum: mean of "
    "|Δu| + |Δv|; rss: √(u² + v²) of the two means. ±: Student's interval of the sum over seeds, which "
    "differ in noise alone. vs: whether the sum is better or worse, by a bootstrap over folds and seeds; "
    "≈: not told apart. Within: share of held-out errors within the interval of "
    f"{LEVEL:.0%} that the solver states."
)


def all_tables(result: CrossvalResult) -> list[TextTable]:
    """Solvers by truths, one table of the markers for each scheme, and one of the fields."""
    held = [scheme for scheme in result.schemes if scheme != ALL]
    vs = [f"vs\n{baseline}" for baseline in ("fem", "gp")]
    headings = ["solver", "given\nsum", "held\nout u", "v", "sum", "±", "rss", *vs, "with-\nin"]
    tables = list(truth_tables(result)) if result.study.chosen_truths else []
    for scheme in held:
        title = f"{scheme}: {SCHEMES[scheme]}; {result.study.label} markers, mm"
        rows = _by_case(result, _marker_row, [scheme])
        tables.append(TextTable(title, headings, rows, CAPTION if scheme == held[-1] else ""))
    return [*tables, _field_table(result)] if result.has_fields else tables


def terminal_tables(result: CrossvalResult) -> list[Table | Text]:
    """The tables and their captions; with several truths only the tables of solvers by truths."""
    left = ("solver", "held out", "truth", "layout")
    shown: list[Table | Text] = []
    for table in truth_tables(result) if len(result.truths) > 1 else all_tables(result):
        shown.append(terminal_table(table.title, table.headings, table.rows, left=left, narrow=True))
        if table.caption:  # apart from the table, which may be much narrower than the terminal
            shown.append(Text(f"{table.caption}\n", style="table.caption"))
    return shown


def _by_case(
    result: CrossvalResult, row: Callable[[CaseResult, str, str], list[str]], schemes: Sequence[str]
) -> list[list[str]]:
    """The rows of all solvers in all schemes; truths and layouts are named above their rows if several."""
    rows: list[list[str]] = []
    for case, each in result.cases.items():
        own = [row(each, label, scheme) for scheme in schemes for label in each.scores]
        if said := case.said_among(result.cases):
            rows.append([said if len(result.truths) > 1 else f"markers: {said}", *[""] * (len(own[0]) - 1)])
        rows += own
    return rows


def _marker_row(result: CaseResult, label: str, scheme: str) -> list[str]:
    score = result.scores[label][scheme]
    held, total = score.held_out, score.held_out.get("mae_sum")
    return [
        label,
        _mm(score.in_sample.get("mae_sum")),
        *(_mm(held.get(name)) for name in ("mae_u", "mae_v", "mae_sum")),
        NONE if total is None or isnan(total.high) else significant(total.high - total.mean, 1),
        _mm(held.get("mae_rss")),
        *(_verdict(result, label, baseline, scheme, "mae_sum") for baseline in ("fem", "gp")),
        NONE if score.coverage is None else f"{100 * score.coverage:.0f} %",
    ]


def _mm(interval: ScoreInterval | None) -> str:
    return NONE if interval is None else f"{interval.mean:.3f}"


def _verdict(result: CaseResult, label: str, baseline: str, scheme: str, what: str) -> str:
    verdict = result.verdict(label, baseline, scheme, what)
    return {"": NONE, "not told apart": "≈"}.get(verdict, verdict)


def _field_table(result: CrossvalResult) -> TextTable:
    """Relative L2 distances from the truth, a row for each scheme and solver."""
    vs = "vs\nfem"
    return TextTable(
        "Relative L2 distance from the truth over the body, %",
        ["solver", "held out", "displ.", vs, "strain", vs, "v.\nMises", vs, "truth's\nlaw"],
        _by_case(result, _field_row, result.schemes),
        f"{ALL}: {SCHEMES[ALL]}. Strain: of the solver's own law, Green-Lagrange for finite strain. Truth's "
        "law: the von Mises stress that the law of the truth gives for the solver's displacement gradient. "
        "vs fem: better or worse, by a bootstrap over folds and seeds; ≈: not told apart.",
    )


def _field_row(result: CaseResult, label: str, scheme: str) -> list[str]:
    fields = result.scores[label][scheme].fields
    *values, last = [percent(fields[name].mean, 2, sign=False) for name in FIELDS]
    verdicts = [_verdict(result, label, "fem", scheme, name) for name in FIELDS[:-1]]
    pairs = [text for pair in zip(values, verdicts, strict=True) for text in pair]
    return [label, scheme, *pairs, last]


def truth_tables(result: CrossvalResult) -> Iterator[TextTable]:
    """Tables of solvers by truths for each layout, as many as fit the truths into the width of a terminal."""
    scheme, study = result.main_scheme, result.study
    shared = "; ".join(shared_sentence(study, truth) for truth in study.chosen_truths.values())
    simulations = ", ".join(dict.fromkeys(truth.simulation for truth in study.chosen_truths.values()))
    caption = (
        "Held-out error: mean |Δu| + |Δv|. Every marker given: relative L2 distance of the von Mises stress "
        "over the body, at points that move with the walls, and the reaction's size against the truth's. "
        f"Truths are solutions of {simulations}. {shared}."
    )
    for layout in result.layouts:
        title = f"Held-out error in {scheme}, mm / von Mises stress, % / force, %, by truth"
        title += f"; markers: {layout}" if len(result.layouts) > 1 else ""
        by_truth = result.of_layout(layout)
        labels = scored_solvers(by_truth)
        columns = {
            truth: [_truth_cell(each, label, scheme) for label in labels] for truth, each in by_truth.items()
        }
        found: list[TextTable] = []
        for part in _parts(labels, columns):
            rows = list(zip(labels, *(columns[truth] for truth in part), strict=True))
            found.append(TextTable("" if found else title, ["solver", *part], rows))
        sentences = verdict_sentences(by_truth, scheme) if len(by_truth) > 1 else []
        yield from found[:-1]
        yield replace(found[-1], caption="\n".join([caption, *sentences]))
    stated = [
        [label, *case, *map(_percent, scores[ALL].stated.values())]
        for case, each in result.cases.items()
        for label, scores in each.scores.items()
        if any(value is not None for value in scores[ALL].stated.values())
    ]
    if stated:
        yield TextTable(
            f"Truth within the intervals of {LEVEL:.0%} that a solver states, every marker given, %",
            ["solver", "truth", "layout", "von Mises", "force", "position"],
            stated,
            "von Mises: share of the body, by area. Force, and the position where it acts: share of seeds.",
        )


def _truth_cell(result: CaseResult, label: str, scheme: str) -> str:
    if label not in result.scores:
        return NONE
    scores = result.scores[label]
    total, stress, force = scores[scheme].held_out, scores[ALL].fields.get("von_mises"), scores[ALL].force
    shares = [NONE if found is None else _percent(found.mean) for found in (stress, force)]
    return " / ".join([distance(total["mae_sum"].mean) if total else NONE, *shares])


def _percent(share: float | None) -> str:
    return NONE if share is None else percent(share, 2, sign=False)


def _parts(labels: Sequence[str], columns: Mapping[str, Sequence[str]]) -> Iterator[list[str]]:
    """The truths in groups whose columns fit 80 characters."""
    room = 80 - max(map(len, ["solver", *labels]))
    part: list[str] = []
    left = room
    for truth, cells in columns.items():
        width = 1 + max(map(len, [truth, *cells]))
        if part and width > left:
            yield part
            part, left = [], room
        part.append(truth)
        left -= width
    yield part
