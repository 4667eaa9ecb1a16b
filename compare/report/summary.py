"""The answers that a report opens with, in words and numbers from `metrics.json`.

Every number is read from the metrics; a question that they cannot answer is not asked.
"""

from collections.abc import Mapping, Sequence
from math import hypot, isfinite, nan
from typing import Any, NamedTuple

from pinnray.runtime.tables import NONE, TextTable, number, percent
from pinnray.solvers.finger_figures import break_warning

Metrics = Mapping[str, Any]
"""`metrics.json`, or a part of it, with NaN for a number that is not known."""

TRUTH_FIELDS = ("displacement", "von Mises stress", "force")
"""Quantities that are compared with the simulated finger, in the order of `_to_truth`."""


class RunAnswer(NamedTuple):
    """An answer to a question about a run."""

    question: str
    verdict: str  # the answer in a sentence
    sentences: list[str]  # the numbers that it rests on
    table: TextTable | None = None  # more numbers, if there are any


def answers(
    metrics: Metrics, *, unsupported: Mapping[str, str] | None = None, failed: Mapping[str, str] | None = None
) -> list[RunAnswer]:
    """The answers of a run, from its metrics.

    Reasons why solvers do not support the problem, and messages of those that failed, come by their names.
    """
    label = {
        name: name if own["status"] == "converged" else f"{name} (not converged)"
        for name, own in metrics["solvers"].items()
    }
    solvers = {
        label[name]: {**own, "twin": label.get(own.get("twin"))} for name, own in metrics["solvers"].items()
    }
    metrics = {**metrics, "solvers": solvers, "reference": label[metrics["reference"]]}
    figures = _figures(metrics)
    about_solvers = any(own.get("family") == "neural network" for own in solvers.values())
    found = [
        _warnings(metrics),
        None if about_solvers else figures,
        _trust(metrics),
        _markers(metrics),
        figures if about_solvers else None,
        _convergence(metrics, unsupported or {}, failed or {}),
    ]
    return [answer for answer in found if answer is not None]


def _warnings(metrics: Metrics) -> RunAnswer | None:
    """The warnings of the run, before any number of it; a run of an earlier version has kept none."""
    said = [f"{text.rstrip('. ')}." for text in metrics.get("warnings", ())]
    count = "One warning" if len(said) == 1 else f"{len(said)} warnings"
    return RunAnswer("What speaks against these numbers?", f"{count}:", said) if said else None


FIGURES = (
    ("force_N", "grip force", "N"),
    ("force_50_N", "force at half of the stroke", "N"),
    ("tip_u_mm", "tip, along the finger", "mm"),
    ("tip_v_mm", "tip, toward the indenter", "mm"),
    ("wrap_deg", "wrap of the front face", "deg"),
    ("compliance_across_mm_per_N", "compliance across, at rest", "mm/N"),
    ("compliance_along_mm_per_N", "compliance along, at rest", "mm/N"),
    ("von_mises_MPa", "largest von Mises stress *", "MPa"),
    ("principal_strain", "largest principal strain *", ""),
    ("strain_energy_mJ", "strain energy", "mJ"),
    ("mass_g", "mass", "g"),
    ("thinnest_wall_mm", "thinnest wall", "mm"),
)
"""Key in the metrics, words and unit of each figure that is shown."""


def _figures(metrics: Metrics) -> RunAnswer | None:
    """What the finger does: newtons, tip, wrap and stress by every solver."""
    known = {name: own["figures"] for name, own in metrics["solvers"].items() if own.get("figures")}
    if not known:
        return None
    measured = metrics["measurements"]["source"] == "measured"
    found_force = [name for name in known if measured and metrics["solvers"][name].get("force")]
    name = next(iter([*found_force, *(each for each in known if each == metrics["reference"]), *known]))
    values = known[name]["values"]
    low, high = (values.get(f"force_{end}_N") for end in ("low", "high"))
    interval = "" if low is None else f" (95 % interval {number(low, 3)} to {number(high, 3)} N)"
    force, strain = values["force_N"], values["principal_strain"]
    moved = hypot(values["tip_u_mm"], values["tip_v_mm"])
    parts = {
        f"it grips with {number(force, 3)} N{interval}": force,
        f"its tip moves by {number(moved, 3)} mm": moved,
        f"the largest strain away from corners is {percent(strain, 2)}": strain,
    }
    said = _listed([words for words, value in parts.items() if isfinite(value)])
    shares = [each["values"].get("strain_over_break", nan) for each in known.values()]
    broken = break_warning(max(filter(isfinite, shares), default=0.0))
    rows = []
    for key, words, unit in FIGURES:
        cells = [_figure(each, key) for each in known.values()]
        if any(cell != NONE for cell in cells):
            rows.append([f"{words}, {unit}" if unit else words, *cells])
    caption = "* At nodes that are a wall thickness away from re-entrant corners, base and contact."
    return RunAnswer(
        "What does the finger do?",
        f"By {name} {said}." if said != NONE else f"{name} does not tell.",
        [broken] if broken else [],
        TextTable("", ["", *known], rows, caption, left=[""]),
    )


