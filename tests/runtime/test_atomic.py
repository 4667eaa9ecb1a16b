import errno
import os
from pathlib import Path

import numpy as np
import pytest

from pinnray.runtime.atomic import atomic_path, remove_partials, write_arrays, write_text


def test_the_new_file_is_on_the_disk_before_it_takes_the_name(tmp_path, monkeypatch):
    """A power cut after a rename alone may leave an empty file under the final name."""
    path, synced = tmp_path / "table.csv", []
    path.write_text("old")
    sync, replace = os.fsync, os.replace
    monkeypatch.setattr(os, "fsync", lambda file: (synced.append(os.fstat(file).st_ino), sync(file)))

    def watched(source: Path, target: Path) -> None:
        assert synced == [source.stat().st_ino]
        assert (source.read_text(), path.read_text()) == ("new", "old")
        replace(source, target)

    monkeypatch.setattr(os, "replace", watched)
    write_text(path, "new")
    assert path.read_text() == "new"


def test_a_disk_that_fails_late_leaves_the_old_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A network disk may only then say that it is full."""
    path = tmp_path / "table.csv"
    path.write_text("old")

    def full(_: int) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(OSError, match="No space") as error:
        write_text(path, "new")
    assert error.value.filename == str(path)
    assert [(entry.name, entry.read_text()) for entry in tmp_path.iterdir()] == [("table.csv", "old")]


def test_folders_are_made_and_the_suffix_is_kept_for_writers_that_look_at_it(tmp_path: Path) -> None:
    with atomic_path(tmp_path / "fields" / "fem.vtu") as partial:
        assert partial.suffix == ".vtu"
        partial.write_text("fields")
    assert (tmp_path / "fields" / "fem.vtu").exists()


def test_a_writer_that_leaves_nothing_is_an_error_and_the_old_file_stays(tmp_path: Path) -> None:
    """As VTK's does on a full disk."""
    path = tmp_path / "fields.vtu"
    path.write_text("old")
    with (
        pytest.raises(OSError, match="nothing was written; is the disk full") as error,
        atomic_path(path) as part,
    ):
        part.touch()
    assert error.value.filename == str(path)
    assert [entry.read_text() for entry in tmp_path.iterdir()] == ["old"]


@pytest.mark.parametrize(
    "write",
    [
        lambda path: write_text(path, "new" * 2000),
        lambda path: write_arrays(path, {"noise": np.random.default_rng(0).random(9000)}),
    ],
    ids=["text", "arrays"],
)
def test_a_full_disk_names_the_file_and_leaves_the_old_one(write, tmp_path, full_disk):
    path = tmp_path / "table.csv"
    path.touch()
    with pytest.raises(OSError, match="File too large") as error:
        write(path)
    assert (error.value.errno, error.value.filename) == (errno.EFBIG, str(path))
    assert list(tmp_path.iterdir()) == [path]


def test_two_processes_of_one_number_do_not_write_the_same_file(tmp_path: Path) -> None:
    """As those of two containers, each with numbers of its own, on one volume."""
    path = tmp_path / "mesh.npz"
    with atomic_path(path) as ours, atomic_path(path) as theirs:
        assert ours != theirs
        ours.write_text("ours")
        theirs.write_text("theirs")
    assert path.read_text() == "ours"


def test_a_file_that_another_process_may_still_be_writing_is_left(tmp_path: Path) -> None:
    with atomic_path(tmp_path / "mesh.npz") as partial:
        partial.write_text("half")
        remove_partials(tmp_path, older_than_s=60)
        assert partial.exists()
        remove_partials(tmp_path)
        assert not partial.exists()
        partial.write_text("whole")
