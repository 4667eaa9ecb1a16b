"""Results that are kept in a folder of the user's, under names that tell everything they depend on."""

import atexit
import os
import pickle
import shutil
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryFile, mkdtemp
from typing import TypeVar

from pinnray.runtime.atomic import remove_partials, write_bytes

Result = TypeVar("Result")


LIBRARIES = {"XDG_CACHE_HOME": "", "MPLCONFIGDIR": "matplotlib"}
"""Variables that say where libraries keep theirs, as DOLFINx its compiled forms, and places in our folder."""


def cache_folder() -> Path:
    """The folder of what is cached: meshes, CAD files, emulators.

    `PINNRAY_CACHE` if set, else `pinn-ray` in `XDG_CACHE_HOME` or `~/.cache`. Where that cannot be written it
    is a temporary one for this process and its children; a warning says so, once.
    """
    chosen, caches = os.environ.get("PINNRAY_CACHE"), os.environ.get("XDG_CACHE_HOME")
    try:
        folder = Path(chosen) if chosen else Path(caches or Path("~/.cache").expanduser()) / "pinn-ray"
        check_writable(folder)
    except (OSError, RuntimeError) as error:  # the latter of a user without a home
        folder = Path(mkdtemp(prefix="pinn-ray-cache-"))
        atexit.register(shutil.rmtree, folder, ignore_errors=True)
        os.environ["PINNRAY_CACHE"] = str(folder)
        warnings.warn(
            f"cannot write to the cache folder ({error}): meshes and compiled forms are made anew next time; "
            "set PINNRAY_CACHE to a folder that can be written",
            RuntimeWarning,
            stacklevel=2,
        )
    return folder


def share_cache() -> None:
    """Let libraries keep theirs in `PINNRAY_CACHE`, if it is set, unless they have a folder of their own."""
    folder = cache_folder().absolute()
    for name, place in LIBRARIES.items() if "PINNRAY_CACHE" in os.environ else ():
        try:
            check_writable(Path(os.environ[name]))
        except (KeyError, OSError):
            os.environ[name] = str(folder / place)


def check_writable(folder: Path) -> None:
    """Make a folder if it is not there, and a file in it; raise an `OSError` if that cannot be done."""
    folder.mkdir(parents=True, exist_ok=True)
    with TemporaryFile(dir=folder):
        pass


@contextmanager
def kept_if_possible(folder: Path, what: str) -> Iterator[None]:
    """Warn, if the block cannot write to the cache `folder`, that `what` has to be done again next time."""
    try:
        yield
    except OSError as error:
        warnings.warn(
            f"cannot write to the cache folder {folder} ({error.strerror}), so that {what} is repeated next "
            "time; set PINNRAY_CACHE to a folder that can be written",
            RuntimeWarning,
            stacklevel=4,
        )


def cached(
    entry: Path,
    what: str,
    make: Callable[[], Result],
    load: Callable[[Path], Result] = lambda entry: pickle.loads(entry.read_bytes()),
    save: Callable[[Result, Path], None] | None = lambda made, entry: write_bytes(entry, pickle.dumps(made)),
) -> Result:
    """Load a result; make it first if it is missing or cannot be read.

    A pickled entry can run code: its name must tell versions and sources, and the cache be the user's own.

    Args:
        entry: Its file in the cache.
        what: Its description in warnings, such as "meshing design 'default'".
        make: Makes it.
        load: Reads it from a file.
        save: Writes it into a file; None keeps nothing.
    """
    if entry.exists():
        try:
            return load(entry)
        except Exception as error:  # a damaged file can make the reader raise anything
            warnings.warn(
                f"rebuilding {entry.name}: the cached file is damaged ({type(error).__name__})",
                RuntimeWarning,
                stacklevel=3,
            )
    made = make()
    if save:
        with kept_if_possible(entry.parent, what):
            remove_partials(entry.parent, older_than_s=86_400.0)  # after a day its process has ended
            save(made, entry)
    return made
