"""One hash for everything that a result depends on: its inputs and the program's own sources."""

import hashlib
import json
import os
import sys
from pathlib import Path
from typing import Any

import numpy as np

PROGRAM = ("geometry", "solvers", "vision", "compare", "studies", "pinnray")
"""The program's packages, from the lowest up."""

_ROOT = Path(__file__).resolve().parent.parent


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
    """SHA-256 over the sources of modules' packages and of the program's packages below them, in hexadecimal.

    No package of the program imports one above it, so that nothing a result depends on is left out. Code of
    a notebook has no source file and does not count.

    Args:
        modules: Names of the modules that make the result, with a solver's of another package.
    """
    packages = {module.partition(".")[0] for module in modules}
    ranks = [PROGRAM.index(package) for package in packages.intersection(PROGRAM)]
    sha = hashlib.sha256()
    for package in sorted(packages.union(PROGRAM[: max(ranks, default=-1) + 1])):
        file = getattr(sys.modules.get(package), "__file__", None)
        start = _ROOT / package / "__init__.py" if package in PROGRAM else Path(file) if file else None
        if start is not None:
            sources = sorted(start.parent.rglob("*.py")) if start.name == "__init__.py" else [start]
            for path in sources:
                sha.update(os.fsencode(path.relative_to(start.parent.parent)) + b"\0" + path.read_bytes())
    return sha.hexdigest()


def has_source(module: str) -> bool:
    """Whether `sources_digest` counts the code of an imported module: no for that of a notebook or shell."""
    return getattr(sys.modules.get(module.partition(".")[0]), "__file__", None) is not None


def _array_or_text(value: object) -> object:
    if isinstance(value, np.ndarray):
        return [str(value.dtype), value.shape, hashlib.sha256(value.tobytes()).hexdigest()]
    return str(value)
