"""A sweep as a whole: nothing lost, nothing twice, failures told, and the command."""

import shutil
import sqlite3
from dataclasses import replace
from pathlib import Path
from typing import Any

import pandas as pd
import pytest

from pinnray.cli import main
from pinnray.geometry.cache import cad_files
from pinnray.geometry.drawing.load import finger_from_file
from pinnray.geometry.finger.design import Design
from pinnray.runtime.errors import UserError
from pinnray.solvers.solution import Solution
from pinnray.studies.sweep.job import StudyJob
from pinnray.studies.sweep.measurement import Measurement, measured
from pinnray.studies.sweep.quantities import quantities
from pinnray.studies.sweep.sampling import samples
from pinnray.studies.sweep.store import JOURNAL, opened
from pinnray.studies.sweep.study import Study
from pinnray.studies.sweep.sweep import Sweep, load_sweep, run_sweep
from pinnray.studies.sweep.tables import failure_grid, sample_table
from tests.conftest import inline
from tests.studies.sweep.workers import answered, die_at_one, hang_at_one

STUDY = """
mesh_size = 2.0
sampling = "sobol"
samples = {samples}
[fixed]
marker_diameter = 0.4
[varied]
rib_count = {{from = 2, to = 5}}
rib_thickness = {{from = 1.0, to = 2.5}}
front_thickness = {{from = 0.3, to = 2.0}}
"""


def study_file(folder: Path, count: int) -> Path:
    path = folder / "ribs.toml"
    path.write_text(STUDY.format(samples=count), encoding="utf-8")
    return path


def test_a_sample_is_kept_once(tmp_path: Path) -> None:
    with opened(tmp_path / JOURNAL) as journal:
        journal.add(Measurement(3, "done", "fine", 0.1, {"force": 1.5}))
    with opened(tmp_path / JOURNAL) as journal:
        assert journal.numbers() == {3}
        assert journal.measurements() == [Measurement(3, "done", "fine", 0.1, {"force": 1.5})]
        with pytest.raises(sqlite3.IntegrityError):
            journal.add(Measurement(3, "done", "again", 0.1))


def test_what_goes_wrong_with_a_sample_is_its_answer(tmp_path: Path) -> None:
    study = Study.load(study_file(tmp_path, 1))
    job = StudyJob(study, tmp_path, tmp_path / "out")
    refused = measured(job.task(0, {"rib_count": 30, "rib_thickness": 2.5, "front_thickness": 1.0}))
    assert (refused.state, refused.values) == ("refused", {})
    assert "ribs" in refused.message
    task = job.task(1, {"rib_count": 2, "rib_thickness": 2.0, "front_thickness": 1.0})
    assert measured(task).state == "done"
    pressed = measured(replace(task, physics={**task.physics, "stroke": 60.0}))
    assert (pressed.state, pressed.through_itself) == ("done", True)
    soft = measured(replace(task, physics={**task.physics, "stroke": 0.001}))
    assert "this looks like metres" in soft.message
    remarks = Sweep(study, [{}] * 2, [pressed, replace(soft, number=0)]).remarks
    assert [remark.partition(";")[0] for remark in remarks] == [
        "1 of 2 samples (1): THE BODY GOES THROUGH ITSELF",
        "1 of 2 samples (0): this looks like",
    ]
    object.__setattr__(task, "mesh", "broken")
    assert measured(task).state in ("refused", "failed")


