"""Sobol' indices against closed forms and SciPy's estimator."""

from collections.abc import Callable

import numpy as np
import pytest
from scipy.stats import sobol_indices, uniform

from pinnray.runtime.arrays import FloatArray
from pinnray.studies.sweep.measurement import Measurement
from pinnray.studies.sweep.sampling import samples
from pinnray.studies.sweep.sensitivity import TRUSTED, Sensitivity, sensitivities, sensitivity_grid
from pinnray.studies.sweep.study import Study
from pinnray.studies.sweep.sweep import Sweep

VARIED = {
    "height": {"from": 80, "to": 100},
    "base_width": {"from": 24, "to": 40},
    "rib_thickness": {"from": 1, "to": 2},
}


def found(law: Callable[[FloatArray], FloatArray], count: int = 200) -> Sensitivity:
    """The indices of a law of the three places in the unit cube."""
    study = Study(name="s", samples=count, varied=VARIED)
    every = samples(study)
    low, size = np.array([80, 24, 1]), np.array([20, 16, 1])
    places = (np.array([list(map(float, sample.values())) for sample in every]) - low) / size
    values = law(places.T)
    measured = [Measurement(n, "done", "", 0.0, {"force": float(v)}) for n, v in enumerate(values)]
    return sensitivities(Sweep(study, every, measured), ["force"])["force"]


def test_a_sum_has_shares_of_its_squared_slopes() -> None:
    indices = found(lambda x: 3 * x[0] + 4 * x[1])
    assert list(indices.first.values()) == pytest.approx([9 / 25, 16 / 25, 0], abs=1e-9)
    assert indices.total == pytest.approx(indices.first, abs=1e-9)
    assert indices.explained == pytest.approx(1)


def test_a_product_of_centred_places_acts_only_together() -> None:
    indices = found(lambda x: (x[0] - 0.5) * (x[2] - 0.5))
    assert list(indices.first.values()) == pytest.approx([0, 0, 0], abs=1e-9)
    assert list(indices.total.values()) == pytest.approx([1, 0, 1], abs=1e-9)


def test_a_curved_law_has_the_indices_of_another_estimator() -> None:
    def law(x: FloatArray) -> FloatArray:
        return np.asarray(np.exp(x[0]) * (1 + x[1] ** 2) + 0.3 * np.sin(4 * x[2]))

    indices = found(law, 400)
    other = sobol_indices(func=law, n=4096, dists=[uniform()] * 3, rng=np.random.default_rng(0))
    # Saltelli's estimator with 4,096 points is itself uncertain by about 0.01.
    assert list(indices.first.values()) == pytest.approx(other.first_order.ravel(), abs=0.02)
    assert list(indices.total.values()) == pytest.approx(other.total_order.ravel(), abs=0.02)


def test_noise_is_not_trusted() -> None:
    noise = np.random.default_rng(0).normal(size=200)
    doubtful = found(lambda x: noise)
    assert doubtful.explained < 0.1 < TRUSTED
    assert sensitivity_grid({"force": doubtful}).rows[0][-1].endswith(" *")


def test_the_table_has_both_indices_of_every_parameter() -> None:
    table = sensitivity_grid({"force": found(lambda x: 3 * x[0] + 4 * x[1])})
    assert table.headings == ["quantity", *VARIED, "explained"]
    assert table.rows == [("force", "36 (36)", "64 (64)", "0 (0)", "100.0")]
    assert sensitivity_grid({}).rows == []


def test_a_constant_and_too_few_samples_have_no_indices() -> None:
    with pytest.raises(KeyError):
        found(lambda x: np.full(x.shape[1], 2.0))
    with pytest.raises(KeyError):
        found(lambda x: x[0], 4)