def _figure(known: Metrics, key: str) -> str:
    """A figure with its interval, if there is one."""
    value = known["values"].get(key)
    if value is None or not isfinite(value):
        return NONE
    said = percent(value, 2) if key == "principal_strain" else number(value, 3)
    name, _, unit = key.rpartition("_")
    low, high = (known["values"].get(f"{name}_{end}_{unit}") for end in ("low", "high"))
    return said if low is None else f"{said} ({number(low, 3)} to {number(high, 3)})"


def _trust(metrics: Metrics) -> RunAnswer | None:
    """Whether the networks that were given no markers solve the equations of the reference."""
    solvers, reference = metrics["solvers"], metrics["reference"]
    networks = {name: own for name, own in solvers.items() if own.get("family") == "neural network"}
    if not networks or reference in networks:
        return None
    plain = {name: own for name, own in networks.items() if not own["markers"]["in_sample"]}
    verdicts = [_verdict(name, own, metrics) for name, own in plain.items()]
    sentences = [said for name, own in plain.items() for said in _against_reference(name, own, metrics)]
    for name, own in networks.items():
        if name not in plain and (twin := own["twin"]):
            sentences.append(_beside_twin(name, own, twin, solvers[twin], metrics["measurements"]["source"]))
    return RunAnswer("May the network be trusted here?", " ".join(verdicts), list(filter(None, sentences)))


def _verdict(name: str, own: Metrics, metrics: Metrics) -> str:
    reference, to = metrics["reference"], own["to_reference"]
    if own["status"] != "converged":
        return f"No, not with {name}."
    if own["law"] != metrics["solvers"][reference]["law"]:
        return f"{name} has another material law than {reference}, so that this run does not tell."
    if not isfinite(to["rel_l2_displacement"]):
        return f"How far {name} is from {reference} in displacement is not known."
    known = to["reference_uncertainty"]
    if known and to["rel_l2_displacement"] < known["rel_l2_displacement"]:
        return (
            f"Yes, as a solver: {name} and {reference} differ by less than {reference}’s own error in "
            "displacement."
        )
    away = percent(to["rel_l2_displacement"], 2)
    return f"As a solver to {away}: that far is {name} from {reference} in displacement."


def _against_reference(name: str, own: Metrics, metrics: Metrics) -> list[str]:
    reference, to, certificate = metrics["reference"], own["to_reference"], own["certificate"]
    known = to["reference_uncertainty"] or {}
    fields = [
        f"{_plus_minus(to[key], known.get(key, nan))} in {field}"
        for key, field in (("rel_l2_displacement", "displacement"), ("rel_l2_von_mises", "von Mises stress"))
        if isfinite(to[key])
    ]
    own_error = f"; after ± the estimated error of {reference} itself" if "±" in str(fields) else ""
    away = f"{name} is {', '.join(fields)} away from {reference} (relative L² over the body{own_error})."
    said = [away] if fields else []
    if certificate and certificate["rel_excess"] > 0:
        above = percent(certificate["rel_excess"], 2)
        said.append(f"On the shared mesh its energy is {above} above the least that is possible.")
    true, model = own["to_truth"], metrics["solvers"][reference]
    if true:
        sentence = (
            f"In displacement, von Mises stress and force, {name} is {_truth_numbers(own)} away from the "
            f"simulated finger, {reference} {_truth_numbers(model)}."
        )
        if to["rel_l2_displacement"] < 0.1 * true["displacement"]["rel_l2"]:
            sentence += " That is the error of the model and its load, not of the network."
        said.append(sentence)
    return said


def _beside_twin(name: str, own: Metrics, twin: str, other: Metrics, source: str) -> str:
    if not (own["held_out"] and other["held_out"]):
        return ""
    off, of_twin = own["held_out"]["mae_sum"], other["held_out"]["mae_sum"]
    if not isfinite(off + of_twin):
        return ""
    return (
        f"{name}, which is given the markers, is {off:.3f} mm off (mean |Δu| + |Δv|) at held-out {source} "
        f"markers; {twin}, its twin by finite elements, {of_twin:.3f} mm."
    )


def _markers(metrics: Metrics) -> RunAnswer | None:
    """Whether solvers that were given the markers are nearer than the reference, at held-out markers."""
    solvers, reference = metrics["solvers"], metrics["reference"]
    plain, source = solvers[reference], metrics["measurements"]["source"]
    given = {name: own for name, own in solvers.items() if own["markers"]["in_sample"]}
    if not given or plain["markers"]["in_sample"] or not plain["held_out"]:
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
    for place, field in enumerate(TRUTH_FIELDS if plain["to_truth"] else ()):
        found = {name: _to_truth(own)[place] for name, own in listed.items()}
        heads.append(field)
        columns.append([_signed(share, field == "force") for share in found.values()])
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
    if not plain["to_truth"]:
        sentences.append("Whether stress and force are nearer is unknown: no camera tells them.")
    sentences += filter(None, (_force_interval(name, own, metrics) for name, own in given.items()))
    verdict = f"nearer than {reference}: {'; '.join(nearer)}." if nearer else "this run does not tell."
    if len(given) > 1:
        verdict = f"of {len(given)} solvers that were given markers, {verdict}"
    verdict = verdict[0].upper() + verdict[1:]
    caption = f"Errors at {source} markers that were not given"
    if plain["to_truth"]:
        caption += ", and distance from the simulated finger over the whole body"
    rows = [list(row) for row in zip(*columns, strict=True)]
    return RunAnswer("Did the markers help?", verdict, sentences, TextTable(caption, heads, rows))


