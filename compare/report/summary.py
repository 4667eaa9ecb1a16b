"""The answers that a report opens with, in words and numbers from its scores.

A question that they cannot answer is not asked.
"""

from collections.abc import Callable, Mapping, Sequence
from math import hypot, isfinite, nan
from typing import NamedTuple

from pinnray.comparison.evaluation.scores import FigureScores, Scores, SolverScores
from pinnray.comparison.report.numbers import at_markers, share, truth_errors
from pinnray.runtime.tables import NONE, TextTable, number
from pinnray.solvers.finger_figures import break_answer


class RunAnswer(NamedTuple):
    """An answer to a question about a run."""

    question: str
    verdict: str  # the answer in a sentence
    sentences: list[str]  # the numbers that it rests on
    table: TextTable | None = None  # more numbers, if there are any


def answers(scores: Scores) -> list[RunAnswer]:
    """The answers of a run."""
    asked = (_warnings, _figures, _trust, _markers, _convergence)
    return [answer for ask in asked if (answer := ask(scores)) is not None]


def _warnings(scores: Scores) -> RunAnswer | None:
    """The warnings of the run, before any number of it."""
    said = [f"{text.rstrip('. ')}." for text in scores.warnings]
    count = "One warning" if len(said) == 1 else f"{len(said)} warnings"
    return RunAnswer("What speaks against these numbers?", f"{count}:", said) if said else None


FIGURES = (
    ("force_N", "force, N"),
    ("tangential_force_N", "tangential force, N"),
    ("lift_kg", "mass that two such fingers hold *, kg"),
    ("tip_u_mm", "tip, along the finger, mm"),
    ("tip_v_mm", "tip, toward the indenter, mm"),
    ("wrap_deg", "wrap of the front face, deg"),
    ("contact_angle_deg", "angle of the cylinder that is touched, deg"),
    ("contact_length_mm", "length of the contact, mm"),
    ("von_mises_MPa", "largest von Mises stress **, MPa"),
    ("principal_strain", "largest principal strain **"),
    ("strain_over_break", "largest strain over that at break"),
)
"""Key in the metrics and words with the unit of each figure of the table."""
AT_REST = (
    ("compliance_across_mm_per_N", "compliance across {} mm/N"),
    ("compliance_along_mm_per_N", "along {} mm/N"),
    ("mass_g", "mass {} g"),
    ("thinnest_wall_mm", "thinnest wall {} mm"),
)
"""Figures that do not depend on the load: told once."""
SHARES = ("principal_strain", "strain_over_break")
"""Those that are shown in per cent."""
FIGURES_NOTE = (
    "* By friction, 2 µ force / g: µ is the load's, else 0.5. ** A wall thickness away from corners, base "
    "and contact."
)


def _figures(scores: Scores) -> RunAnswer | None:
    """What the finger does, by the best solver at hand, beside the truth and the other solvers."""
    known = {name: own.figures for name, own in scores.solvers.items() if own.figures}
    if not known:
        return None
    name = _best(list(known), scores)
    values, truth = known[name].values, scores.truth.values if scores.truth else {}
    parts = [
        _beside("the force is {} N", _figure(known[name], "force_N"), truth.get("force_N", nan)),
        _beside("the tip moves by {} mm", number(_tip(values), 3), _tip(truth)),
    ]
    strain = values.get("principal_strain", nan)
    if isfinite(strain):
        parts.append(f"the largest strain away from corners is {share(strain)}")
    said = _listed([part for part in parts if part])
    columns = {"truth": scores.truth} if scores.truth else {}
    for each in (name, *known):
        columns.setdefault(scores.label(each), known[each])
    rows = [[words, *(_figure(each, key) for each in columns.values())] for key, words in FIGURES]
    rest = [
        words.format(_figure(known[name], key)) for key, words in AT_REST if isfinite(values.get(key, nan))
    ]
    sentences = [f"At rest: {', '.join(rest)}."] if rest else []
    breaks = values.get("strain_over_break", nan)
    if isfinite(breaks):
        sentences.append(break_answer(breaks, values.get("peak_radius_mm", nan)))
    shown = [row for row in rows if any(cell not in (NONE, "0.00") for cell in row[1:])]
    intervals = "In brackets: 95 % intervals. " * any("(" in cell for row in shown for cell in row[1:])
    table = TextTable("", ["", *columns], shown, intervals + FIGURES_NOTE, left=[""])
    verdict = f"By {scores.label(name)} {said}." if said != NONE else f"{scores.label(name)} does not tell."
    return RunAnswer("What does the finger do?", verdict, sentences, table)


