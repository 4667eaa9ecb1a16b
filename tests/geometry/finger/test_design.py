"""Designs: names, symbols, one-line errors, and ranges that are true."""

import re

import numpy as np
import pytest

from pinnray.geometry import Design, UserError
from pinnray.geometry.finger.parameters import SYMBOLS, Parameters, parameter_info
from pinnray.geometry.finger.rules import Rule, RuleResult
from pinnray.geometry.finger.validation import RULES, STEP, advice, obeys  # type: ignore[attr-defined]

BAD_DESIGNS = [
    # parameters, parameter that the message must give a range for
    ({"rib_count": 12, "rib_thickness": 6}, "rib_count"),  # ribs overlap
    ({"rib_count": 30}, "rib_count"),  # too close
    ({"rib_angle": -40}, "rib_angle"),  # into the base wall
    ({"rib_count": 1, "rib_thickness": 29, "rib_angle": 60}, "rib_thickness"),  # into the tip block
    ({"base_thickness": 75}, "base_thickness"),  # no room for a cavity
    ({"back_thickness": 5}, "back_thickness"),  # walls close the cavity
    ({"contact_position": 0.2}, "contact_position"),  # outside the front face
    # the last falls out
    pytest.param({"marker_layout": "front", "marker_count": 40}, "marker_count", marks=pytest.mark.slow),
    ({"front_thickness": 0.29}, "front_thickness"),  # a marker, which shrinks, is at least 0.1 mm
    # a marker does not fit
    pytest.param({"back_thickness": 1, "marker_diameter": 1.5}, "back_thickness", marks=pytest.mark.slow),
    ({"rib_count": 40, "rib_thickness": 0.2, "marker_diameter": 1.5}, "rib_count"),  # markers overlap
    ({"fillet_radius": 4}, "fillet_radius"),
    ({"depth": 1, "marker_height": 1}, "depth"),  # a marker goes through the finger
]

RANGE = re.compile(r"(\w+) (?:up to (-?[\d.]+)|at least (-?[\d.]+)|(-?[\d.]+) to (-?[\d.]+))")


def message_of(values: dict[str, object]) -> str:
    with pytest.raises(UserError) as refused:
        Design(**values)
    return str(refused.value)


def printed_ranges(message: str) -> dict[str, tuple[float | None, float | None]]:
    found = {}
    for name, up_to, at_least, low, high in RANGE.findall(
        message.split("allowed with the rest unchanged")[-1]
    ):
        start, stop = low or at_least or None, high or up_to or None
        found[name] = (float(start) if start else None, float(stop) if stop else None)
    return found


@pytest.mark.slow
@pytest.mark.parametrize(("values", "name"), BAD_DESIGNS)
def test_the_ranges_that_the_refusal_of_a_design_gives_are_true(values: dict[str, object], name: str) -> None:
    message = message_of(values)
    assert name in printed_ranges(message)
    for parameter, ends in printed_ranges(message).items():
        low, high = parameter_info(parameter, "low"), parameter_info(parameter, "high")
        start, stop = (low if ends[0] is None else ends[0]), (high if ends[1] is None else ends[1])
        whole = parameter in ("rib_count", "marker_count")
        step = 1 if whole else 2 * STEP
        start, stop = (int(start), int(stop)) if whole else (start, stop)
        for value in (start, stop, (start + stop) // 2 if whole else (start + stop) / 2):
            assert obeys(Design.model_construct(**{**values, parameter: value})), (parameter, value)
            assert Design(**{**values, parameter: value}) is not None
        for value in (start - step, stop + step):
            if low <= value <= high:
                assert not obeys(Design.model_construct(**{**values, parameter: value})), (parameter, value)


def test_default_is_the_papers_finger() -> None:
    design = Design()
    assert [getattr(design, SYMBOLS[symbol]) for symbol in ("H", "L", "W", "L_tip", "L_angle", "N")] == [
        90, 30, 20, 20, 20, 4,
    ]  # fmt: skip
    assert [getattr(design, SYMBOLS[symbol]) for symbol in ("t_rib", "t_flex", "t_back")] == [2, 2, 2]
    assert design.contact_abscissa == 35


def test_digest_follows_the_geometry_and_not_the_name() -> None:
    assert Design(name="a").digest == Design(name="b").digest
    assert Design(contact_position=35).digest == Design().digest  # the same place, said explicitly
    changed = {"height": 91, "rib_count": 5, "marker_layout": "front", "contact_width": 3, "depth": 21}
    digests = {Design(**{name: value}).digest for name, value in changed.items()} | {Design().digest}
    assert len(digests) == len(changed) + 1


def test_replaced_is_a_checked_copy() -> None:
    design = Design(name="base")
    assert design.replaced(N=6, H=110) == Design(name="base", rib_count=6, height=110)
    with pytest.raises(UserError, match="ribs"):
        design.replaced(rib_count=40)


def test_when_no_range_mends_even_the_rule_itself_the_message_names_the_parameters() -> None:
    unmendable = Rule(lambda parameters: RuleResult(-1.0, "never right"), ("height", "depth"))
    bad = Parameters.model_construct(tip_length=300, contact_position=500)
    assert advice(bad, unmendable) == "more than one parameter must change; try height, depth"


def test_every_rule_can_fail() -> None:
    rng = np.random.default_rng(1)
    broken = set()
    names = [name for name in Parameters.model_fields if parameter_info(name, "high") != ""]
    for _ in range(200):
        values = {
            name: rng.uniform(parameter_info(name, "low"), parameter_info(name, "high")) for name in names
        }
        values |= {name: int(values[name]) for name in ("rib_count", "marker_count")}
        parameters = Parameters.model_construct(**values, marker_layout=rng.choice(["front", "joints"]))
        broken |= {rule.check.__name__ for rule in RULES if rule.check(parameters).margin < 0}
    assert broken == {rule.check.__name__ for rule in RULES}


def test_advice_never_promises_a_range_that_breaks_another_rule() -> None:
    bad = Parameters.model_construct(height=40, tip_length=45)
    rule = next(rule for rule in RULES if rule.check(bad).margin < 0)
    for name, (start, stop) in printed_ranges(advice(bad, rule)).items():
        for value in (start, stop):
            if value is not None:
                assert obeys(bad.model_copy(update={name: value}))


@pytest.mark.parametrize("name", ["tip_radius", "fillet_radius", "foot_height"])
def test_a_small_rounding_or_foot_is_left_out_or_there(name):
    """Below a hundredth of a millimetre there is nothing to mesh, and far below that lengths underflow."""
    for length in (1e-300, 1e-9, 0.0099):
        with pytest.raises(UserError, match=f"{name} = .*: give 0 to leave it out, or at least 0.01 mm"):
            Design(**{name: length})
    for length in (0.0, 0.01):
        assert getattr(Design(**{name: length}), name) == length
