"""Atomic writing: a reader sees the old file or the new one, never a part of it or an empty one.

That holds after a power cut, too: the new one is on the disk before it takes the old one's name.

Libraries that write files themselves do not always say that a disk is full: VTK leaves an empty file or ends
the process, and NumPy prints a traceback. Their bytes are made in memory and written here.
"""

import json
import os
import re
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from errno import EDQUOT, EFBIG, EIO, ENOSPC
from io import BytesIO
from math import isfinite
from pathlib import Path
from secrets import token_hex
from time import time
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:  # `--help` has to be quick
    from numpy.typing import ArrayLike

_PARTIAL = re.compile(r"\..+\.[0-9a-f]{8}\.partial(\.[^.]*)?")


@contextmanager
def atomic_path(path: Path) -> Iterator[Path]:
    """A path beside `path`, with its suffix, that takes its place if the block ends without an error.

    Raises:
        OSError: With `path` as its file name: if the disk is full, or the block has written nothing.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    # Unique: process numbers are not among containers that share a folder.
    partial = path.with_name(f".{path.stem}.{token_hex(4)}.partial{path.suffix}")
    try:
        yield partial
        if not partial.exists() or not partial.stat().st_size:
            raise OSError(EIO, "nothing was written; is the disk full?", str(path))
        with partial.open("rb") as file:
            os.fsync(file.fileno())  # a rename may reach the disk before what it names
        os.replace(partial, path)
    except OSError as error:
        if error.errno in (ENOSPC, EDQUOT, EFBIG):
            raise OSError(error.errno, os.strerror(error.errno), str(path)) from None
        raise
    finally:
        partial.unlink(missing_ok=True)


def is_partial(path: Path) -> bool:
    """Whether a file was made by `atomic_path` and has not taken its place."""
    return _PARTIAL.fullmatch(path.name) is not None


def remove_partials(folder: Path, *, older_than_s: float = 0.0) -> None:
    """Remove the files that killed processes have left in a folder.

    Args:
        folder: The folder, with those in it.
        older_than_s: Age from which a file cannot be one that another process is writing, s.
    """
    for path in folder.rglob(".*.partial*"):
        with suppress(FileNotFoundError):  # another process has removed it
            if is_partial(path) and time() - path.stat().st_mtime >= older_than_s:
                path.unlink()


def write_bytes(path: Path, content: bytes) -> None:
    """Write bytes atomically."""
    with atomic_path(path) as partial:
        partial.write_bytes(content)


def write_text(path: Path, text: str) -> None:
    """Write a text atomically."""
    write_bytes(path, text.encode("utf-8"))


def write_arrays(path: Path, arrays: "Mapping[str, ArrayLike]") -> None:
    """Write a NumPy archive atomically; compression takes a fifth off fields, and ten times as long."""
    import numpy as np

    buffer = BytesIO()
    np.savez(buffer, **{name: np.asarray(array) for name, array in arrays.items()})
    write_bytes(path, buffer.getvalue())


def write_json(path: Path, content: dict[str, Any]) -> None:
    """Write JSON atomically, with null for a number that is not finite."""
    write_text(path, json.dumps(_without_nan(content), indent=2, allow_nan=False) + "\n")


def _without_nan(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _without_nan(entry) for key, entry in value.items()}
    if isinstance(value, list | tuple):
        return [_without_nan(entry) for entry in value]
    return None if isinstance(value, float) and not isfinite(value) else value
