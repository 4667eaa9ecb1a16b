"""Folders that keep the finished parts of a job: whose they are, also after a kill at the very beginning."""

import json

import pytest

from pinnray.runtime.atomic import atomic_path
from pinnray.runtime.errors import UserError
from pinnray.runtime.output_folder import check_resumable_folder
from pinnray.studies.sweep import store
from pinnray.studies.sweep.job import StudyJob
from pinnray.studies.sweep.study import Range, Study
from pinnray.studies.sweep.sweep import run_sweep


class Killed(BaseException):
    """The end of the process."""


def test_a_job_killed_while_it_wrote_its_definition_can_go_on(tmp_path):
    with atomic_path(tmp_path / "sweep.json") as partial:
        partial.write_text("whole")
    (tmp_path / "sweep.json").unlink()
    partial.write_text('{"schem')
    check_resumable_folder(tmp_path / "sweep.json", {"schema": 1}, job="sweep")
    (tmp_path / "sweep.json").write_text(json.dumps({"schema": 1}))
    check_resumable_folder(tmp_path / "sweep.json", {"schema": 1}, job="sweep")


def test_a_folder_with_files_of_others_is_refused(tmp_path):
    (tmp_path / "notes.txt").touch()
    with pytest.raises(UserError, match="holds files that are not of a sweep"):
        check_resumable_folder(tmp_path / "sweep.json", {"schema": 1}, job="sweep")


def test_a_sweep_killed_before_its_definition_is_there_leaves_no_file(tmp_path, monkeypatch):
    """A journal without a definition would bar the folder for good."""

    def killed(*_: object) -> None:
        raise Killed

    study = Study(name="ribs", samples=2, varied={"rib_angle": Range(**{"from": 0, "to": 10})})
    monkeypatch.setattr(store, "write_json", killed)
    with pytest.raises(Killed):
        run_sweep(StudyJob(study, tmp_path, tmp_path / "out", 1))
    assert list((tmp_path / "out").iterdir()) == []
