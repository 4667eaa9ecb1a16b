"""The Jinja environment of the HTML pages."""

import base64
from io import BytesIO
from pathlib import Path

from jinja2 import Environment, PackageLoader, StrictUndefined
from PIL import Image


def template_environment() -> Environment:
    """The environment of `compare/templates`: HTML is escaped, and a missing name is an error.

    The filters `png` and `webp` turn the path of a PNG file into a data URL, the latter of a smaller copy.
    """
    environment = Environment(
        loader=PackageLoader("compare"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters |= {"png": png_url, "webp": webp_url}
    return environment


def png_url(path: Path) -> str:
    """A PNG file as a data URL."""
    return "data:image/png;base64," + base64.b64encode(path.read_bytes()).decode("ascii")


def webp_url(path: Path) -> str:
    """A PNG file as the data URL of a WebP copy, a quarter of its size; the file itself keeps every pixel."""
    buffer = BytesIO()
    with Image.open(path) as picture:
        picture.convert("RGB").save(buffer, "WEBP", quality=88, method=0)
    return "data:image/webp;base64," + base64.b64encode(buffer.getvalue()).decode("ascii")
