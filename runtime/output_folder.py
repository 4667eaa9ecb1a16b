"""The output folder: one complete result, the last or the new one; or the finished parts of a long job.

A run writes into `NAME.partial`, which carries a mark and replaces the output folder `NAME` at the end. A
killed run leaves there its finished solutions and the checkpoints of the solver in training, from which a
resumed run goes on.
"""

import fcntl
import json
import os
import shutil
from collections.abc import Collection, Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from pydantic_core import to_jsonable_python

from pinnray.runtime.atomic import is_partial, remove_partials, write_json
from pinnray.runtime.content_hash import file_digest
from pinnray.runtime.errors import UserError

RUN_FILE = "run.json"
SCHEMA = 1
"""Version of the form of `run.json`."""
MARK = ".pinnray-unfinished"
"""File in a folder that a run works in or removes; another folder is never replaced."""
WITHOUT_NUMBERS = ("pictures", "width", "yes")
"""Options of a run that change no number."""
SOLUTIONS = "solutions"
TRAINING = "training"


def check_output(out: Path) -> None:
    """Raise a `UserError` if the folder must not be replaced."""
    if out.is_symlink() and not out.exists():
        raise UserError(f"{out} is a link that leads nowhere; name an output folder")
    if out.exists() and not out.is_dir():
        raise UserError(f"{out} is a file; name an output folder")
    if Path.cwd().is_relative_to(out.resolve()):
        raise UserError(
            f"{out} is replaced as a whole: the program cannot run inside it; name another folder"
        )
    ours = _written(out)
    files = sorted(path.relative_to(out).as_posix() for path in out.rglob("[!.]*") if not path.is_dir())
    if foreign := next((name for name in files if name not in ours), None):
        raise UserError(
            f"{out} holds {foreign}, which no {RUN_FILE} there lists and which would be lost; move it, or "
            "name another output folder"
        )


def check_same_job(out: Path, options: Mapping[str, Any], usual: Mapping[str, Any]) -> None:
    """Refuse a folder that holds the finished run of other options, where nobody has asked for that folder.

    Args:
        out: The folder.
        options: Those of this run, by their names, as `run.json` has them.
        usual: Values of those that are not given.

    Raises:
        UserError: With the options that differ.
    """
    before = {**usual, **_provenance(out).get("options", {})}
    now = {**usual, **to_jsonable_python(options)}
    names = sorted(name for name in before | now if before.get(name) != now.get(name))
    if _written(out) and (names := [name for name in names if name not in WITHOUT_NUMBERS]):
        raise UserError(
            f"{out} holds the finished run of another job (other {', '.join(names)}); name "
            f"another output folder, or {out} itself to replace it"
        )


@contextmanager
def replaced_folder(out: Path, *, keep: Collection[str] = ()) -> Iterator[Path]:
    """A folder that takes the place of `out` when the block ends without an error.

    Args:
        out: The output folder.
        keep: Names of the solvers whose solutions and checkpoints of a killed run are kept.

    Raises:
        UserError: If the folder cannot be written, or another run is writing it.
    """
    out = out.resolve()
    partial, previous = out.with_name(f"{out.name}.partial"), out.with_name(f".{out.name}.pinnray-previous")
    missing = [folder for folder in partial.parents if not folder.exists()]
    try:
        partial.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise UserError(f"cannot write to {partial}: {error.strerror}") from None
    with locked(partial):
        ours = (partial / MARK).exists() or (keep and _is_whole(partial))
        if not ours and any(partial.iterdir()):
            raise UserError(
                f"{partial} would be replaced, but it is not of an unfinished run; move it, or name another "
                "folder"
            )
        (partial / MARK).touch()
        if not out.exists() and previous.exists():  # a run was killed between the two renames
            previous.replace(out)
        _clear(partial, keep)
        try:
            yield partial
        except BaseException:
            if not any([*partial.glob(f"{SOLUTIONS}/*.npz"), *partial.glob(f"{TRAINING}/*/*")]):
                with suppress(OSError):
                    _clear(partial, keep=())
                    shutil.rmtree(partial)  # the mark goes last, so that what a kill leaves is known
                    for folder in missing:
                        folder.rmdir()
            raise
        _take_place(partial, out, previous)


def write_run(folder: Path, provenance: Mapping[str, Any]) -> None:
    """Write `run.json`: the provenance, and the SHA-256 of every other file."""
    files = {
        path.relative_to(folder).as_posix(): file_digest(path)
        for path in sorted(folder.rglob("*"))
        if path.is_file() and path.name not in (RUN_FILE, MARK)
    }
    write_json(folder / RUN_FILE, {"schema": SCHEMA, **provenance, "files_sha256": files})


