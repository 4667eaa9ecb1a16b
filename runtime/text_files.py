"""Reads TOML and JSON files of users; a file that cannot be read is a `UserError` of one line."""

import json
import tomllib
from collections.abc import Callable
from pathlib import Path
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
    content: dict[str, Any] = _read(path, what, parse_toml)
    return content


def read_json(path: Path, what: str) -> Any:
    """The content of a JSON file; see `read_toml`."""
    return _read(path, what, lambda text: _parsed(text, json.loads))


def parse_toml(text: str) -> dict[str, Any]:
    """The content of a TOML text.

    Raises:
        ValueError: If it cannot be read.
    """
    content: dict[str, Any] = _parsed(text, tomllib.loads)
    return content


def _read(path: Path, what: str, parse: Callable[[str], Any]) -> Any:
    try:
        return parse(path.read_text(encoding="utf-8-sig"))
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) else error
        if isinstance(error, UnicodeDecodeError):
            reason = "it is no text in UTF-8"
        raise UserError(f"cannot read the {what} {path}: {reason}") from None


def _parsed(text: str, parse: Callable[[str], Any]) -> Any:
    try:
        content = parse(text)
        _check_numbers(content)
    except RecursionError:
        raise ValueError("it is nested too deeply") from None
    except json.JSONDecodeError as error:
        raise ValueError(f"it is not JSON ({error})") from None
    return content


def _check_numbers(value: Any) -> None:
    if isinstance(value, int) and abs(value) > 1e300:  # arithmetic with floats fails beyond
        raise ValueError(f"it has a number of {len(str(value))} digits")
    for each in value.values() if isinstance(value, dict) else value if isinstance(value, list) else ():
        _check_numbers(each)


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
