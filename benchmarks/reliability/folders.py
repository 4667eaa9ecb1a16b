"""Contents of an output folder: digests of its numbers, and files that are there only in part."""

import csv
import hashlib
import json
import sqlite3
from collections.abc import Callable, Mapping
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from PIL import Image

TIMES = ("second", "started", "time", "rate_hz", "pace", "live")
"""Words in the names of entries that differ from run to run."""
PRESENT = (".html", ".png", ".mp4", ".mkv", ".pt", ".safetensors", "run.json")
"""Ends of files of which only the presence is compared: they, or the files that they list, tell times."""


def numbers(folder: Path) -> dict[str, str]:
    """A digest of the numbers in every file of a folder, by its path; empty for pages and pictures."""
    return {
        path.relative_to(folder).as_posix(): "" if path.name.endswith(PRESENT) else _digest(_content(path))
        for path in _visible(folder)
    }


def broken(folder: Path) -> list[str]:
    """Files under their final names that cannot be read to their end."""
    found = []
    for path in _visible(folder):
        try:
            if path.suffix != ".sqlite":  # what is half done there, the next to open it undoes
                _content(path)
        except Exception as error:  # whatever a reader says of half a file
            found.append(f"{path.relative_to(folder)} ({type(error).__name__}: {error})")
    return found


def incomplete(out: Path) -> list[str]:
    """Reasons why a folder under its final name is no whole result: files that `run.json` lists and lack."""
    if not (out / "run.json").exists():
        return [f"{out.name} has no run.json"]
    return [
        f"{out.name}/{name} is not what run.json says"
        for name, digest in json.loads((out / "run.json").read_text())["files_sha256"].items()
        if not (out / name).is_file() or _digest((out / name).read_bytes()) != digest
    ]


def leftovers(folder: Path) -> list[str]:
    """Temporary files, and folders of unfinished runs."""
    return [path.relative_to(folder).as_posix() for path in folder.rglob("*") if ".partial" in path.name]


def _visible(folder: Path) -> list[Path]:
    return sorted(path for path in folder.rglob("*") if path.is_file() and not path.name.startswith("."))


def _content(path: Path) -> Any:
    return READERS.get(path.suffix, Path.read_bytes)(path)


def _digest(content: Any) -> str:
    return hashlib.sha256(content if isinstance(content, bytes) else repr(content).encode()).hexdigest()


def _timeless(value: Any) -> Any:
    """The value without entries that tell times."""
    if isinstance(value, Mapping):
        kept = {key: each for key, each in value.items() if not any(word in key for word in TIMES)}
        return {key: _timeless(each) for key, each in kept.items()}
    return [_timeless(each) for each in value] if isinstance(value, list) else value


def _csv(path: Path) -> Any:
    text = path.read_text(encoding="utf-8")
    if not text.endswith("\n"):
        raise ValueError("it ends within a line")
    lines = [line for line in text.splitlines(keepends=True) if not line.startswith("#")]
    rows = list(csv.DictReader(lines, strict=True))
    if any(None in row or None in row.values() for row in rows):
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


def _journal(path: Path) -> Any:
    with closing(sqlite3.connect(f"file:{path}?mode=ro", uri=True)) as connection:
        query = "select number, state, message, quantities from samples order by number"
        return connection.execute(query).fetchall()


def _ended(word: bytes) -> Callable[[Path], bytes]:
    def read(path: Path) -> bytes:
        content = path.read_bytes()
        if not content.rstrip().endswith(word):
            raise ValueError(f"it does not end with {word.decode()}")
        return content

    return read


READERS: dict[str, Callable[[Path], Any]] = {
    ".json": lambda path: _timeless(json.loads(path.read_text(encoding="utf-8"))),
    ".csv": _csv,
    ".npz": _arrays,
    ".sqlite": _journal,
    ".parquet": lambda path: _timeless(pd.read_parquet(path).to_dict("list")),
    ".png": lambda path: Image.open(path).tobytes(),
    ".html": _ended(b"</html>"),
    ".vtu": _ended(b"</VTKFile>"),
    ".svg": _ended(b"</svg>"),
}
"""Readers by suffix; they raise an exception if a file is cut off."""
