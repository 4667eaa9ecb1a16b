"""The samples of a study."""

import numpy as np
import pytest

from pinnray.studies.sweep.sampling import position_of, samples, value_at
from pinnray.studies.sweep.study import Range, Study

VARIED = {
    "rib_count": {"from": 2, "to": 5},
    "height": {"from": 80, "to": 100},
    "plane": {"values": ["strain", "stress"]},
}


def test_a_grid_has_every_combination_once() -> None:
    varied = VARIED | {"height": {"from": 80, "to": 100, "step": 10}}
    grid = samples(Study(name="s", sampling="grid", varied=varied))
    assert len(grid) == 4 * 3 * 2
    assert len({tuple(sample.values()) for sample in grid}) == len(grid)
    assert {sample["height"] for sample in grid} == {80.0, 90.0, 100.0}


def test_a_sobol_sequence_is_continued_by_more_samples() -> None:
    few, many = (samples(Study(name="s", samples=count, varied=VARIED)) for count in (5, 40))
    assert many[:5] == few


def test_whole_numbers_are_equally_frequent() -> None:
    counts = [sample["rib_count"] for sample in samples(Study(name="s", samples=64, varied=VARIED))]
    assert all(isinstance(count, int) for count in counts)
    assert [counts.count(number) for number in (2, 3, 4, 5)] == [16, 16, 16, 16]


def test_another_seed_has_other_samples() -> None:
    one, two = (samples(Study(name="s", samples=8, seed=seed, varied=VARIED)) for seed in (0, 1))
    assert one != two


@pytest.mark.parametrize("place", [0.0, 0.3, 0.999999])
def test_the_place_of_a_value_leads_back_to_it(place: float) -> None:
    for name, entry in VARIED.items():
        values = Range(**entry)
        value = value_at(name, values, place)
        assert value_at(name, values, position_of(name, values, value)) == value
    assert np.isclose(position_of("height", Range(**VARIED["height"]), 95.0), 0.75)


def test_values_with_a_step_are_those_of_a_printer_and_equally_frequent() -> None:
    values = Range(**{"from": 0.8, "to": 1.0, "step": 0.05})
    found = [value_at("rib_thickness", values, place) for place in (np.arange(100) + 0.5) / 100]
    assert sorted(set(found)) == [0.8, 0.85, 0.9, 0.95, 1.0]
    assert {found.count(value) for value in found} == {20}
    assert value_at("rib_thickness", values, position_of("rib_thickness", values, 0.95)) == 0.95
