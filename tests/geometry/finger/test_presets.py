"""Designs by name, from files, and with overrides."""

from pathlib import Path

import pytest

from pinnray.geometry import Design, load_design, parse_overrides, preset_names


@pytest.mark.parametrize("name", preset_names())
def test_preset_is_admissible_and_has_its_file_name(name: str) -> None:
    assert load_design(name).name == name


def test_default_preset_is_the_default_design() -> None:
    assert load_design() == Design()


def test_presets_differ() -> None:
    assert len({load_design(name).digest for name in preset_names()}) == len(preset_names())


def test_overrides_by_name_and_by_symbol() -> None:
    overrides = parse_overrides(["rib_count=6", "H = 110", "contact_position=none", "marker_layout=front"])
    design = load_design("default", overrides)
    assert (design.rib_count, design.height, design.contact_position) == (6, 110.0, None)
    assert design.marker_layout == "front"


def test_override_replaces_what_a_file_says_by_the_other_name(tmp_path: Path) -> None:
    path = tmp_path / "mine.toml"
    path.write_text("H = 100\nrib_count = 5\n")
    design = load_design(path, {"height": 120, "N": "6"})
    assert (design.name, design.height, design.rib_count) == ("mine", 120.0, 6)
    assert load_design(str(path)).height == 100
