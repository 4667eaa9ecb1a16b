"""Questions that are read, and the line for each that is refused."""

from pathlib import Path

import numpy as np
import pytest

from pinnray.studies.optimum.question import Question

GOOD = """
mesh_size = 2.0
runs = 40
[objectives]
wrap = "largest"
force = "least"
[constraints]
von_mises = {at_most = 2.0}
thinnest_wall = {at_least = 0.8, at_most = 3.0}
[varied]
rib_thickness = {from = 0.6, to = 2.5}
"""


def asked(folder: Path, text: str) -> Question:
    path = folder / "ask.toml"
    path.write_text(text, encoding="utf-8")
    return Question.load(path)


def test_costs_are_least_at_the_best(tmp_path: Path) -> None:
    question = asked(tmp_path, GOOD)
    values = {"wrap": 20.0, "force": 3.0, "von_mises": 1.5, "thinnest_wall": 0.7}
    assert question.costs(values) == [-20.0, 3.0]
    assert question.excesses(values) == pytest.approx([-0.5, 0.1])
    assert not question.allows(values)
    assert question.allows(values | {"thinnest_wall": 0.8})
    assert not question.allows(values | {"thinnest_wall": 3.1})
    assert question.samples == 13
    arrays = {name: np.array([value, value]) for name, value in values.items()}
    np.testing.assert_allclose(question.costs(arrays), [[-20.0] * 2, [3.0] * 2])
    np.testing.assert_allclose(question.excesses(arrays), [[-0.5] * 2, [0.1] * 2])


GRIPS = 'objectives = {force = "largest"}\n[varied]\nrib_thickness = {from = 0.6, to = 2.5}\n'


@pytest.mark.parametrize(
    ("text", "solver", "fixed"),
    [
        (GRIPS, "fem-nonlinear", {"load": "cylinder", "friction": 0.5}),
        (f"{GRIPS}[fixed]\nfriction = 0.2\n", "fem-nonlinear", {"load": "cylinder", "friction": 0.2}),
        (f"{GRIPS}friction = {{from = 0, to = 1}}\n", "fem-nonlinear", {"load": "cylinder"}),
        (f'{GRIPS}[fixed]\nload = "mean"\n', "fem", {"load": "mean"}),  # as it was asked
        (f'solver = "fem"\n{GRIPS}', "fem", {}),  # which has no cylinder
        (GOOD, "fem", {}),  # a front
    ],
)
def test_the_best_gripper_grips_a_cylinder_with_friction(tmp_path, text, solver, fixed):
    question = asked(tmp_path, text)
    assert (question.solver, dict(question.fixed)) == (solver, fixed)
