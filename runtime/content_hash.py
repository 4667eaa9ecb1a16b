"""One hash for everything that a result depends on: its inputs and the program's own sources."""

import hashlib
import json
import os
import re
import sys
from pathlib import Path
from typing import Any

_PROGRAM = __name__.partition(".")[0]

_IMPORT = re.compile(rf"^[ \t]*(?:from|import) ({_PROGRAM}\.[\w.]+)".encode(), re.MULTILINE)


def content_hash(content: Any) -> str:
    """SHA-256 of nested dictionaries, lists, numbers, texts and arrays, in hexadecimal.

    The order of a dictionary's keys does not matter; any other object counts by its `str`.
    """
    text = json.dumps(content, sort_keys=True, default=_array_or_text)
    return hashlib.sha256(text.encode()).hexdigest()


def file_digest(path: Path) -> str:
    """SHA-256 of a file, in hexadecimal."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def sources_digest(*modules: str) -> str:
    """SHA-256 over the sources that modules' results depend on, in hexadecimal.

    A module counts with all of its package, and so do the program's packages that it imports, directly or by
    others. Code of a notebook has no source file and does not count.

    Args:
        modules: Names of the modules that make the result, with a solver's of another package.
    """
    sha = hashlib.sha256()
    for name, path in sorted(
        (os.fsencode(path.relative_to(place.parent)), path)
        for place in packages_behind(*modules)
        for path in _sources(place)
    ):
        sha.update(name + b"\0" + path.read_bytes())
    return sha.hexdigest()


def has_source(module: str) -> bool:
    """Whether `sources_digest` counts the code of an imported module: no for that of a notebook or shell."""
    return getattr(sys.modules.get(module.partition(".")[0]), "__file__", None) is not None


def packages_behind(*modules: str) -> set[Path]:
    """Places of modules' packages and of the program's that they import, directly or by others."""
    found, waiting = set[Path](), set(filter(None, map(_package, modules)))
    while waiting:
        place = waiting.pop()
        found.add(place)
        imported = {name for path in _sources(place) for name in _IMPORT.findall(path.read_bytes())}
        waiting |= set(filter(None, map(_package, map(bytes.decode, imported)))) - found
    return found


def _sources(place: Path) -> list[Path]:
    return sorted(place.rglob("*.py")) if place.is_dir() else [place]


def _package(module: str) -> Path | None:
    """The folder of a module's package, or its file; in the program the package below the root."""
    names = module.split(".")
    file = getattr(sys.modules.get(names[0]), "__file__", None)
    if file is None:
        return None
    place = Path(file).parent if Path(file).name == "__init__.py" else Path(file)
    if names[0] != _PROGRAM:
        return place
    inner = place.joinpath(*names[1:2])
    module_file = inner.with_suffix(".py")
    return inner if inner.is_dir() else module_file if module_file.is_file() else None


def _array_or_text(value: object) -> object:
    import numpy as np  # where arrays are hashed it is there; options have to be read quickly

    if isinstance(value, np.ndarray):
        return [str(value.dtype), value.shape, hashlib.sha256(value.tobytes()).hexdigest()]
    return str(value)
