"""The output folder: replaced as a whole or not at all, and only where nothing else would be lost."""

import json
import os
import shutil
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import pytest

from pinnray.runtime.errors import UserError
from pinnray.runtime.output_folder import (
    MARK,
    check_output,
    check_same_job,
    locked,
    replaced_folder,
    take_training,
)


def tree(folder: Path) -> dict[str, str]:
    """Names and texts of all files under a folder, but for the mark of a run."""
    return {
        path.relative_to(folder).as_posix(): path.read_text()
        for path in folder.rglob("*")
        if path.is_file() and path.name != MARK
    }


@pytest.fixture
def out(tmp_path: Path) -> Path:
    """A complete result."""
    folder = tmp_path / "results" / "run"
    (folder / "solutions").mkdir(parents=True)
    (folder / "solutions" / "fem.npz").write_text("old solution")
    (folder / "run.json").write_text(json.dumps({"files_sha256": {"solutions/fem.npz": "0"}}))
    return folder


def write(
    folder: Path, *, solutions: tuple[str, ...] = (), training: str = "", error: BaseException | None = None
) -> None:
    (folder / "report.html").write_text("new report")
    if training:
        (folder / "training" / training).mkdir(parents=True)
        (folder / "training" / training / "checkpoint").write_text("epoch 7")
    for name in solutions:
        (folder / "solutions").mkdir(exist_ok=True)
        (folder / "solutions" / f"{name}.npz").write_text("new solution")
    if error is not None:
        raise error


def attempt(out: Path, *, keep: tuple[str, ...] = (), **what: object) -> None:
    with replaced_folder(out, keep=keep) as folder:
        write(folder, **what)


def test_the_new_folder_takes_the_place_of_the_old_one_or_is_made(out):
    attempt(out)
    assert tree(out.parent) == {"run/report.html": "new report"}
    attempt(out.parent / "a" / "b")
    assert tree(out.parent / "a") == {"b/report.html": "new report"}


@pytest.mark.parametrize("error", [RuntimeError(), KeyboardInterrupt()], ids=["error", "Ctrl-C"])
def test_an_error_leaves_the_old_folder_and_what_was_finished(out, error):
    before = tree(out)
    with pytest.raises(type(error)):
        attempt(out, solutions=("fem",), error=error)
    assert tree(out) == before
    assert tree(out.with_name("run.partial")) == {
        "report.html": "new report",
        "solutions/fem.npz": "new solution",
    }


def test_an_error_before_anything_was_finished_leaves_nothing(tmp_path):
    with pytest.raises(RuntimeError):
        attempt(tmp_path / "a" / "b" / "run", error=RuntimeError())
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("keep", "left"),
    [
        ((), {}),
        (("fem",), {"solutions/fem.npz": "new solution"}),
        (("pinn",), {"solutions/pinn.npz": "new solution", "training/pinn/checkpoint": "epoch 7"}),
    ],
)
def test_only_solutions_and_checkpoints_that_are_asked_for_outlive_an_earlier_attempt(out, keep, left):
    with pytest.raises(KeyboardInterrupt):
        attempt(out, solutions=("fem", "pinn"), training="pinn", error=KeyboardInterrupt())
    (out.with_name("run.partial") / "figures").mkdir()
    with replaced_folder(out, keep=keep) as folder:
        assert tree(folder) == left
        assert not (folder / "figures").exists()


def test_what_a_training_left_is_copied_in_place_of_another(out, tmp_path):
    for folder, text in ((out, "finished"), (tmp_path, "of other settings")):
        (folder / "training" / "pinn-std").mkdir(parents=True)
        (folder / "training" / "pinn-std" / "checkpoint").write_text(text)
    take_training("pinn-std", out, tmp_path)
    assert (tmp_path / "training" / "pinn-std" / "checkpoint").read_text() == "finished"
    take_training("pinn-std", tmp_path, tmp_path)
    take_training("fem", out, tmp_path)
    assert [path.name for path in (tmp_path / "training").iterdir()] == ["pinn-std"]


def test_two_runs_do_not_write_the_same_folder(out):
    with replaced_folder(out) as folder:
        write(folder)
        with pytest.raises(UserError, match=r"another run is writing to .*run\.partial"):
            attempt(out)
        assert tree(folder) == {"report.html": "new report"}