def take_training(name: str, source: Path, target: Path) -> None:
    """Copy a solver's checkpoints from one output folder to another, replacing those there."""
    left, place = source / TRAINING / name, target / TRAINING / name
    if left != place:
        shutil.rmtree(place, ignore_errors=True)
        if left.is_dir():
            copy = place.with_name(f".{name}.copy")  # whole or not there, whenever the process is killed
            shutil.rmtree(copy, ignore_errors=True)
            shutil.copytree(left, copy)
            copy.replace(place)


def _take_place(partial: Path, out: Path, previous: Path) -> None:
    """Replace the output folder, which has another name until the new one has its own."""
    shutil.rmtree(previous, ignore_errors=True)  # of a run that was killed right here
    try:
        if out.exists():
            out.replace(previous)
        partial.replace(out)
    except OSError as error:
        with suppress(OSError):
            (partial / MARK).unlink()  # no later run may clear it
            if previous.exists():
                previous.replace(out)
        raise UserError(
            f"cannot replace {out} ({error.strerror}); the complete result is in {partial}"
        ) from None
    with suppress(OSError):  # what is left does no harm
        (out / MARK).unlink()
    shutil.rmtree(previous, ignore_errors=True)


def _written(out: Path) -> set[str]:
    """The files that `run.json` lists, and itself; none if it is missing or damaged."""
    files = _provenance(out).get("files_sha256")
    return {RUN_FILE, *files} if isinstance(files, dict) else set()


def _provenance(out: Path) -> dict[str, Any]:
    """The content of `run.json`; nothing if it is missing or damaged."""
    try:
        content = json.loads((out / RUN_FILE).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}
    return content if isinstance(content, dict) else {}


def _is_whole(folder: Path) -> bool:
    """Whether a folder has a `run.json` and every file that it lists."""
    return all((folder / name).is_file() for name in _written(folder) or {RUN_FILE})


def _clear(folder: Path, keep: Collection[str]) -> None:
    """Remove everything but the mark, and the solutions and checkpoints of solvers to keep."""
    kept = {folder / MARK, *(folder / TRAINING / name for name in keep)}
    kept |= {folder / SOLUTIONS / f"{name}.npz" for name in keep}
    kept = {path for path in kept | {path.parent for path in kept} if not path.is_symlink()}
    for pattern in ("*", f"{SOLUTIONS}/*", f"{TRAINING}/*"):
        for path in {*folder.glob(pattern)} - kept:
            if path.is_dir() and not path.is_symlink():
                shutil.rmtree(path)
            else:
                path.unlink()


@contextmanager
def locked(folder: Path) -> Iterator[None]:
    """Lock the folder against a second run; the lock ends with the process.

    Files that a killed run has half written are removed.
    """
    busy = UserError(f"another run is writing to {folder}; wait for it, or name another output folder")
    handle = os.open(folder, os.O_RDONLY)
    try:
        with suppress(OSError):  # some network file systems have no locks
            try:
                fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                raise busy from None
        if not folder.exists() or not os.path.samestat(os.fstat(handle), folder.stat()):
            raise busy  # it has just given the folder its final name
        remove_partials(folder)
        yield
    finally:
        os.close(handle)


def check_resumable_folder(
    file: Path, definition: Mapping[str, Any], *, job: str, free: Collection[str] = ()
) -> dict[str, Any]:
    """Refuse a folder that holds a job with another definition, or something else.

    Args:
        file: The definition of the job in the folder, if there is one.
        definition: The definition of this job.
        job: The kind of job, such as "grid search".
        free: Entries that may differ, such as `study.samples`.

    Returns:
        The entries of the definition in the folder; none if it is new.
    """
    out = file.parent
    if out.exists() and not out.is_dir():
        raise UserError(f"{out} is a file; name an output folder")
    if not out.exists() or all(is_partial(path) for path in out.iterdir()):
        return {}
    try:
        before = _flat(json.loads(file.read_text(encoding="utf-8")))
    except (OSError, ValueError):
        raise UserError(f"{out} holds files that are not of a {job}; name another output folder") from None
    now = _flat(to_jsonable_python(definition))
    names = [name for name in before | now if name not in free and before.get(name) != now.get(name)]
    if names:
        raise UserError(
            f"{out} holds a {job} with other settings ({', '.join(names)}); "
            "name another output folder, or remove that one"
        )
    return before


def _flat(content: Mapping[str, Any]) -> dict[str, Any]:
    """The entries, those of inner dictionaries as `key.name`."""
    entries: dict[str, Any] = {}
    for key, value in content.items():
        inner = value if isinstance(value, dict) else {}
        entries |= {f"{key}.{name}": each for name, each in inner.items()} or {key: value}
    return entries
