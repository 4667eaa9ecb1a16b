"""Representations of objects: HTML in a notebook, one line elsewhere."""

import base64
import reprlib
from collections.abc import Mapping
from dataclasses import fields
from html import escape
from textwrap import shorten
from typing import Any

LONGEST = 240
"""Letters of an object in one line."""


def brief(shown: Any) -> str:
    """A dataclass in one line: the shapes of arrays, the beginning of what else is long.

    To be the `__repr__` of a dataclass that holds arrays.
    """
    parts = [f"{each.name}={_in_short(getattr(shown, each.name))}" for each in fields(shown) if each.repr]
    return shorten(f"{type(shown).__name__}({', '.join(parts)})", LONGEST, placeholder=" ...)")


def _in_short(value: object) -> str:
    shape = getattr(value, "shape", None)
    return f"<{' x '.join(map(str, shape))}>" if shape else reprlib.repr(value)


def fact_table(title: str, facts: Mapping[str, object], png: bytes = b"") -> str:
    """A heading, a picture if there is one, and a table with a row for each fact, as HTML."""
    data = base64.b64encode(png).decode("ascii")
    picture = f'<img style="max-width:100%" src="data:image/png;base64,{data}">' if png else ""
    left = 'style="text-align:left"'
    rows = "".join(
        f"<tr><th {left}>{escape(name)}</th><td {left}>{escape(str(fact))}</td></tr>"
        for name, fact in facts.items()
    )
    return f"<div><strong>{escape(title)}</strong><div>{picture}</div><table>{rows}</table></div>"