def _held_out(own: Metrics) -> tuple[float, float, float]:
    """Mean, least and largest |Δu| + |Δv| at held-out markers, mm; NaN where there are none."""
    means = own["held_out"]
    if not means:
        return nan, nan, nan
    pairs = zip(means.get("ae_u", ()), means.get("ae_v", ()), strict=True)
    each = [u + v for u, v in pairs if isfinite(u + v)] or [nan]
    return means["mae_sum"], min(each), max(each)


def _held_out_cells(own: Metrics) -> list[str]:
    mean, least, largest = _held_out(own)
    return [f"{mean:.3f}", f"{least:.3f} to {largest:.3f}"] if isfinite(mean + least) else [NONE, NONE]


def _force_interval(name: str, own: Metrics, metrics: Metrics) -> str:
    """The force that a solver found, with its 95 % interval, beside the true one where that is known."""
    if not own.get("force") or not isfinite(own["force"]["size"]["value"]):
        return ""
    (size, low, high), place = own["force"]["size"].values(), own["force"]["position"]
    source, depth = metrics["measurements"]["source"], metrics["design"].get("depth")
    interval = f"95 % interval {number(low, 3)} to {number(high, 3)}"
    said = f"{name} finds a force of {number(size, 3)} N/mm ({interval})"
    if depth:
        said += f", {number(size * depth, 3)} N over the depth of {depth:g} mm,"
    if place:
        middle, start, end = (number(place[key], 3) for key in ("value", "low", "high"))
        said += f" at x = {middle} mm ({start} to {end} mm)"
    said += f" from the {source} markers"
    true = hypot(*own["reaction"]) / (1 + own["force_to_truth_rel"])
    if not isfinite(true):
        return f"{said}."
    where = "inside" if low <= true <= high else "outside"
    placed = f", {where} it" if isfinite(low + high) else ""
    return f"{said}; that of the simulated finger is {number(true, 3)}{placed}."


def _convergence(metrics: Metrics, unsupported: Mapping[str, str], failed: Mapping[str, str]) -> RunAnswer:
    """The solvers that did not converge, and how far the others are from the exact solution."""
    solvers, reference = metrics["solvers"], metrics["reference"]
    faulty = {name: own["message"] for name, own in solvers.items() if own["status"] != "converged"}
    sentences = [f"{name}: {message.rstrip('. ')}." for name, message in faulty.items()]
    sentences += [f"{name} failed: {message.rstrip('. ')}." for name, message in failed.items()]
    sentences += [f"{name} was left out: {message.rstrip('. ')}." for name, message in unsupported.items()]
    bad = [*faulty, *failed]
    count = len(solvers) + len(failed)
    met = "the solver met its" if count == 1 else f"all {count} solvers met their"
    verdict = f"{len(bad)} of {count} solvers: {_listed(bad)}." if bad else f"Nothing: {met} own criterion."
    own = solvers[reference]["uncertainty"]
    if own:
        sentences.append(
            f"The mesh is a limit too: {reference} estimates its own error as "
            f"{percent(own['rel_l2_displacement'], 2)} in displacement, "
            f"{percent(own['rel_l2_von_mises'], 2)} in von Mises stress (relative L²), "
            f"{percent(own['energy_norm'], 2)} in the energy norm."
        )
    certified = {
        name: entry["certificate"]["rel_excess"]
        for name, entry in solvers.items()
        if entry["certificate"] and entry["certificate"]["rel_excess"] > 0
    }
    if certified:
        each = ", ".join(f"{name} {percent(excess, 2)}" for name, excess in certified.items())
        sentences.append(
            f"Energy above the least on the shared mesh, which no solver can argue away: {each}."
        )
    without = [name for name, entry in solvers.items() if not entry["certificate"]]
    if without:
        sentences.append(f"By their own criterion alone, without a certificate: {_listed(without)}.")
    return RunAnswer("What is not converged?", verdict, sentences)


def _to_truth(own: Metrics) -> tuple[float, float, float]:
    """Relative distances from the simulated finger in displacement, von Mises stress and force."""
    true = own["to_truth"]
    return true["displacement"]["rel_l2"], true["von_mises"]["rel_l2"], own["force_to_truth_rel"]


def _truth_numbers(own: Metrics) -> str:
    return _listed(
        [_signed(share, field == "force") for share, field in zip(_to_truth(own), TRUTH_FIELDS, strict=True)]
    )


def _signed(share: float, sign: bool) -> str:
    return f"{'+' if sign and share > 0 else ''}{percent(share, 2)}"


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
