"""The answers that a report opens with, in words and numbers from its scores.

A question that they cannot answer is not asked.
"""

from collections.abc import Collection, Mapping, Sequence
from math import hypot, isfinite, nan
from typing import NamedTuple

from pinnray.comparison.evaluation.scores import FigureScores, Scores, SolverScores
from pinnray.runtime.tables import NONE, TextTable, number, percent
from pinnray.solvers.finger_figures import break_answer

TRUTH_FIELDS = ("displacement", "von Mises stress", "force")
"""Quantities that are compared with the simulated finger, in the order of `_to_truth`."""


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
    ("force_N", "force", "N"),
    ("tangential_force_N", "tangential force, positive toward the tip", "N"),
    ("force_50_N", "force at half of the stroke", "N"),
    ("tip_u_mm", "tip, along the finger", "mm"),
    ("tip_v_mm", "tip, toward the indenter", "mm"),
    ("wrap_deg", "wrap of the front face", "deg"),
    ("contact_angle_deg", "angle of the cylinder that is touched", "deg"),
    ("contact_length_mm", "length of the contact", "mm"),
    ("lift_kg", "mass that two such fingers hold **", "kg"),
    ("compliance_across_mm_per_N", "compliance across, at rest", "mm/N"),
    ("compliance_along_mm_per_N", "compliance along, at rest", "mm/N"),
    ("von_mises_MPa", "largest von Mises stress *", "MPa"),
    ("principal_strain", "largest principal strain *", ""),
    ("peak_strain", "largest principal strain, corners included", ""),
    ("peak_radius_mm", "radius of the corner there, 0 if sharp", "mm"),
    ("strain_over_break", "that over the material's strain at break", ""),
    ("strain_energy_mJ", "strain energy", "mJ"),
    ("mass_g", "mass", "g"),
    ("thinnest_wall_mm", "thinnest wall", "mm"),
)
"""Key in the metrics, words and unit of each figure that is shown."""
SHARES = ("principal_strain", "peak_strain", "strain_over_break")
"""Those that are shown in per cent."""


def _figures(scores: Scores) -> RunAnswer | None:
    """What the finger does: newtons, tip, wrap and stress by every solver."""
    known = {name: own.figures for name, own in scores.solvers.items() if own.figures}
    if not known:
        return None
    name = _best(known, scores)
    values, error = known[name].values, scores[name].force_to_truth_rel
    low, high = (values.get(f"force_{end}_N") for end in ("low", "high"))
    beside = []
    if low is not None and high is not None:
        beside.append(f"95 % interval {number(low, 3)} to {number(high, 3)} N")
    if isfinite(error):
        beside.append(f"{percent(error, 2, plus=True)} off the simulated finger’s")
    interval = f" ({'; '.join(beside)})" if beside else ""
    force, strain = values["force_N"], values["principal_strain"]
    moved = hypot(values["tip_u_mm"], values["tip_v_mm"])
    parts = {
        f"the force is {number(force, 3)} N{interval}": force,
        f"its tip moves by {number(moved, 3)} mm": moved,
        f"the largest strain away from corners is {percent(strain, 2)}": strain,
    }
    said = _listed([words for words, value in parts.items() if isfinite(value)])
    breaks = break_answer(*(values.get(key, nan) for key in ("strain_over_break", "peak_radius_mm")))
    columns = {scores.label(each): figures for each, figures in known.items()}
    if scores.truth:
        columns["simulated finger"] = scores.truth
    rows = []
    for key, words, unit in FIGURES:
        cells = [_figure(each, key) for each in columns.values()]
        if any(cell != NONE for cell in cells):
            rows.append([f"{words}, {unit}" if unit else words, *cells])
    caption = (
        "* At nodes that are a wall thickness away from re-entrant corners, base and contact. ** By "
        "friction, 2 µ F / g: µ is the load's, else 0.5."
    )
    return RunAnswer(
        "What does the finger do?",
        f"By {scores.label(name)} {said}." if said != NONE else f"{scores.label(name)} does not tell.",
        [breaks],
        TextTable("", ["", *columns], rows, caption, left=[""]),
    )


def _best(known: Collection[str], scores: Scores) -> str:
    """The solver at hand that is nearest to the truth, else has found the force, else is the reference."""
    away = {name: own.to_truth.displacement.rel_l2 for name in known if (own := scores[name]).to_truth}
    if away and all(map(isfinite, away.values())):
        return min(away, key=lambda name: (not scores[name].converged, away[name]))
    found = [name for name in known if scores[name].identified]
    return next(iter([*found, *(each for each in known if each == scores.reference), *known]))


def _figure(known: FigureScores, key: str) -> str:
    """A figure with its interval, if there is one."""
    value = known.values.get(key)
    if value is None or not isfinite(value):
        return NONE
    said = percent(value, 2) if key in SHARES else number(value, 3)
    name, _, unit = key.rpartition("_")
    low, high = (known.values.get(f"{name}_{end}_{unit}") for end in ("low", "high"))
    return said if low is None or high is None else f"{said} ({number(low, 3)} to {number(high, 3)})"


