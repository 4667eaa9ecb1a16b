"""Studies that are read, and the line for each that is refused."""

from pathlib import Path

import pytest

from geometry.errors import UserError
from studies.sweep.job import StudyJob
from studies.sweep.sampling import samples
from studies.sweep.study import load_study, physics_of

GOOD = 'sampling = "sobol"\nsamples = 4\n[varied]\nrib_thickness = {from = 1, to = 2}\n'


def written(folder: Path, text: str) -> Path:
    path = folder / "mine.toml"
    path.write_text(text, encoding="utf-8")
    return path


REFUSED = {
    "no parameter": ("samples = 4\n", r"nothing is varied; give a table \[varied\]"),
    "an empty table": ("samples = 4\n[varied]\n", r"nothing is varied; give a table \[varied\]"),
    "another word for an end": (
        "samples = 4\n[varied]\nheight = {min = 80, to = 90}\n",
        r"varied.height: unknown key 'min'; did you mean from\?",
    ),
    "a key that no range has": (
        "samples = 4\n[varied]\nheight = {from = 80, to = 90, scale = 2}\n",
        "varied.height: unknown key 'scale'; there are from, to, step, count, values",
    ),
    "a step beyond the range": (
        "samples = 4\n[varied]\nheight = {from = 80, to = 90, step = 20}\n",
        "step = 20 must be shorter than the range",
    ),
    "unknown parameter": (
        "samples = 4\n[varied]\nrib_thick = {from = 1, to = 2}\n",
        r"unknown parameter 'rib_thick'; did you mean rib_thickness",
    ),
    "ends in the wrong order": (
        "samples = 4\n[varied]\nheight = {from = 90, to = 80}\n",
        "varied.height: from = 90 must be below to = 80",
    ),
    "an end that is no number": (
        "samples = 4\n[varied]\nheight = {from = nan, to = 80}\n",
        "varied.height: from = nan is not a finite number",
    ),
    "an end that is a text": (
        'samples = 4\n[varied]\nheight = {from = 80, to = "90 mm"}\n',
        "varied.height: to = '90 mm' is not a finite number",
    ),
    "no table": ("samples = 4\n[varied]\nheight = 90\n", r"varied.height: write \{from = LOW, to = HIGH\}"),
    "beyond the parameter's own limits": (
        "samples = 4\n[varied]\nheight = {from = 5, to = 80}\n",
        "height = 5 is outside its range, 10 to 500 mm",
    ),
    "ends and values": (
        "samples = 4\n[varied]\nheight = {from = 50, to = 80, values = [60]}\n",
        "give either values, or from and to",
    ),
    "half a rib": ("samples = 4\n[varied]\nN = {from = 2.5, to = 4}\n", "rib_count is a whole number"),
    "fixed and varied": (GOOD + "[fixed]\nt_rib = 2.0\n", "rib_thickness is both fixed and varied"),
    "no number of samples": ("[varied]\nheight = {from = 80, to = 90}\n", "give the number of samples"),
    "grid with samples": (
        GOOD.replace("sobol", "grid").replace("}", ", count = 2}"),
        "a grid has no samples to choose",
    ),
    "grid without counts": (
        'sampling = "grid"\n[varied]\nheight = {from = 80, to = 90}\n',
        "height: a grid needs the number of values",
    ),
    "texts between two numbers": (
        "samples = 4\n[varied]\nlaw = {from = 1, to = 2}\n",
        "law has no numbers between two others",
    ),
    "solver that needs markers": ('solver = "fem-asm"\n' + GOOD, "fem-asm needs measured markers"),
    "unknown solver": ('solver = "fme"\n' + GOOD, "fme"),
    "unknown key": ("sample = 3\n" + GOOD, "unknown parameter 'sample'; did you mean samples"),
    "drawing's ribs": (
        'samples = 4\n[fixed]\nsection = "a.dxf"\n[varied]\nrib_count = {from = 2, to = 4}\n',
        "rib_count: of a drawing a study changes depth",
    ),
    "no elements": ("mesh_size = 0\n" + GOOD, "mesh_size = 0 mm is outside its range, 0.02 to 20 mm"),
    "no samples": (GOOD.replace("= 4", "= 0"), "samples = 0 is outside its range, 1 to 1e"),
    "negative seed": ("seed = -1\n" + GOOD, "seed = -1 is outside its range"),
    "unknown sampling": (GOOD.replace("sobol", "random"), "sampling"),
    "not TOML": ("samples = [", "cannot read the study"),
}


@pytest.mark.parametrize(("text", "message"), REFUSED.values(), ids=REFUSED)
def test_a_wrong_study_is_refused_in_one_line(tmp_path: Path, text: str, message: str) -> None:
    with pytest.raises(UserError, match=message) as error:
        load_study(written(tmp_path, text))
    assert "\n" not in str(error.value)


def test_a_load_that_the_solver_does_not_take_is_refused(tmp_path: Path) -> None:
    study = load_study(written(tmp_path, GOOD + '[fixed]\nload = "cylinder"\n'))
    with pytest.raises(UserError, match="fem takes the loads mean, point, patch, not 'cylinder'"):
        StudyJob(study, tmp_path, tmp_path / "out").task(0, samples(study)[0])


def test_a_task_has_the_fixed_and_the_sampled_values(tmp_path: Path) -> None:
    study = load_study(
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
    study = load_study(written(tmp_path, 'design = "own.toml"\n' + GOOD))
    assert StudyJob(study, tmp_path, tmp_path / "out").task(0, samples(study)[0]).definition["height"] == 77


def test_settings_of_the_solver_are_varied_like_parameters(tmp_path: Path) -> None:
    text = 'sampling = "grid"\n[varied]\n"fem.degree" = {values = [1, 2]}\nrib_count = {values = [3, 4]}\n'
    study = load_study(written(tmp_path, text))
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


def test_a_setting_that_the_solver_does_not_have_is_refused(tmp_path: Path) -> None:
    text = 'sampling = "grid"\n[varied]\n"fem.degrees" = {values = [1, 2]}\n'
    with pytest.raises(UserError, match="fem has no setting 'degrees'; it has"):
        load_study(written(tmp_path, text))
