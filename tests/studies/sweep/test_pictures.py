"""Pictures of a sweep: every sample is seen, and no finger twice."""

from pathlib import Path

import numpy as np
import pytest

from pinnray.studies.sweep.job import StudyJob
from pinnray.studies.sweep.measurement import Measurement
from pinnray.studies.sweep.pictures import SHOWN, draw_fingers, draw_pairs
from pinnray.studies.sweep.sampling import samples
from pinnray.studies.sweep.study import Study, load_study
from pinnray.studies.sweep.sweep import Sweep
from tests.compare.figures.drawn_pages import page_of
from tests.studies.sweep.test_sweep import study_file


def swept(folder: Path, count: int) -> tuple[Sweep, StudyJob[Study]]:
    """A sweep of so many fingers with made-up numbers."""
    study = load_study(study_file(folder, count))
    drawn = samples(study)
    found = [Measurement(n, "done", "fine", 0.1, dict.fromkeys(SHOWN, 1.0 + n)) for n in range(len(drawn))]
    return Sweep(study, drawn, found), StudyJob(study, folder, folder / "out")


@pytest.mark.parametrize("count", [2, 32])
def test_dots_and_ends_of_ranges_are_seen(tmp_path: Path, count: int) -> None:
    page = page_of(draw_pairs(swept(tmp_path, count)[0]))
    for axes in page.figure.axes:
        dots = axes.lines[0]
        assert (dots.get_marker(), dots.get_markersize() >= 1) == ("o", True)
        low, high = axes.get_xlim()
        assert all(low < tick < high for tick in axes.get_xticks())
        assert low < np.min(dots.get_xdata()) <= np.max(dots.get_xdata()) < high
    assert all(end in page.text for end in ("2", "5", "1", "2.5", "0.3"))
    assert (page.cut_off(), page.overlaps()) == ([], [])


@pytest.mark.parametrize("count", [2, 4])
def test_of_two_fingers_none_is_drawn_twice(tmp_path: Path, count: int) -> None:
    sweep, job = swept(tmp_path, count)
    page = page_of(draw_fingers(sweep, job))
    assert ("median" in page.text) == (count > 2)
    rows = 4
    assert len(page.figure.axes) == rows * min(count, 3)
    assert page.cut_off() == []
