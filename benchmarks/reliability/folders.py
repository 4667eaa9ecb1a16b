"""Contents of an output folder: digests of its numbers, and files that are there only in part."""

import csv
import hashlib
import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

TIMES = ("second", "started", "time", "rate_hz", "pace", "live")
"""Words in the names of entries that differ from run to run."""
PRESENT = (".html", ".png", ".mp4", ".mkv", ".pt", ".sqlite", ".parquet", "run.json")
"""Ends of files of which only the presence is compared: they, or what they list, tell times."""
CUT = "cut off"


def numbers(folder: Path) -> dict[str, str]:
    """By path a digest of the numbers in every file of a folder, "" for pages and pictures, or `CUT`."""
    files = (path for path in sorted(folder.rglob("[!.]*")) if path.is_file())
    return {path.relative_to(folder).as_posix(): _digest(path) for path in files}


def _digest(path: Path) -> str:
    try:
        content = READERS.get(path.suffix, Path.read_bytes)(path)
    except Exception:  # whatever a reader says of half a file
        return CUT
    return "" if path.name.endswith(PRESENT) else hashlib.sha256(repr(content).encode()).hexdigest()


def _timeless(value: Any) -> Any:
    """The value without entries that tell times."""
    if isinstance(value, Mapping):
        kept = {key: each for key, each in value.items() if not any(word in key for word in TIMES)}
        return {key: _timeless(each) for key, each in kept.items()}
    return [_timeless(each) for each in value] if isinstance(value, list) else value


def _csv(path: Path) -> Any:
    text = path.read_text(encoding="utf-8")
    lines = [line for line in text.splitlines(keepends=True) if not line.startswith("#")]
    rows = list(csv.DictReader(lines, strict=True))
    if not text.endswith("\n") or any(None in row or None in row.values() for row in rows):
        raise ValueError("a row is cut off")
    return _timeless(rows)


def _arrays(path: Path) -> Any:
    with np.load(path, allow_pickle=False) as archive:
        arrays = {name: archive[name] for name in archive.files}
    texts = {name: str(each) for name, each in arrays.items() if each.dtype.kind == "U"}
    headers = {
        name: _timeless(json.loads(text)) if text[:1] in "{[" else text for name, text in texts.items()
    }
    return headers, [(name, each.shape, each.tobytes()) for name, each in arrays.items() if name not in texts]


def _ended(path: Path) -> bytes:
    """The content of a file of elements, which the end of the outermost has to close."""
    content = path.read_bytes()
    if not content.rstrip().endswith((b"</html>", b"</VTKFile>", b"</svg>")):
        raise ValueError("an element is open")
    return content


READERS: dict[str, Callable[[Path], Any]] = {
    ".json": lambda path: _timeless(json.loads(path.read_text(encoding="utf-8"))),
    ".csv": _csv,
    ".npz": _arrays,
    ".png": lambda path: Image.open(path).tobytes(),
    **dict.fromkeys((".html", ".vtu", ".svg"), _ended),
}
"""Readers by suffix; they raise an exception if a file is cut off."""
