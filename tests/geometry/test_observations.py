"""Observations refuse what does not fit together."""

import numpy as np
import pytest

from geometry import Observations, ShapeError, UserError


def observations(**changes: object) -> Observations:
    parts: dict[str, object] = {
        "points": np.zeros((3, 2)),
        "displacements": np.ones((3, 2)),
        "standard_deviations": np.full((3, 2), 0.01),
        "visible": [True, False, True],
        "source": "a test",
        "simulated": True,
        "marker_radius": 0.8,
    }
    return Observations(**{**parts, **changes})  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("changes", "kind", "text"),
    [
        ({"points": np.zeros((2, 2))}, ShapeError, "points"),  # a marker is missing
        ({"displacements": np.zeros((3, 3))}, ShapeError, "displacements"),  # three components
        ({"standard_deviations": np.zeros(3)}, ShapeError, "standard_deviations"),
        ({"standard_deviations": np.full((3, 2), -1.0)}, UserError, "zero or more"),
        ({"standard_deviations": np.full((3, 2), 1e300)}, UserError, "must be 0 or from 1e-12 to 1e"),
        ({"standard_deviations": np.full((3, 2), 1e-300)}, UserError, "must be 0 or from 1e-12 to 1e"),
        ({"displacements": np.ma.masked_less(np.full((3, 2), -1.0), 0)}, UserError, "holds masked values"),
        ({"displacements": np.full((3, 2), 1j)}, UserError, "displacements holds complex numbers"),
        ({"points": [["a", "b"]] * 3}, UserError, "points holds something that is no number"),
        ({"displacements": np.full((3, 2), np.nan)}, UserError, "not finite"),
        ({"marker_radius": -0.1}, UserError, "marker radius must be zero or more, got -0.1"),
        ({"marker_radius": np.nan}, UserError, "marker radius must be zero or more"),
    ],
)
def test_what_does_not_fit_is_refused(changes: dict[str, object], kind: type[UserError], text: str) -> None:
    with pytest.raises(kind, match=text):
        observations(**changes)


def test_no_marker_at_all_is_refused() -> None:
    empty = np.zeros((0, 2))
    with pytest.raises(UserError, match="at least one"):
        observations(points=empty, displacements=empty, standard_deviations=empty, visible=[])


@pytest.mark.parametrize(("simulated", "label"), [(True, "simulated"), (False, "measured")])
def test_label_says_where_the_numbers_come_from(simulated: bool, label: str) -> None:
    found = observations(simulated=simulated)
    assert found.known
    assert found.label == label


def test_markers_that_nobody_saw_are_unknown() -> None:
    hidden = observations(visible=[False] * 3)
    assert not hidden.known
    assert hidden.label == "unknown"