def test_a_quantity_that_is_no_number_is_no_result(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Statistics leave out what is no number: a sample that should have one must not be among them."""

    def without_stress(*given: Any, **named: Any) -> tuple[Solution, dict[str, float]]:
        solution, values = quantities(*given, **named)
        return solution, {**values, "von_mises": float("nan")}

    monkeypatch.setattr("pinnray.studies.sweep.measurement.quantities", without_stress)
    sample = {"rib_count": 2, "rib_thickness": 2.0, "front_thickness": 1.0}
    found = measured(
        StudyJob(Study.load(study_file(tmp_path, 1)), tmp_path, tmp_path / "out").task(1, sample)
    )
    assert (found.state, found.message.partition(";")[0]) == ("not converged", "von_mises cannot be computed")


@pytest.fixture(scope="module")
def swept(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a sweep of six samples."""
    folder = tmp_path_factory.mktemp("sweep")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("pinnray.runtime.processes.pool.Pool.answers", inline)
        assert main(["sweep", str(study_file(folder, 6)), "--out", str(folder / "out")]) == 0
    return folder


def test_every_sample_is_kept(swept: Path) -> None:
    sweep = load_sweep(swept / "out")
    assert [each.number for each in sweep.measurements] == list(range(6))
    assert {each.state for each in sweep.measurements} == {"done"}


def test_the_tables_have_a_row_for_each_sample(swept: Path) -> None:
    frame = pd.read_parquet(swept / "out" / "samples.parquet")
    again = pd.read_csv(swept / "out" / "samples.csv")
    assert list(frame.columns) == list(again.columns)
    assert {"rib_thickness_mm", "force_N", "wrap_deg", "compliance_across_mm_per_N"} <= set(frame.columns)
    assert (frame["force_N"] == again["force_N"]).all()
    assert list(frame["sample"]) == list(range(6))


def test_the_page_has_pictures_and_every_quantity(swept: Path) -> None:
    page = (swept / "out" / "sweep.html").read_text(encoding="utf-8")
    assert page.count("<img alt=") == 1
    assert "Which parameter matters" in page
    assert "6 of 6 samples of a Sobol sequence were run; 6 have a converged result" in page
    assert "compliance_across" in page


def test_a_second_start_goes_on_and_does_nothing_twice(swept, tmp_path, in_line):
    out = tmp_path / "out"
    shutil.copytree(swept / "out", out)
    before = load_sweep(out).measurements
    study = Study.load(study_file(tmp_path, 8))
    study = study.model_copy(update={"name": "ribs"})
    after = run_sweep(StudyJob(study, tmp_path, out, 1)).measurements
    assert after[:6] == before
    assert [each.number for each in after] == list(range(8))
    assert "failed" not in {each.state for each in after}


def test_another_name_or_marker_does_the_same_study(swept: Path, tmp_path: Path) -> None:
    """Nothing of a result depends on them."""
    out = tmp_path / "out"
    shutil.copytree(swept / "out", out)
    study = Study.load(study_file(tmp_path, 6))
    fixed = {**study.fixed, "marker_diameter": 0.3, "marker_height": 0.2}
    study = study.model_copy(update={"name": "renamed", "fixed": fixed, "time_limit": 100.0})
    after = run_sweep(StudyJob(study, tmp_path, out, 1)).measurements
    assert after == load_sweep(swept / "out").measurements


@pytest.mark.slow
@pytest.mark.parametrize(
    ("ending", "limit", "state", "said"),
    [
        pytest.param(
            *(hang_at_one, 8.0, "not converged", "stopped at the time limit"), marks=pytest.mark.slow
        ),
        (die_at_one, 500.0, "failed", "its worker process died"),
    ],
)
def test_a_worker_that_hangs_or_dies_costs_its_own_sample_alone(
    tmp_path, monkeypatch, request, ending, limit, state, said
):
    monkeypatch.setattr("pinnray.studies.sweep.sweep.sampled", ending)
    monkeypatch.setattr("pinnray.studies.sweep.sweep.GRACE_S", 1.0)
    monkeypatch.setattr("pinnray.studies.sweep.sweep.DEATHS", 2)
    study = Study.load(study_file(tmp_path, 3)).model_copy(update={"time_limit": limit})
    sweep = run_sweep(StudyJob(study, tmp_path, tmp_path / "out", 1))
    assert [each.state for each in sweep.measurements] == ["done", state, "done"]
    assert [(row[0], row[2]) for row in failure_grid(sweep).rows] == [(state, said)]
    assert list(sample_table(sweep)["state"]) == ["done", state, "done"]
    monkeypatch.setattr("pinnray.studies.sweep.sweep.sampled", answered)
    request.getfixturevalue("in_line")
    longer = study.model_copy(update={"time_limit": 600.0})
    again = run_sweep(StudyJob(longer, tmp_path, tmp_path / "out", 1))
    assert {each.state for each in again.measurements} == {"done"}


def test_another_study_in_the_folder_is_refused(swept, tmp_path, capsys):
    path = tmp_path / "ribs.toml"
    path.write_text(STUDY.format(samples=6).replace("mesh_size = 2.0", "mesh_size = 1.9"), encoding="utf-8")
    assert main(["sweep", str(path), "--out", str(swept / "out")]) == 2
    assert "holds a sweep with other settings (study.mesh_size)" in capsys.readouterr().err


def test_material_and_load_of_a_drawn_finger_are_varied(tmp_path: Path) -> None:
    cad_files(Design(), tmp_path, formats=["dxf"])
    drawn = finger_from_file(tmp_path / "section.dxf")
    study = Study(name="s", mesh_size=4.0, sampling="grid", varied={"young": {"values": [5.0, 10.0]}})
    job = StudyJob(study, tmp_path, tmp_path / "out", finger=drawn)
    soft, hard = (measured(job.task(number, sample)) for number, sample in enumerate(samples(study)))
    assert soft.values["area"] == pytest.approx(Design().section.area, rel=1e-6)
    assert hard.values["force"] == pytest.approx(2 * soft.values["force"], rel=1e-9)
    with pytest.raises(UserError, match="of a drawn finger a study changes material and load, not depth"):
        job.task(0, {"depth": 10.0})
