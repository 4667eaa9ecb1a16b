"""Solvers by truths: held-out error, stress, force and place of contact, and the verdicts in words."""

from collections.abc import Iterable, Mapping, Sequence

from compare.crossval.folds import ALL, SCHEMES
from compare.crossval.result import CrossvalResult, LayoutResult, interval_cells
from compare.crossval.scores import LEVEL, Score
from compare.crossval.study import Study
from compare.evaluation.truths import Truth
from compare.runtime.tables import NONE, Cell, TextTable, distance, percent
from solvers.solver import with_law

NULL_MODELS = ("gp", "statfem")
OPPONENTS = (*NULL_MODELS, "fem-asm")
"""Solvers that the others are compared with, truth by truth."""

WIDTH = 80
"""Widest table, characters: a terminal's."""


def held_out_scheme(result: CrossvalResult) -> str:
    """The scheme whose held-out error stands for a solver: one marker at a time if it was asked for."""
    return next(scheme for scheme in SCHEMES if scheme in result.schemes and scheme != ALL)


def truth_grids(result: CrossvalResult) -> list[TextTable]:
    """Tables of solvers by truths for each layout, as many as fit the truths; none with measurements."""
    if not result.study.chosen_truths:
        return []
    scheme, grids = held_out_scheme(result), []
    layouts = list(dict.fromkeys(case.layout for case in result.cases))
    for layout in layouts:
        title = f"Held-out error in {scheme}, mm / von Mises stress, % / force, %, by truth"
        title += f"; markers: {layout}" if len(layouts) > 1 else ""
        by_truth = result.of_layout(layout)
        labels = _labels(by_truth)
        columns = {
            truth: [_cell(each, label, scheme) for label in labels] for truth, each in by_truth.items()
        }
        for part in _parts(labels, columns):
            rows = zip(labels, *(columns[truth] for truth in part), strict=True)
            grids.append(TextTable(title, ["solver", *part], [list(row) for row in rows]))
            title = ""
        last = grids[-1]
        sentences = verdict_sentences(by_truth, scheme) if len(by_truth) > 1 else []
        caption = "\n".join([_caption(result.study), *sentences])
        grids[-1] = TextTable(last.title, last.headings, last.rows, caption)
    return [*grids, *_stated_grids(result)]


def truth_rows(result: CrossvalResult) -> list[dict[str, Cell]]:
    """The rows of `truths.csv`: what the tables have, and verdicts, by truth, layout and solver."""
    scheme, rows = held_out_scheme(result), []
    for case, each in result.cases.items():
        for label, scores in each.scores.items():
            row: dict[str, Cell] = {**case.cells, "solver": label, "scheme": scheme}
            full, true = scores[ALL], result.true_contacts.get(case.truth)
            row |= {} if true is None else true.cells
            row |= interval_cells("held_out_mae_sum", "_mm", scores[scheme].held_out.get("mae_sum"))
            row |= interval_cells("von_mises_rel_l2", "", full.fields.get("von_mises"))
            row |= interval_cells("force_error", "", full.force)
            row |= interval_cells("position_error", "_mm", full.position)
            row |= {name: "" if share is None else share for name, share in full.stated.items()}
            for what, (at, _) in _judged(scheme).items():
                for opponent in OPPONENTS:
                    found = each.difference(label, opponent, at, what)
                    row[f"{what}_against_{opponent}"] = found.verdict if found else ""
            rows.append(row)
    return rows


def verdict_sentences(by_truth: Mapping[str, LayoutResult], scheme: str) -> list[str]:
    """For each solver but the null models with which truths it is better or worse than each opponent."""
    sentences = []
    for label in _labels(by_truth):
        for opponent in OPPONENTS if label not in NULL_MODELS else ():
            clauses: dict[str, list[str]] = {}
            for what, (at, words) in _judged(scheme).items():
                verdicts: dict[str, list[str]] = {}
                for truth, each in by_truth.items():
                    if label in each.scores and (found := each.difference(label, opponent, at, what)):
                        verdicts.setdefault(found.verdict, []).append(truth)
                if verdicts:
                    clauses.setdefault(_grouped(verdicts, len(by_truth)), []).append(words)
            if clauses:
                said = "; ".join(f"{verdict} in {', '.join(words)}" for verdict, words in clauses.items())
                sentences.append(f"{label} against {opponent}: {said}.")
    return sentences