def _beside(words: str, said: str, truth: float) -> str:
    """A figure in words, beside the truth where that is known; empty if there is no figure."""
    if said == NONE:
        return ""
    return words.format(said) + (f" (truth {number(truth, 3)})" if isfinite(truth) else "")


def _tip(values: Mapping[str, float]) -> float:
    return hypot(values.get("tip_u_mm", nan), values.get("tip_v_mm", nan))


def _best(known: Sequence[str], scores: Scores) -> str:
    """The solver at hand that is nearest to the truth, else to the markers that it was not given.

    Those that found the load come first, then those that were not given the markers: the others carry the
    forces of the markers too. One that did not converge comes last.
    """

    def rank(name: str) -> tuple[bool, bool, bool, float, bool]:
        own = scores[name]
        away = own.to_truth.displacement.rel_l2 if own.to_truth else _held_out(own)
        fitted = own.identified is None and own.markers.in_sample
        found = own.identified is not None
        other = name != scores.reference
        return not own.converged, fitted, not found, away if isfinite(away) else float("inf"), other

    return min(known, key=rank)


def _figure(known: FigureScores, key: str) -> str:
    """A figure with its interval, if there is one."""
    value = known.values.get(key, nan)
    if not isfinite(value):
        return NONE
    said = share(value) if key in SHARES else number(value, 3)
    name, _, unit = key.rpartition("_")
    low, high = (known.values.get(f"{name}_{end}_{unit}") for end in ("low", "high"))
    return said if low is None or high is None else f"{said} ({number(low, 3)} to {number(high, 3)})"


def _trust(scores: Scores) -> RunAnswer | None:
    """Whether the networks that were given no markers solve the equations of the reference."""
    networks = [name for name, own in scores.solvers.items() if own.family == "neural network"]
    if not networks or scores.reference in networks:
        return None
    plain = {name: own for name, own in scores.solvers.items() if not own.markers.in_sample}
    judged = [name for name in networks if name in plain]
    reference = scores.label(scores.reference)
    listed = {scores.reference: scores[scores.reference], **plain}
    title = f"Relative L² distance over the body from {reference}"
    heads = ["Solver", f"{reference}:\ndisplacement", f"{reference}:\nvon Mises"]
    if scores[scores.reference].to_truth:
        title += " and from the truth, and error of the force"
        heads += TRUTH_HEADS
    rows = [
        [scores.label(name), *_from_reference(name, scores), *truth_errors(listed[name])] for name in listed
    ]
    own = f"±: error of {reference}, as it estimates it." if scores[scores.reference].uncertainty else ""
    return RunAnswer(
        "May the network be trusted here?",
        " ".join(_verdict(name, scores) for name in judged),
        [said for name in judged if (said := _model_error(name, scores))],
        TextTable(title, heads, rows, own) if judged else None,
    )


TRUTH_HEADS = ("truth:\ndisplacement", "truth:\nvon Mises", "truth:\nforce")


def _from_reference(name: str, scores: Scores) -> list[str]:
    """Distances from the reference in displacement and stress; its own error for the reference."""
    own = scores[name]
    if name != scores.reference:
        return [share(own.to_reference.rel_l2_displacement), share(own.to_reference.rel_l2_von_mises)]
    if not own.uncertainty:
        return [NONE, NONE]
    return [f"± {share(own.uncertainty.rel_l2_displacement)}", f"± {share(own.uncertainty.rel_l2_von_mises)}"]


def _verdict(solver: str, scores: Scores) -> str:
    name, reference = scores.label(solver), scores.label(scores.reference)
    own, away = scores[solver], scores[solver].to_reference.rel_l2_displacement
    if not own.converged:
        return f"No, not with {name}."
    if own.law != scores[scores.reference].law:
        return f"{name} has another material law than {reference}, so that this run does not tell."
    if not isfinite(away):
        return f"How far {name} is from {reference} in displacement is not known."
    known = own.to_reference.reference_uncertainty
    if known and away < known.rel_l2_displacement:
        return f"Yes, as a solver: {name} differs from {reference} by less than {reference}’s own error."
    return f"As a solver to {share(away)}: that far is {name} from {reference} in displacement."


