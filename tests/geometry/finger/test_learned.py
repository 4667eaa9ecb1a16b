"""Knowledge of a finger from its pictures: its file, and what it adds to what was known before."""

import numpy as np
import pytest

from pinnray.geometry.finger.design import Design
from pinnray.geometry.finger.learned import Learned, check_target, read_learned, write_learned
from pinnray.geometry.finger.presets import load_design
from pinnray.runtime.errors import UserError

DRAWN = np.array([2.0, 0.45]), np.array([0.1, 0.03])


def learned_from(rows: np.ndarray) -> Learned:
    """From observations of deviation one with these sensitivities, (n, 2), that are as far off as three."""
    before = np.diag(DRAWN[1] ** -2.0)
    covariance = np.linalg.inv(rows.T @ rows + before)
    mean = covariance @ (rows.T @ np.full(len(rows), 3.0) + before @ DRAWN[0])
    deviation = np.sqrt(np.diagonal(covariance))
    return Learned(
        pictures=2,
        weighed=1,
        unknowns=("front_thickness", "poisson"),
        mean=mean.tolist(),
        deviation=deviation.tolist(),
        drawn_mean=DRAWN[0].tolist(),
        drawn_deviation=DRAWN[1].tolist(),
        correlation=(covariance / np.outer(deviation, deviation)).tolist(),
    )


def test_the_information_is_that_of_the_observations_alone():
    rows = np.array([[3.0, 20.0], [-1.0, 40.0], [5.0, 1.0]])
    precision, pull = learned_from(rows).information(["front_thickness", "poisson"])
    np.testing.assert_allclose(precision, rows.T @ rows, rtol=1e-5)
    np.testing.assert_allclose(pull, rows.T @ np.full(3, 3.0), rtol=1e-4)


def test_a_design_file_keeps_it_and_the_design(tmp_path):
    learned, design = learned_from(np.array([[3.0, 20.0]])), Design(rib_count=5, height=100)
    write_learned(tmp_path / "mine.toml", learned, design.lines())
    found = read_learned(tmp_path / "mine.toml")
    assert found is not None
    assert found.unknowns == learned.unknowns
    assert (found.pictures, found.weighed) == (2, 1)
    np.testing.assert_allclose(found.correlation, learned.correlation, atol=1e-8)
    assert load_design(tmp_path / "mine.toml") == design.replaced(name="mine")
    assert read_learned(tmp_path / "another.toml") is None
    check_target(tmp_path / "mine.toml")  # may be learned on
    (tmp_path / "own.toml").write_text("height = 95\n")
    with pytest.raises(UserError, match="it holds a finger of which nothing was learned"):
        check_target(tmp_path / "own.toml")


@pytest.mark.parametrize(
    ("name", "value", "said"),
    [
        ("mean", (2.0,), "mean has 1 values for 2 unknowns"),
        ("deviation", (0.1, 0.0), "deviations are above zero"),
        ("correlation", ((1.0, 2.0), (2.0, 1.0)), "without negative eigenvalues"),
        ("correlation", ((2.0, 0.0), (0.0, 2.0)), "the diagonal of correlation is one"),
    ],
)
def test_a_table_that_cannot_be_is_refused(name, value, said):
    whole = learned_from(np.array([[3.0, 20.0]])).model_dump()
    with pytest.raises(UserError, match=said):
        Learned(**whole | {name: value})
