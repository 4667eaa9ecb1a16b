"""Pictures that no comparison makes are for a column or page of a journal, with type of 7 points or more."""

import numpy as np
import pytest

import pinnray as pr
from pinnray.comparison.figures.force_charts import draw_force_track
from pinnray.comparison.figures.tensile_test import draw_tensile_test
from pinnray.runtime.figure import COLUMN, PAGE, Figure
from pinnray.solvers.finger_figures import QUANTITIES
from pinnray.solvers.materials import TensileTest, fitted
from pinnray.studies.optimum.pictures import draw_front, draw_front_fingers
from pinnray.studies.optimum.question import Question
from pinnray.studies.optimum.search import Optimum
from pinnray.studies.sweep.measurement import Measurement
from pinnray.studies.sweep.pictures import draw_maps, draw_pairs
from pinnray.studies.sweep.sampling import samples
from pinnray.studies.sweep.study import Range, Study
from pinnray.studies.sweep.sweep import Sweep
from tests.compare.figures.drawn_pages import page_of, printed

WALLS = dict.fromkeys(("rib_thickness", "front_thickness", "back_thickness"), (0.8, 2.5))
RANGES = {
    name: Range.model_validate({"from": low, "to": high})
    for name, (low, high) in {
        "rib_count": (2, 8),
        "rib_angle": (-30, 40),
        "tip_length": (14, 26),
        **WALLS,
    }.items()
}
LIMITS = {"von_mises": {"at_most": 2.0}}
CHOICES = {"young": Range(values=(1.0, 3.8)), "rib_count": Range(values=(3, 4, 5))}


def searched(**ranges: Range) -> Optimum:
    """A search with made-up numbers."""
    question = Question(
        name="q", objectives={"wrap": "largest", "force": "largest"}, varied=ranges, constraints=LIMITS
    )
    drawn = samples(question)
    found = [Measurement(n, "done", "", 0.1, dict.fromkeys(QUANTITIES, 20.0 + n)) for n in range(len(drawn))]
    return Optimum(question, drawn, found, list(range(10, 20)))


def of_a_study(page: float) -> list[Figure]:
    """Those with `--width`."""
    search, grid = searched(**RANGES), Study(name="grid", sampling="grid", varied=CHOICES)
    found = [Measurement(n, "done", "", 0.1, {"force": 9.25 - n, "wrap": -1.125 * n}) for n in range(6)]
    maps = draw_maps(Sweep(grid, samples(grid), found), ("force", "wrap"), page)
    solved = {run: pr.solve("default", "fem", size=3.0) for run in (10, 15, 19)}
    drawn = [draw_front(search, list(solved), page), draw_front_fingers(search, solved, page)]
    return [*drawn, draw_pairs(search, page), maps]


def others() -> list[Figure]:
    """Those for a column, which have more than 7 points on a page, too."""
    strain = np.linspace(0.02, 1.0, 30)
    test = TensileTest(strain, 3 * strain / (1 + strain))
    times = np.linspace(0.0, 3.0, 60)
    track = np.stack([times, 0.9 * times, 1.1 * times], axis=1)
    solution = pr.solve("default", "fem", size=3.0)
    force = draw_force_track(times, track, 35 + track, times, times > 2, depth=20.0)
    drawn = [draw_tensile_test(test, fitted(test)), force, solution.plot("von_mises")]
    return [*drawn, solution.problem.mesh.plot(), pr.Design().plot()]


@pytest.mark.slow
@pytest.mark.parametrize("page", [COLUMN, PAGE])
def test_pictures_of_studies_have_type_that_can_be_read_in_a_journal(page: float) -> None:
    check(of_a_study(page), page)


@pytest.mark.slow
def test_single_pictures_have_type_that_can_be_read_in_a_journal() -> None:
    check(others(), COLUMN)


def check(drawn: list[Figure], width: float) -> None:
    for each in drawn:
        page, (millimetres, smallest) = page_of(each), printed(each)
        assert (page.words[0][0], page.cut_off(), page.overlaps()) == (page.words[0][0], [], [])
        assert millimetres == pytest.approx(25.4 * width, abs=0.01)
        assert smallest >= 7
