"""Reads TOML and JSON files and paths of users; what cannot be read is a `UserError` of one line."""

import json
import tomllib
from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from pinnray.runtime.errors import UserError


def read_toml(path: Path, what: str) -> dict[str, Any]:
    """The content of a TOML file.

    Args:
        path: The file.
        what: What it should be, such as "design file", for the error.

    Raises:
        UserError: If it cannot be read.
    """
    return dict(_read(path, what, tomllib.loads))


def read_json(path: Path, what: str) -> Any:
    """The content of a JSON file; see `read_toml`."""
    return _read(path, what, json.loads)


def _read(path: Path, what: str, parse: Callable[[str], Any]) -> Any:
    try:
        return parse(path.read_text(encoding="utf-8-sig"))
    except OSError as error:
        reason = str(error.strerror)
    except UnicodeDecodeError:
        reason = "it is no text in UTF-8"
    except json.JSONDecodeError as error:
        reason = f"it is not JSON ({error})"
    except ValueError as error:
        reason = str(error)
    except RecursionError:
        reason = "it is nested too deeply"
    raise UserError(f"cannot read the {what} {path}: {reason}")


def as_path(given: object, what: str) -> Path:
    """A path from a text or a path.

    Args:
        given: What a user gave.
        what: Its name in an error, such as "the file".

    Raises:
        UserError: If it is something else.
    """
    if isinstance(given, str | Path):
        return Path(given)
    raise UserError(f"{what} is {given!r}; give a path")


def output_folder(out: str | Path | None) -> AbstractContextManager[str | Path]:
    """The folder that is given; if None, one that is removed at the end."""
    return TemporaryDirectory() if out is None else nullcontext(as_path(out, "out"))
