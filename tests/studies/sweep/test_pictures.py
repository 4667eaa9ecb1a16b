"""Pictures of a sweep: every sample is seen."""

from pathlib import Path

import numpy as np
import pytest
from matplotlib.patches import Rectangle

from pinnray.studies.sweep.measurement import Measurement
from pinnray.studies.sweep.pictures import SHOWN, draw_maps, draw_pairs
from pinnray.studies.sweep.sampling import samples
from pinnray.studies.sweep.study import Range, Study
from pinnray.studies.sweep.sweep import Sweep
from pinnray.studies.sweep.tables import correlation_grid
from tests.compare.figures.drawn_pages import page_of
from tests.studies.sweep.test_sweep import study_file


def swept(folder: Path, count: int) -> Sweep:
    """A sweep of so many fingers with made-up numbers."""
    study = Study.load(study_file(folder, count))
    drawn = samples(study)
    found = [Measurement(n, "done", "fine", 0.1, dict.fromkeys(SHOWN, 1.0 + n)) for n in range(len(drawn))]
    return Sweep(study, drawn, found)


def test_rank_correlations_tell_which_parameter_matters_and_which_way() -> None:
    varied = {"rib_thickness": {"from": 1, "to": 2}, "rib_reference": {"values": ["front", "base"]}}
    study = Study(name="s", samples=64, varied=varied)
    every = samples(study)
    found = [
        Measurement(
            n,
            "done",
            "",
            0.1,
            {"force": each["rib_thickness"] ** 3, "mass": 1.0, "wrap": -len(each["rib_reference"])},
        )
        for n, each in enumerate(every)
    ]
    table = correlation_grid(Sweep(study, every, found), ["force", "wrap", "mass"])
    texts = {name: row for name, *row in table.rows}
    assert (texts["force"][0], texts["wrap"][1]) == ("+1.00", "+1.00")  # base has fewer letters, and is later
    assert abs(float(texts["force"][1])) < 0.1
    assert "mass" not in texts  # it is equal everywhere


@pytest.mark.parametrize("count", [2, 32])
def test_dots_and_ends_of_ranges_are_seen(tmp_path: Path, count: int) -> None:
    page = page_of(draw_pairs(swept(tmp_path, count)))
    for axes in page.figure.axes:
        dots = axes.lines[0]
        assert (dots.get_marker(), dots.get_markersize() >= 1) == ("o", True)
        low, high = axes.get_xlim()
        assert all(low < tick < high for tick in axes.get_xticks())
        assert low < np.min(dots.get_xdata()) <= np.max(dots.get_xdata()) < high
    assert all(end in page.text for end in ("2", "5", "1", "2.5", "0.3"))
    assert (page.cut_off(), page.overlaps()) == ([], [])


def test_a_grid_over_two_parameters_has_maps_with_the_least_value_framed() -> None:
    study = Study(
        name="grid",
        sampling="grid",
        varied={"young": Range(values=(1.0, 3.8)), "rib_count": Range(values=(3, 4, 5))},
    )
    drawn = samples(study)
    found = [Measurement(n, "done", "", 0.1, {"force": 9.0 - n, "wrap": -1.0 * n}) for n in range(5)]
    found.append(Measurement(5, "failed", "its worker process died", 0.1))
    page = page_of(draw_maps(Sweep(study, drawn, found), ("force", "wrap")))
    assert (page.cut_off(), page.overlaps()) == ([], [])
    assert page.text.count("failed") == 2  # one sample, on both maps
    for axes in page.figure.axes:
        frames = [patch for patch in axes.patches if isinstance(patch, Rectangle)]
        assert [frame.get_xy() for frame in frames] == [(0.5, 0.5)]
        assert [label.get_text() for label in axes.get_xticklabels()] == ["1", "3.8"]
    lost = [Measurement(n, "failed", "died", 0.1) for n in range(6)]
    page = page_of(draw_maps(Sweep(study, drawn, lost), ("force",)))
    assert page.text.count("failed") == 6
