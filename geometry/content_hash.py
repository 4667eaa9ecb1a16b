"""One hash for everything that a result depends on."""

import hashlib
import json
from pathlib import Path
from typing import Any

import numpy as np


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


def _array_or_text(value: object) -> object:
    if isinstance(value, np.ndarray):
        return [str(value.dtype), value.shape, hashlib.sha256(value.tobytes()).hexdigest()]
    return str(value)
