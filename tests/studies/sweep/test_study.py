"""Studies that are read, and the line for each that is refused."""

from pathlib import Path
from typing import Any

import pytest

import pinnray as pr
from pinnray.runtime.errors import UserError
from pinnray.studies.sweep.job import StudyJob
from pinnray.studies.sweep.sampling import samples
from pinnray.studies.sweep.study import Study, physics_of

GOOD = 'sampling = "sobol"\nsamples = 4\n[varied]\nrib_thickness = {from = 1, to = 2}\n'


def written(folder: Path, text: str) -> Path:
    path = folder / "mine.toml"
    path.write_text(text, encoding="utf-8")
    return path


def test_a_task_has_the_fixed_and_the_sampled_values(tmp_path: Path) -> None:
    study = Study.load(
        written(tmp_path, GOOD + "[fixed]\nN = 3\nyoung = 5.0\nstroke = 4.0\ndirection = 30\n")
    )
    task = StudyJob(study, tmp_path, tmp_path / "out").task(1, samples(study)[1])
    assert task.definition["rib_count"] == 3
    assert task.definition["rib_thickness"] == samples(study)[1]["rib_thickness"]
    material, load = physics_of(task.physics)
    assert material.young == 5.0
    assert load.displacement == pytest.approx((2.0, -4.0 * 0.75**0.5))


def test_a_design_beside_the_study_is_meant_from_there(tmp_path: Path) -> None:
    (tmp_path / "own.toml").write_text("height = 77\n", encoding="utf-8")
    study = Study.load(written(tmp_path, 'design = "own.toml"\n' + GOOD))
    assert StudyJob(study, tmp_path, tmp_path / "out").task(0, samples(study)[0]).definition["height"] == 77


def test_settings_of_the_solver_are_varied_like_parameters(tmp_path: Path) -> None:
    text = 'sampling = "grid"\n[varied]\n"fem.degree" = {values = [1, 2]}\nrib_count = {values = [3, 4]}\n'
    study = Study.load(written(tmp_path, text))
    tasks = [
        StudyJob(study, tmp_path, tmp_path / "out").task(number, each)
        for number, each in enumerate(samples(study))
    ]
    assert [(task.settings["degree"], task.definition["rib_count"]) for task in tasks] == [
        (1, 3),
        (1, 4),
        (2, 3),
        (2, 4),
    ]


@pytest.mark.parametrize(
    ("solver", "fixed", "message"),
    [
        ("fem-nonlinear", {"law": "gent", "plane": "stress"}, "the gent law is given for plane strain only"),
        ("fem", {"stroke": -5.0}, "stroke = -5 mm is outside its range"),
        ("fem", {"radius": 5.0}, "a radius belongs to the load cylinder"),
        ("pinn-std", {"load": "cylinder", "friction": 0.3}, "pinn-std takes a cylinder without friction"),
    ],
)
def test_what_every_sample_would_be_refused_for_refuses_the_study(
    solver: str, fixed: dict[str, Any], message: str, tmp_path: Path
) -> None:
    """As `pinnray solve` does, and not with a table of no results."""
    with pytest.raises(UserError, match=message):
        pr.sweep({"rib_count": [4]}, solver=solver, size=3, processes=1, out=tmp_path / "sweep", **fixed)
