"""The Jinja environment of the HTML pages."""

import base64
from pathlib import Path

from jinja2 import Environment, PackageLoader, StrictUndefined


def template_environment() -> Environment:
    """The environment of `compare/templates`: HTML is escaped, and a missing name is an error.

    The filter `png` turns the path of a PNG file into a data URL.
    """
    environment = Environment(
        loader=PackageLoader("compare"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters["png"] = png_url
    return environment


def png_url(path: Path) -> str:
    """A PNG file as a data URL."""
    return "data:image/png;base64," + base64.b64encode(path.read_bytes()).decode("ascii")