def _trust(scores: Scores) -> RunAnswer | None:
    """Whether the networks that were given no markers solve the equations of the reference."""
    networks = {name: own for name, own in scores.solvers.items() if own.family == "neural network"}
    if not networks or scores.reference in networks:
        return None
    plain = [name for name, own in networks.items() if not own.markers.in_sample]
    verdicts = [_verdict(name, scores) for name in plain]
    sentences = [said for name in plain for said in _against_reference(name, scores)]
    return RunAnswer("May the network be trusted here?", " ".join(verdicts), sentences)


def _verdict(solver: str, scores: Scores) -> str:
    name, reference = scores.label(solver), scores.label(scores.reference)
    own, to = scores[solver], scores[solver].to_reference
    if not own.converged:
        return f"No, not with {name}."
    if own.law != scores[scores.reference].law:
        return f"{name} has another material law than {reference}, so that this run does not tell."
    if not isfinite(to.rel_l2_displacement):
        return f"How far {name} is from {reference} in displacement is not known."
    known = to.reference_uncertainty
    if known and to.rel_l2_displacement < known.rel_l2_displacement:
        return (
            f"Yes, as a solver: {name} and {reference} differ by less than {reference}’s own error in "
            "displacement."
        )
    away = percent(to.rel_l2_displacement, 2)
    return f"As a solver to {away}: that far is {name} from {reference} in displacement."


def _against_reference(solver: str, scores: Scores) -> list[str]:
    name, reference = scores.label(solver), scores.label(scores.reference)
    own, to = scores[solver], scores[solver].to_reference
    fields = [
        f"{_plus_minus(getattr(to, key), getattr(to.reference_uncertainty, key, nan))} in {field}"
        for key, field in (("rel_l2_displacement", "displacement"), ("rel_l2_von_mises", "von Mises stress"))
        if isfinite(getattr(to, key))
    ]
    own_error = f"; after ± the estimated error of {reference} itself" if "±" in str(fields) else ""
    away = f"{name} is {', '.join(fields)} away from {reference} (relative L² over the body{own_error})."
    said = [away] if fields else []
    if own.to_truth:
        sentence = (
            f"In displacement, von Mises stress and force, {name} is {_truth_numbers(own)} away from the "
            f"simulated finger, {reference} {_truth_numbers(scores[scores.reference])}."
        )
        if to.rel_l2_displacement < 0.1 * own.to_truth.displacement.rel_l2:
            sentence += " That is the error of the model and its load, not of the network."
        said.append(sentence)
    return said


def _markers(scores: Scores) -> RunAnswer | None:
    """Whether solvers that were given the markers are nearer than the reference, at held-out markers."""
    reference, source = scores.label(scores.reference), scores.measurements.source
    plain = scores[scores.reference]
    given = {scores.label(name): own for name, own in scores.solvers.items() if own.given}
    if not given or plain.given or not plain.held_out:
        return None
    told = {name: own for name, own in given.items() if isfinite(_held_out(own)[0] + _held_out(plain)[0])}
    listed = {reference: plain, **given}
    nearer, inside = [], []
    heads, columns = ["Solver"], [list(listed)]
    if told:
        heads += ["held out, mm", "least to largest"]
        columns += [list(column) for column in zip(*map(_held_out_cells, listed.values()), strict=True)]
        better = [name for name, own in told.items() if _held_out(own)[0] < _held_out(plain)[0]]
        nearer.append(f"at held-out {source} markers {_those(better, told)}")
    for place, field in enumerate(TRUTH_FIELDS if plain.to_truth else ()):
        found = {name: _to_truth(own)[place] for name, own in listed.items()}
        heads.append(field)
        columns.append([percent(share, 2, plus=field == "force") for share in found.values()])
        better = [name for name in given if abs(found[name]) < abs(found[reference])]
        if any(isfinite(found[name] + found[reference]) for name in given):
            inside.append(f"in {field} {_those(better, given)}")
    if inside:
        nearer.append(f"over the simulated body {', '.join(inside)}")
    held_out = (
        "Held out: mean |Δu| + |Δv| at markers that the solver was not given, each predicted from the "
        "others. The range is over neighbouring markers under one load and no confidence interval; those are "
        "from pinnray crossval."
    )
    sentences = [held_out] if told else []
    if not plain.to_truth:
        sentences.append("Whether stress and force are nearer is unknown: no camera tells them.")
    sentences += filter(None, (_force_interval(name, own, scores) for name, own in given.items()))
    verdict = f"nearer than {reference}: {'; '.join(nearer)}." if nearer else "this run does not tell."
    if len(given) > 1:
        verdict = f"of {len(given)} solvers that were given markers, {verdict}"
    verdict = verdict[0].upper() + verdict[1:]
    caption = f"Errors at {source} markers that were not given"
    if plain.to_truth:
        caption += ", and distance from the simulated finger over the whole body"
    rows = [list(row) for row in zip(*columns, strict=True)]
    return RunAnswer("Did the markers help?", verdict, sentences, TextTable(caption, heads, rows))


