"""Designs: names, symbols, and rules that can fail."""

import numpy as np
import pytest

from pinnray.geometry import Design, UserError
from pinnray.geometry.finger.parameters import SYMBOLS, Parameters, parameter_info
from pinnray.geometry.finger.rules import RULES


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
        broken |= {rule.__name__ for rule in RULES if rule(parameters).margin < 0}
    assert broken == {rule.__name__ for rule in RULES}


@pytest.mark.parametrize("name", ["tip_radius", "fillet_radius", "foot_height"])
def test_a_small_rounding_or_foot_is_left_out_or_there(name):
    """Below a hundredth of a millimetre there is nothing to mesh, and far below that lengths underflow."""
    for length in (1e-300, 1e-9, 0.0099):
        with pytest.raises(UserError, match=f"{name} = .*: give 0 to leave it out, or at least 0.01 mm"):
            Design(**{name: length})
    for length in (0.0, 0.01):
        assert getattr(Design(**{name: length}), name) == length
