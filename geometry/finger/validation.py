"""Validation of a finger against all rules, and the range of a parameter that obeys them."""

import math
from collections.abc import Callable, Iterable
from itertools import islice

import numpy as np

from pinnray.geometry.finger.parameters import Parameters, parameter_info
from pinnray.geometry.finger.rules import RULES, Rule
from pinnray.geometry.finger.section import rib_feet, rib_pitch
from pinnray.runtime.arrays import FloatArray
from pinnray.runtime.errors import UserError

ROUNDING = -1e-9
"""Tolerance of the margins, mm."""

STEP = 0.01
"""Step to which ranges are rounded inward, mm or degrees."""


def check(parameters: Parameters) -> None:
    """Raise a `UserError` with the reason and the allowed ranges if a rule is broken."""
    for rule in RULES:
        finding = rule.check(parameters)
        if finding.margin < ROUNDING:
            raise UserError(f"{finding.sentence}; {advice(parameters, rule)}")


def broken_rule(parameters: Parameters) -> str | None:
    """The fault of a finger that breaks a rule, without the ranges, which take a second; else None."""
    findings = (rule.check(parameters) for rule in RULES)
    return next((each.sentence for each in findings if each.margin < ROUNDING), None)


def advice(parameters: Parameters, broken: Rule) -> str:
    """Ranges of the parameters that can remedy a broken rule, each with the others unchanged."""
    others = [rule for rule in RULES if rule is not broken]
    ranges = _ranges(parameters, broken.remedies, [broken, *others])  # what fails most, first
    if ranges:
        return f"allowed with the rest unchanged: {', or '.join(ranges)}"
    ranges = _ranges(parameters, broken.remedies, [broken])
    alone = (
        f"this rule alone asks for {', or '.join(ranges)}" if ranges else f"try {', '.join(broken.remedies)}"
    )
    return f"more than one parameter must change; {alone}"


def obeys(parameters: Parameters, rules: Iterable[Rule] = RULES) -> bool:
    """Whether every rule is obeyed."""
    return all(rule.check(parameters).margin >= ROUNDING for rule in rules)


def allowed_range(
    parameters: Parameters, name: str, rules: Iterable[Rule] = RULES
) -> tuple[float, float] | None:
    """The interval nearest to the present value in which every rule is obeyed, the rest unchanged.

    Args:
        parameters: The finger, allowed or not.
        name: The parameter to vary, within its own bounds.
        rules: The rules to obey.

    Returns:
        Both ends, rounded inward to `STEP`; None if no value was found.
    """
    rules = tuple(rules)
    low, high = parameter_info(name, "low"), parameter_info(name, "high")
    whole = name in ("rib_count", "marker_count")

    def good(value: float) -> bool:
        return obeys(parameters.model_copy(update={name: int(value) if whole else float(value)}), rules)

    present = _present(parameters, name)
    tried = np.arange(low, high + 1) if whole else _trial_values(low, high, present)
    passed = np.array([good(value) for value in tried])
    if not passed.any():
        return None
    nearest = int(np.abs(np.where(passed, tried, np.inf) - present).argmin())
    first = last = nearest
    while first > 0 and passed[first - 1]:
        first -= 1
    while last < len(tried) - 1 and passed[last + 1]:
        last += 1
    start, stop = float(tried[first]), float(tried[last])
    if whole:
        return start, stop
    if first > 0:
        start = _rounded(good, _edge(good, start, float(tried[first - 1])), math.ceil)
    if last < len(tried) - 1:
        stop = _rounded(good, _edge(good, stop, float(tried[last + 1])), math.floor)
    return (start, stop) if start <= stop and good(start) and good(stop) else None


def _present(parameters: Parameters, name: str) -> float:
    """The parameter's value, or the one that stands for none."""
    value = getattr(parameters, name)
    if value is None:
        value = {
            "contact_position": parameters.contact_abscissa,
            "rib_pitch": rib_pitch(parameters),
            "rib_start": rib_feet(parameters)[0] if parameters.rib_count else 0.0,
        }[name]
    return float(value)


def _trial_values(low: float, high: float, present: float) -> FloatArray:
    """Values from `low` to `high`, evenly and, where both are positive, also evenly in their logarithm."""
    values = [np.linspace(low, high, 240), np.array([present])]
    if low > 0:
        values.append(np.geomspace(low, high, 120))
    return np.asarray(np.unique(np.clip(np.concatenate(values), low, high)), dtype=np.float64)


def _edge(good: Callable[[float], bool], inside: float, outside: float) -> float:
    """The last good value between a good and a bad one, by bisection."""
    while abs(outside - inside) > STEP / 1000:
        middle = (inside + outside) / 2
        inside, outside = (middle, outside) if good(middle) else (inside, middle)
    return inside


def _rounded(good: Callable[[float], bool], edge: float, inward: Callable[[float], int]) -> float:
    """The edge as a multiple of `STEP`: the nearest one if it is good, else the next one inward."""
    nearest = round(edge / STEP) * STEP
    return nearest if good(nearest) else inward(edge / STEP) * STEP


def _ranges(parameters: Parameters, names: Iterable[str], rules: Iterable[Rule]) -> list[str]:
    """`name low to high unit` for the first three parameters that have a range."""
    found = ((name, allowed_range(parameters, name, rules)) for name in names)
    texts = (_in_words(name, *ends) for name, ends in found if ends is not None)
    return list(islice(texts, 3))


def _in_words(name: str, start: float, stop: float) -> str:
    """A range as text; an end at the parameter's own bound is left out unless both are."""
    low, high, unit = parameter_info(name, "low"), parameter_info(name, "high"), parameter_info(name, "unit")
    first, last = f"{start:.2f}".rstrip("0").rstrip("."), f"{stop:.2f}".rstrip("0").rstrip(".")
    if start == low and stop < high:
        return f"{name} up to {last} {unit}".rstrip()
    if stop == high and start > low:
        return f"{name} at least {first} {unit}".rstrip()
    return f"{name} {first} to {last} {unit}".rstrip()
