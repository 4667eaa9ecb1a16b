"""Contents of an output folder: digests of its numbers, and files that are there only in part."""

import csv
import hashlib
import io
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
PAGES = (".html", ".png", ".mp4", ".mkv", ".pt", ".safetensors")
"""Files of which only the presence is compared: pages tell times, and videos have marks of their own."""
TRANSACTED = (".sqlite",)
"""Files whose half-done changes are undone by the one who opens them next."""

UNSURE = ("run.json",)
"""Files that list digests of the pages."""


def numbers(folder: Path) -> dict[str, str]:
    """A digest of the numbers in every file of a folder, by its path; empty for pages and pictures."""
    files = sorted(path for path in folder.rglob("*") if path.is_file() and not path.name.startswith("."))
    return {path.relative_to(folder).as_posix(): _digest(path) for path in files}


def broken(folder: Path) -> list[str]:
    """Files under their final names that cannot be read to their end."""
    found = []
    for path in sorted(folder.rglob("*")):
        if path.is_file() and not path.name.startswith(".") and path.suffix not in TRANSACTED:
            reader = READERS.get(path.suffix, Path.read_bytes)
            try:
                reader(path)
            except Exception as error:  # whatever a reader says of half a file
                found.append(f"{path.relative_to(folder)} ({type(error).__name__}: {error})")
    return found


def incomplete(out: Path) -> list[str]:
    """Reasons why a folder under its final name is no whole result: files that `run.json` lists and lack."""
    run = out / "run.json"
    if not run.exists():
        return [f"{out.name} has no run.json"]
    listed = json.loads(run.read_text())["files_sha256"]
    return [
        f"{out.name}/{name} is not what run.json says"
        for name, digest in listed.items()
        if not (out / name).is_file() or hashlib.sha256((out / name).read_bytes()).hexdigest() != digest
    ]


def leftovers(folder: Path) -> list[str]:
    """Temporary files, and folders of unfinished runs."""
    return [path.relative_to(folder).as_posix() for path in folder.rglob("*") if ".partial" in path.name]


def _digest(path: Path) -> str:
    if path.suffix in PAGES or path.name in UNSURE:
        return ""
    content = READERS.get(path.suffix, Path.read_bytes)(path)
    return hashlib.sha256(content if isinstance(content, bytes) else repr(content).encode()).hexdigest()


def _json(path: Path) -> Any:
    return _timeless(json.loads(path.read_text(encoding="utf-8")))


def _timeless(value: Any) -> Any:
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
    header = [_header(array) for array in arrays.values() if array.dtype.kind == "U"]
    return header, [
        (name, each.shape, each.tobytes()) for name, each in arrays.items() if each.dtype.kind != "U"
    ]


def _header(array: Any) -> Any:
    try:
        return _timeless(json.loads(str(array)))
    except ValueError:
        return str(array)


def _journal(path: Path) -> Any:
    with closing(sqlite3.connect(f"file:{path}?mode=ro", uri=True)) as connection:
        return connection.execute(
            "select number, state, message, quantities from samples order by number"
        ).fetchall()


def _ended(word: bytes) -> Callable[[Path], bytes]:
    def read(path: Path) -> bytes:
        content = path.read_bytes()
        if not content.rstrip().endswith(word):
            raise ValueError(f"it does not end with {word.decode()}")
        return content

    return read


def _picture(path: Path) -> bytes:
    with Image.open(path) as picture:
        picture.load()
        return picture.tobytes()


def _parquet(path: Path) -> Any:
    frame = pd.read_parquet(io.BytesIO(path.read_bytes()))
    return frame.drop(columns=[name for name in frame if any(word in name for word in TIMES)]).to_csv()


READERS: dict[str, Callable[[Path], Any]] = {
    ".json": _json,
    ".csv": _csv,
    ".npz": _arrays,
    ".sqlite": _journal,
    ".parquet": _parquet,
    ".png": _picture,
    ".html": _ended(b"</html>"),
    ".vtu": _ended(b"</VTKFile>"),
    ".svg": _ended(b"</svg>"),
}
"""Readers by suffix; they raise an exception if a file is cut off."""