def _judged(scheme: str) -> dict[str, tuple[str, str]]:
    """The scores that are compared, each with its scheme and its name in words."""
    return {
        "mae_sum": (scheme, "held-out error"),
        "von_mises": (ALL, "von Mises stress"),
        "force": (ALL, "force"),
    }


def _grouped(verdicts: Mapping[str, Sequence[str]], truths: int) -> str:
    """Verdicts with their truths in words, the most frequent one last if every truth has a verdict."""
    ordered = sorted(verdicts.items(), key=lambda item: len(item[1]))
    named = {verdict: f"with {' '.join(names)}" for verdict, names in ordered}
    if sum(map(len, verdicts.values())) == truths:
        named[ordered[-1][0]] = "with the others" if len(ordered) > 1 else "with every truth"
    return ", ".join(f"{verdict} {names}" for verdict, names in named.items())


def _labels(by_truth: Mapping[str, LayoutResult]) -> list[str]:
    """The solvers that have a score with some truth."""
    return list(dict.fromkeys(label for each in by_truth.values() for label in each.scores))


def _cell(result: LayoutResult, label: str, scheme: str) -> str:
    if label not in result.scores:
        return NONE
    scores = result.scores[label]
    total, stress, force = (
        scores[scheme].held_out.get("mae_sum"),
        scores[ALL].fields.get("von_mises"),
        scores[ALL].force,
    )
    texts = [
        NONE if total is None else distance(total.mean),
        NONE if stress is None else percent(stress.mean, 2, sign=False),
        NONE if force is None else percent(force.mean, 2, sign=False),
    ]
    return " / ".join(texts)


def _parts(labels: Sequence[str], columns: Mapping[str, Sequence[str]]) -> Iterable[list[str]]:
    """The truths in groups whose columns fit a table."""
    first = max(map(len, ["solver", *labels]))
    part: list[str] = []
    left = WIDTH - first
    for truth, cells in columns.items():
        width = 1 + max(map(len, [truth, *cells]))
        if part and width > left:
            yield part
            part, left = [], WIDTH - first
        part.append(truth)
        left -= width
    yield part


def _caption(study: Study) -> str:
    """Explains the numbers and says what truths share with the solvers."""
    shared = "; ".join(shared_sentence(study, truth) for truth in study.chosen_truths.values())
    simulations = ", ".join(dict.fromkeys(truth.simulation for truth in study.chosen_truths.values()))
    return (
        "Held-out error: mean |Δu| + |Δv|. Every marker given: relative L2 distance of the von Mises stress "
        "over the body, at points that move with the walls, and the reaction's size against the truth's. "
        f"Truths are solutions of {simulations}. {shared}."
    )


def shared_sentence(study: Study, truth: Truth) -> str:
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


def _stated_grids(result: CrossvalResult) -> list[TextTable]:
    """Shares of stated intervals that hold the truth, %; none where no solver states any."""

    def share(value: float | None) -> str:
        return NONE if value is None else percent(value, 2, sign=False)

    def stated(score: Score) -> list[str]:
        return [share(value) for value in score.stated.values()]

    rows = [
        [label, *case, *stated(scores[ALL])]
        for case, each in result.cases.items()
        for label, scores in each.scores.items()
        if any(value is not None for value in scores[ALL].stated.values())
    ]
    if not rows:
        return []
    return [
        TextTable(
            f"Truth within the intervals of {LEVEL:.0%} that a solver states, every marker given, %",
            ["solver", "truth", "layout", "von Mises", "force", "position"],
            rows,
            "von Mises: share of the body, by area. Force, and the position where it acts: share of seeds.",
        )
    ]
