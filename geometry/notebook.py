"""HTML by which objects show themselves in a notebook."""

import base64
from collections.abc import Mapping
from html import escape


def fact_table(title: str, facts: Mapping[str, object], picture: str = "") -> str:
    """A heading, a picture as HTML, and a table with a row for each fact."""
    left = 'style="text-align:left"'
    rows = "".join(
        f"<tr><th {left}>{escape(name)}</th><td {left}>{escape(str(fact))}</td></tr>"
        for name, fact in facts.items()
    )
    return f"<div><strong>{escape(title)}</strong><div>{picture}</div><table>{rows}</table></div>"


def png_image(png: bytes) -> str:
    """A PNG picture as an HTML element that holds it."""
    return f'<img style="max-width:100%" src="data:image/png;base64,{base64.b64encode(png).decode("ascii")}">'