def test_a_result_that_cannot_take_its_place_is_complete_beside_it(out, monkeypatch):
    def busy(self: Path, target: Path) -> None:
        raise OSError(16, "Device or resource busy")  # `out` is a mounted volume

    monkeypatch.setattr(Path, "replace", busy)
    before = tree(out)
    with pytest.raises(
        UserError, match=r"cannot replace .* \(Device or resource busy\); the complete result is in"
    ):
        attempt(out)
    assert tree(out) == before
    assert tree(out.with_name("run.partial")) == {"report.html": "new report"}


def test_a_link_stays_a_link(out):
    link = out.parent.parent / "latest"
    link.symlink_to(out)
    attempt(link)
    assert link.is_symlink()
    assert tree(out) == {"report.html": "new report"}


def test_our_own_result_an_empty_folder_and_none_may_be_replaced(out, tmp_path):
    (tmp_path / "empty").mkdir()
    for folder in (out, tmp_path / "empty", tmp_path / "absent"):
        check_output(folder)


@pytest.mark.parametrize(
    ("spoil", "message"),
    [
        (lambda out: (out / "notes.txt").write_text("mine"), "holds notes.txt, which no run.json"),
        (lambda out: (out / "solutions" / "mine.npz").write_text(""), "holds solutions/mine.npz"),
        (lambda out: (out / "run.json").write_text("{}"), "which no run.json there lists"),  # of others
        (lambda out: (out / "run.json").write_text("[1]"), "which no run.json there lists"),
        (lambda out: (out / "run.json").write_bytes(b"\xff"), "which no run.json there lists"),
        (lambda out: (out / "run.json").write_text('{"files_sha256": {'), "holds run.json, which"),
        (lambda out: (out / "run.json").unlink(), "holds solutions/fem.npz, which"),
    ],
)
def test_what_no_comparison_wrote_is_not_lost(out, spoil, message):
    spoil(out)
    with pytest.raises(UserError, match=message):
        check_output(out)


def test_a_folder_that_no_unfinished_run_has_left_is_not_lost(out):
    """It may be the user's, or the result of a design called `run.partial`."""
    mine = out.with_name("run.partial")
    mine.mkdir()
    (mine / "thesis.tex").write_text("mine")
    with pytest.raises(UserError, match="partial would be replaced, but it is not of an unfinished run"):
        attempt(out)
    assert tree(mine) == {"thesis.tex": "mine"}
    assert (out / "run.json").is_file()


@pytest.mark.parametrize("place", ["solutions", "training", "training/pinn-std"])
def test_a_link_in_an_unfinished_folder_is_not_followed(tmp_path, place):
    """What lay there was removed, and the solutions were written there."""
    mine, partial = tmp_path / "mine", tmp_path / "out.partial"
    mine.mkdir()
    (mine / "thesis.tex").write_text("mine")
    (partial / place).parent.mkdir(parents=True, exist_ok=True)
    (partial / place).symlink_to(mine, target_is_directory=True)
    (partial / MARK).touch()
    attempt(tmp_path / "out", keep=("pinn-std",), solutions=("fem",))
    assert tree(mine) == {"thesis.tex": "mine"}


@pytest.mark.parametrize("inside", [".", "solutions"])
def test_the_folder_that_one_stands_in_is_not_pulled_away(out, monkeypatch, inside):
    monkeypatch.chdir(out / inside)
    with pytest.raises(UserError, match="cannot run inside it"):
        check_output(out)


def test_the_finished_run_of_another_job_is_not_replaced_unasked(out):
    content = json.loads((out / "run.json").read_text())
    (out / "run.json").write_text(json.dumps(content | {"options": {"stroke": 5.0, "set": ["N=4"]}}))
    usual = {"design": "default", "set": []}
    check_same_job(out, {"stroke": 5.0, "set": ("N=4",), "pictures": "pdf", "design": "default"}, usual)
    check_same_job(out.with_name("absent"), {"stroke": 6.0}, usual)
    for other, said in [({"stroke": 5.0}, "set"), ({"set": ["N=4"], "truth": "stvk"}, "stroke, truth")]:
        with pytest.raises(
            UserError, match=rf"finished run of another job \(other {said}\); name another .*run itself "
        ):
            check_same_job(out, other, usual)


class Killed(BaseException):
    """Stands for the end of the process: nothing after it has an effect on files."""