def _model_error(solver: str, scores: Scores) -> str:
    """That a network's distance from the truth is not its own, where that is so."""
    own = scores[solver]
    if not own.to_truth or not own.to_reference.rel_l2_displacement < 0.1 * own.to_truth.displacement.rel_l2:
        return ""
    return (
        f"{scores.label(solver)} and {scores.label(scores.reference)} are equally far from the truth: that "
        "is the error of the model and its load, not of the network."
    )


def _markers(scores: Scores) -> RunAnswer | None:
    """Whether solvers that were given the markers are nearer than the reference, at held-out markers."""
    plain = scores[scores.reference]
    given = {scores.label(name): own for name, own in scores.solvers.items() if own.given}
    if not given or plain.given or not plain.held_out:
        return None
    listed = {scores.label(scores.reference): plain, **given}
    measures: dict[str, Callable[[SolverScores], float]] = {"at held-out markers": _held_out}
    heads = ["Solver", f"held-out {scores.measurements.source}\nmarkers, mm"]
    rows = [[name, at_markers(_held_out(own)), *truth_errors(own)] for name, own in listed.items()]
    sentences = []
    if plain.to_truth:
        heads += TRUTH_HEADS
        measures |= TRUTH_MEASURES
    else:
        sentences.append("Whether stress and force are nearer is unknown: no camera tells them.")
    sentences += _loads_found(scores)
    caption = "Held out: mean |Δu| + |Δv| at each marker, predicted from the others."
    verdict = _nearer(plain, given, measures, scores.reference)
    return RunAnswer("Did the markers help?", verdict, sentences, TextTable("", heads, rows, caption))


TRUTH_MEASURES: Mapping[str, Callable[[SolverScores], float]] = {
    "in displacement": lambda own: own.to_truth.displacement.rel_l2 if own.to_truth else nan,
    "in von Mises stress": lambda own: own.to_truth.von_mises.rel_l2 if own.to_truth else nan,
    "in force": lambda own: abs(own.force_to_truth_rel),
}


def _nearer(
    plain: SolverScores,
    given: Mapping[str, SolverScores],
    measures: Mapping[str, Callable[[SolverScores], float]],
    reference: str,
) -> str:
    """The solvers that were given markers and are nearer than the reference, by each measure."""
    said = []
    for words, measure in measures.items():
        known = {name: measure(own) for name, own in given.items() if isfinite(measure(own))}
        if known and isfinite(measure(plain)):
            better = [name for name, value in known.items() if value < measure(plain)]
            every = len(better) == len(given) > 1
            said.append(f"{words} {_all(len(given)) if every else _listed(better) if better else 'none'}")
    return f"Nearer than {reference}: {'; '.join(said)}." if said else "This run does not tell."


def _held_out(own: SolverScores) -> float:
    """Mean |Δu| + |Δv| at held-out markers, mm; NaN where there are none."""
    return own.held_out.mae_sum if own.held_out else nan


def _loads_found(scores: Scores) -> list[str]:
    """Places of the forces that solvers found from the markers, and what would narrow their intervals."""
    found = {scores.label(name): own.identified for name, own in scores.solvers.items() if own.identified}
    places = []
    for name, own in found.items():
        if (place := own.position) and isfinite(place.value):
            middle, low, high = (number(each, 3) for each in (place.value, place.low, place.high))
            places.append(f"{middle} mm ({low} to {high} mm) by {name}")
    said = [f"The force acts at x = {_listed(places)}."] if places else []
    advice = [own.advice for own in found.values() if own.advice]
    return said + list(dict.fromkeys(advice))


def _convergence(scores: Scores) -> RunAnswer:
    """The solvers that did not converge, failed or were left out."""
    faulty = {scores.label(name): own for name, own in scores.solvers.items() if not own.converged}
    sentences = [f"{name}: {own.message.rstrip('. ')}." for name, own in faulty.items()]
    for what, reasons in (("failed", scores.failed), ("was left out", scores.left_out)):
        sentences += [f"{name} {what}: {message.rstrip('. ')}." for name, message in reasons.items()]
    bad = [*faulty, *scores.failed]
    count = len(scores.solvers) + len(scores.failed)
    met = "the solver met its" if count == 1 else f"{_all(count)} solvers met their"
    verdict = f"{len(bad)} of {count} solvers: {_listed(bad)}." if bad else f"Nothing: {met} own criterion."
    return RunAnswer("What is not converged?", verdict, sentences)


def _all(count: int) -> str:
    return "both" if count == 2 else f"all {count}"


def _listed(names: Sequence[str]) -> str:
    if not names:
        return NONE
    return ", ".join(names[:-1]) + (" and " if names[:-1] else "") + names[-1]
