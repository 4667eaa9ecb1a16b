"""The Gaussian process against scikit-learn's, and its intervals."""

import numpy as np
import pytest
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.gaussian_process.kernels import RBF, WhiteKernel

from pinnray.studies.emulator.gaussian_process import GaussianProcess


def samples(count: int, noise: float) -> tuple[np.ndarray, np.ndarray]:
    random = np.random.default_rng(3)
    inputs = random.normal(size=(count, 2))
    return inputs, np.sin(inputs[:, 0]) + 0.3 * inputs[:, 1] ** 2 + noise * random.normal(size=count)


def test_predictions_are_those_of_scikit_learn() -> None:
    inputs, values = samples(120, 0.01)
    ours = GaussianProcess.fitted(inputs[:80], values[:80])
    kernel = RBF(ours.fit.lengths) + WhiteKernel(ours.fit.noise)
    scaled = (values[:80] - ours.mean) / ours.spread
    theirs = GaussianProcessRegressor(kernel, optimizer=None).fit(inputs[:80], scaled)
    expected = ours.mean + ours.spread * theirs.predict(inputs[80:])
    assert ours.predict(inputs[80:])[0] == pytest.approx(expected, rel=1e-6)


@pytest.mark.parametrize("noise", [0.003, 0.3])
def test_intervals_hold_for_95_percent(noise: float) -> None:
    inputs, values = samples(1200, noise)
    middle, width = (process := GaussianProcess.fitted(inputs[:200], values[:200])).predict(inputs[200:])
    held = np.abs(middle - values[200:]) <= width
    assert 0.90 <= held.mean() <= 0.99  # calibrated on 100 samples: the standard deviation is 0.022
    assert len(process.fit.factor) == 100


@pytest.mark.slow
def test_intervals_of_few_samples_hold_though_many_lengths_fit_them() -> None:
    random = np.random.default_rng(3)
    held = []
    for _ in range(6):
        inputs = random.normal(size=(330, 8))
        values = np.sin(inputs[:, 0]) + 0.5 * inputs[:, 1] * inputs[:, 2] + 0.2 * np.cos(2 * inputs[:, 3])
        middle, width = GaussianProcess.fitted(inputs[:30], values[:30]).predict(inputs[30:])
        held.append(np.mean(np.abs(middle - values[30:]) <= width))
    assert np.mean(held) > 0.9  # 0.72 where the lengths are learnt from the sample that is left out, too


def test_intervals_are_wider_away_from_the_samples() -> None:
    inputs, values = samples(200, 0.003)
    process = GaussianProcess.fitted(inputs, values)
    _, width = process.predict(np.array([[0.0, 0.0], [4.0, 4.0]]))
    assert width[1] > 5 * width[0]


def test_a_constant_is_learnt() -> None:
    inputs, _ = samples(100, 0.0)
    middle, width = GaussianProcess.fitted(inputs, np.full(100, 2.5)).predict(inputs[:3])
    assert middle == pytest.approx(2.5)
    assert np.isfinite(width).all()