def _held_out(own: SolverScores) -> tuple[float, float, float]:
    """Mean, least and largest |Δu| + |Δv| at held-out markers, mm; NaN where there are none."""
    if not (errors := own.held_out):
        return nan, nan, nan
    each = [u + v for u, v in zip(errors.ae_u, errors.ae_v, strict=True) if isfinite(u + v)] or [nan]
    return errors.mae_sum, min(each), max(each)


def _held_out_cells(own: SolverScores) -> list[str]:
    mean, least, largest = _held_out(own)
    return [f"{mean:.3f}", f"{least:.3f} to {largest:.3f}"] if isfinite(mean + least) else [NONE, NONE]


def _force_interval(name: str, own: SolverScores, scores: Scores) -> str:
    """The force that a solver found, with its 95 % interval, beside the true one where that is known."""
    if not own.identified or not own.figures:
        return ""
    values = own.figures.values
    force, low, high, across = (
        values.get(f"{key}_N", nan) for key in ("force", "force_low", "force_high", "tangential_force")
    )
    if not isfinite(force):
        return ""
    source = scores.measurements.source
    said = f"{name} finds a force of {number(force, 3)} N (95 % interval {number(low, 3)} to "
    said += f"{number(high, 3)}) and a tangential force of {number(across, 2)} N"
    if place := own.identified.position:
        middle, start, end = (number(each, 3) for each in (place.value, place.low, place.high))
        said += f" at x = {middle} mm ({start} to {end} mm)"
    said += f" from the {source} markers"
    if scores.truth and isfinite(true := scores.truth.values["force_N"]):
        where = "inside" if low <= true <= high else "outside"
        placed = f", {where} it" if isfinite(low + high) else ""
        said += f"; the force on the simulated finger is {number(true, 3)} N{placed}"
    return f"{said}. {own.identified.advice}".rstrip()


def _convergence(scores: Scores) -> RunAnswer:
    """The solvers that did not converge, and how far the others are from the exact solution."""
    faulty = {scores.label(name): own for name, own in scores.solvers.items() if not own.converged}
    sentences = [f"{name}: {own.message.rstrip('. ')}." for name, own in faulty.items()]
    for what, reasons in (("failed", scores.failed), ("was left out", scores.left_out)):
        sentences += [f"{name} {what}: {message.rstrip('. ')}." for name, message in reasons.items()]
    bad = [*faulty, *scores.failed]
    count = len(scores.solvers) + len(scores.failed)
    met = "the solver met its" if count == 1 else f"all {count} solvers met their"
    verdict = f"{len(bad)} of {count} solvers: {_listed(bad)}." if bad else f"Nothing: {met} own criterion."
    if own := scores[scores.reference].uncertainty:
        sentences.append(
            f"The mesh is a limit too: {scores.label(scores.reference)} estimates its own error as "
            f"{percent(own.rel_l2_displacement, 2)} in displacement, "
            f"{percent(own.rel_l2_von_mises, 2)} in von Mises stress (relative L²), "
            f"{percent(own.energy_norm, 2)} in the energy norm."
        )
    certificates = {scores.label(name): own.certificate for name, own in scores.solvers.items()}
    above = [(name, each.rel_excess) for name, each in certificates.items() if each and each.rel_excess > 0]
    if above:
        each = ", ".join(f"{name} {percent(excess, 2)}" for name, excess in above)
        sentences.append(
            f"Energy above the least on the shared mesh, which no solver can argue away: {each}."
        )
    return RunAnswer("What is not converged?", verdict, sentences)


def _to_truth(own: SolverScores) -> tuple[float, float, float]:
    """Relative distances from the simulated finger in displacement, von Mises stress and force."""
    if own.to_truth is None:
        return nan, nan, nan
    return own.to_truth.displacement.rel_l2, own.to_truth.von_mises.rel_l2, own.force_to_truth_rel


def _truth_numbers(own: SolverScores) -> str:
    return _listed(
        [
            percent(share, 2, plus=field == "force")
            for share, field in zip(_to_truth(own), TRUTH_FIELDS, strict=True)
        ]
    )


def _plus_minus(share: float, own: float) -> str:
    if not isfinite(own):
        return percent(share, 2)
    return f"{percent(share, 2, sign=False)} ± {percent(abs(own), 2)}"


def _those(some: Sequence[str], of: Mapping[str, object]) -> str:
    """The names that something holds for: all, none, or the list."""
    if len(some) == len(of):
        return f"all {len(of)}" if len(of) > 1 else _listed(some)
    return f"only {_listed(some)}" if some else "none"


def _listed(names: Sequence[str]) -> str:
    if not names:
        return NONE
    return ", ".join(names[:-1]) + (" and " if names[:-1] else "") + names[-1]
