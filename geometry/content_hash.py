"""One hash for everything that a result depends on: its inputs and the program's own sources."""

import hashlib
import json
import re
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

PROGRAM = ("geometry", "solvers", "vision", "compare", "studies", "pinnray")
"""Packages whose sources count where a module imports them."""

_ROOT = Path(__file__).resolve().parent.parent
_OURS = rf"(?:{'|'.join(PROGRAM)})"
_IMPORT = re.compile(rf"^[ \t]*(?:from|import) +({_OURS}\b[\w.]*)(?: +import +(\([^)]*\)|.*))?", re.MULTILINE)
_PLACE = re.compile(rf"""["']({_OURS}(?:\.\w+)+):\w+["']""")
"""A class that a table names, such as `solvers.fem.linear:FemSolver`."""


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


def sources_digest(*makers: Callable[..., Any]) -> str:
    """SHA-256 over the sources that the results of functions and classes depend on, in hexadecimal.

    Args:
        makers: Functions and classes that make the result, as for `source_files`.
    """
    sha = hashlib.sha256()
    for name, path in sorted(source_files(*makers).items()):
        sha.update(name.encode() + b"\0" + path.read_bytes())
    return sha.hexdigest()


def source_files(*makers: Callable[..., Any]) -> dict[str, Path]:
    """The modules of functions and classes with all that these import of the program, directly or not.

    Imports inside functions count, and so do modules that a table names as `module:Class`. Of another
    package, such as that of a solver of others, every module counts.

    Returns:
        The files by the names of their modules; none for code of a notebook, which has no file.
    """
    found: dict[str, Path] = {}
    waiting = [module for maker in makers for module in _own_modules(maker.__module__)]
    while waiting:
        name, path = waiting.pop()
        if name in found:
            continue
        found[name] = path
        text = path.read_text(encoding="utf-8")
        for imported in (*_imported(text), *_PLACE.findall(text)):
            if (file := _file_of(imported)) is not None:
                waiting.append((imported, file))
    for name in list(found):  # what runs before a module is imported
        parent = name.rpartition(".")[0]
        while (file := _file_of(parent)) is not None:
            found.setdefault(parent, file)
            parent = parent.rpartition(".")[0]
    return found


def _own_modules(name: str) -> list[tuple[str, Path]]:
    """A module of the program; else a loaded module, or all modules of the package that holds it."""
    if (file := _file_of(name)) is not None:
        return [(name, file)]
    top = name.partition(".")[0]
    if (text := getattr(sys.modules.get(top), "__file__", None)) is None:
        return []
    path = Path(text)
    if path.name != "__init__.py":
        return [(top, path)]
    return [(f"{top}/{each.relative_to(path.parent)}", each) for each in path.parent.rglob("*.py")]


def _imported(text: str) -> Iterator[str]:
    """Modules of the program that a source imports, and names in them, which may be modules too."""
    for module, names in _IMPORT.findall(text):
        yield module
        for name in re.findall(r"\w+", names):
            yield f"{module}.{name}"


def _file_of(module: str) -> Path | None:
    """The file of a module of the program, or None."""
    if module.partition(".")[0] not in PROGRAM:
        return None
    path = _ROOT.joinpath(*module.split("."))
    return next((file for file in (path.with_suffix(".py"), path / "__init__.py") if file.is_file()), None)


def _array_or_text(value: object) -> object:
    if isinstance(value, np.ndarray):
        return [str(value.dtype), value.shape, hashlib.sha256(value.tobytes()).hexdigest()]
    return str(value)