def killed_before(
    change: str, number: int, block: Callable[[], object], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Run a block whose process ends before a change of files of some kind, counted from 1."""
    changes = {name: getattr(os, name) for name in ("unlink", "rename", "replace", "rmdir", "mkdir")}
    done = dict.fromkeys(changes, 0)
    ended = False

    def counted(name: str) -> Callable[..., object]:
        def call(*arguments: object, **named: object) -> object:
            nonlocal ended
            done[name] += 1
            ended = ended or (name == change and done[name] == number)
            if ended:
                raise Killed
            return changes[name](*arguments, **named)

        return call

    with monkeypatch.context() as patched, suppress(Killed):
        for name in changes:
            patched.setattr(os, name, counted(name))
        block()
    assert ended, "the change was not reached"


@pytest.mark.parametrize(
    ("change", "number"),
    [("unlink", 1), ("unlink", 2), ("unlink", 3), ("rmdir", 2)],  # the last leaves an empty folder
)
def test_a_run_that_is_killed_while_it_replaces_a_result_does_not_bar_the_next(
    out, monkeypatch, change, number
):
    """The last result is removed file by file, and its mark must not be among the first."""
    (out / MARK).touch()
    killed_before(change, number, lambda: attempt(out), monkeypatch)
    attempt(out)
    assert tree(out.parent) == {"run/report.html": "new report"}


@pytest.mark.parametrize("number", [1, 2], ids=["first", "second"])
def test_a_kill_at_a_rename_loses_no_result(out, monkeypatch, number):
    """Of the runs that go on, one that fails must not lose the last result either."""
    before = tree(out)
    killed_before("replace", number, lambda: attempt(out), monkeypatch)
    with pytest.raises(RuntimeError):
        attempt(out, error=RuntimeError())
    assert tree(out) == before
    attempt(out)
    assert tree(out.parent) == {"run/report.html": "new report"}


def test_a_rename_that_fails_leaves_both_results(out, monkeypatch):
    before, rename, calls = tree(out), os.rename, []

    def second_fails(source: Path, target: Path) -> None:
        calls.append(target)
        if len(calls) == 2:
            raise OSError(5, "Input/output error")
        rename(source, target)

    def complete() -> None:
        with replaced_folder(out) as folder:
            write(folder)
            (folder / "run.json").write_text(json.dumps({"files_sha256": {"report.html": "0"}}))

    with monkeypatch.context() as patched:
        patched.setattr(os, "replace", second_fails)
        with pytest.raises(UserError, match="cannot replace"):
            complete()
    assert tree(out) == before
    with pytest.raises(UserError, match="not of an unfinished run"):  # the complete result is not lost
        complete()
    attempt(out, keep=("fem",))  # a resumed run goes on from it
    assert tree(out.parent) == {"run/report.html": "new report"}


def test_a_copy_of_a_training_that_is_cut_off_does_not_pass_for_one(out, tmp_path, monkeypatch):
    """Its solver would go on from half a checkpoint."""
    (out / "training" / "pinn-std").mkdir(parents=True)
    (out / "training" / "pinn-std" / "checkpoint").write_text("finished")

    def cut_off(source: Path, target: Path) -> None:
        target.mkdir(parents=True)
        (target / "checkpoint").write_text("fin")
        raise Killed

    with monkeypatch.context() as patched, suppress(Killed):
        patched.setattr(shutil, "copytree", cut_off)
        take_training("pinn-std", out, tmp_path)
    assert not (tmp_path / "training" / "pinn-std").exists()
    take_training("pinn-std", out, tmp_path)
    assert (tmp_path / "training" / "pinn-std" / "checkpoint").read_text() == "finished"


def test_a_folder_that_has_just_got_its_final_name_is_not_locked_as_the_unfinished_one(tmp_path, monkeypatch):
    """The second run opened it under the old name; a third one would make that anew and lock it too."""
    partial, opened = tmp_path / "run.partial", os.open
    partial.mkdir()

    def slow(path: Path, flags: int) -> int:
        handle = opened(path, flags)
        partial.rename(tmp_path / "run")
        partial.mkdir()
        return handle

    monkeypatch.setattr(os, "open", slow)
    with pytest.raises(UserError, match="another run is writing"), locked(partial):
        pass


def test_files_that_a_killed_run_has_half_written_are_removed(tmp_path):
    (tmp_path / "runs").mkdir()
    (tmp_path / "runs" / ".result.0123abcd.partial.json").write_text("{")
    (tmp_path / "notes.partial.txt").write_text("mine")
    with locked(tmp_path):
        assert tree(tmp_path) == {"notes.partial.txt": "mine"}
