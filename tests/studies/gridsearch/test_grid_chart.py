"""The picture of a grid search."""

from matplotlib.patches import Rectangle

from pinnray.studies.gridsearch.chart import draw_grid
from pinnray.studies.gridsearch.training_run import DIVERGED, TRAINED, GridPoint, TrainingRun
from pinnray.studies.sweep.quantities import TRAINING
from tests.compare.figures.drawn_pages import page_of


def run_of(rate: float, weight: float, distance: float | None) -> TrainingRun:
    if distance is None:
        return TrainingRun(GridPoint(rate, weight), DIVERGED, "loss became nan")
    own = {"rel_l2_displacement": distance, "boundary_violation": distance / 2, "epochs": 2000}
    return TrainingRun(GridPoint(rate, weight), TRAINED, "", {**dict.fromkeys(TRAINING, 1.0), **own})


GRID = [
    run_of(rate, weight, None if rate * weight > 5 else rate + weight / 1e4)
    for rate in (1e-4, 1e-3, 1e-2)
    for weight in (0.1, 1.0, 10.0, 100.0, 1000.0)
]


def test_every_run_has_its_value_and_the_nearest_a_frame() -> None:
    page = page_of(draw_grid(runs=GRID))
    assert (page.cut_off(), page.overlaps()) == ([], [])
    assert page.text.count("diverged") == 2  # one run, on both maps
    assert "0.011" in page.text  # per cent: rate 1e-4, weight 0.1
    assert "2,000 epochs" in page.text
    for axes in page.figure.axes:
        frames = [patch for patch in axes.patches if isinstance(patch, Rectangle)]
        assert [frame.get_xy() for frame in frames] == [(-0.5, -0.5)]
        assert [label.get_text() for label in axes.get_xticklabels()] == ["0.0001", "0.001", "0.01"]
        assert list(axes.get_images()[0].get_array().mask.ravel()).count(True) == 1


def test_a_search_whose_runs_all_diverged_has_a_picture() -> None:
    page = page_of(draw_grid(runs=[run_of(1.0, 10.0, None)]))
    assert page.text.count("diverged") == 2
    assert (page.cut_off(), page.overlaps()) == ([], [])
    assert all(not axes.patches for axes in page.figure.axes)
