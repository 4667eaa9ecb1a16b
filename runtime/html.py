"""HTML pages from templates, which all extend the shell `templates/page.html.j2` of this folder.

Their numbers are arrays in one piece, compressed, which `packed.js` reads.
"""

import base64
import gzip
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from jinja2 import ChoiceLoader, Environment, PackageLoader, StrictUndefined
from markupsafe import Markup, escape
from numpy.typing import NDArray
from PIL import Image

from pinnray.runtime.arrays import FloatArray
from pinnray.runtime.atomic import write_text
from pinnray.runtime.errors import UserError

ROOM = __name__.rpartition(".")[0]

PNG = b"\x89PNG\r\n\x1a\n"

SMALL = 300_000
"""Bytes up to which a picture, as a rule one of lines, is embedded as it is."""

LONG = 24
"""Letters of a name that does not fit a line of a phone."""


def write_html(path: Path, template: str, *, room: str = ROOM, **values: Any) -> Path:
    """Render a template with values and write the page, atomically.

    `designs.html.j2` is a page of tables and pictures: it takes `title`, `sentences`, `tables` (each a
    `TextTable`), `pictures` (captions by the path of the PNG file) and `note`, its last line.

    Args:
        path: Where the page is written.
        template: Name of the template.
        room: Package whose folder `templates` has it, if not this one.
        values: What the template shows.
    """
    write_text(path, template_environment(room).get_template(template).render(**values))
    return path


def template_environment(room: str) -> Environment:
    """The environment of a package's templates and of this one's.

    HTML is escaped, and a missing name is an error. The filter `png` turns the path of a PNG file into a data
    URL; `unbroken` keeps names with hyphens whole.
    """
    environment = Environment(
        loader=ChoiceLoader([PackageLoader(room), PackageLoader(ROOM)]),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters |= {"png": png_url, "unbroken": unbroken}
    return environment


def unbroken(text: object) -> Markup:
    """The text with lines that break between its words only, not at a hyphen unless the word is long."""
    word = Markup('<span class="word">{}</span>')
    return Markup(" ").join(
        word.format(part) if "-" in part and len(part) < LONG else escape(part)
        for part in str(text).split(" ")
    )


def png_url(path: Path) -> str:
    """A PNG file as a data URL.

    Raises:
        UserError: If it is something else: a page that is passed on must not carry it.
    """
    content = path.read_bytes()
    if not content.startswith(PNG):
        raise UserError(f"{path} is no PNG picture; make the run again")
    return "data:image/png;base64," + base64.b64encode(content).decode("ascii")


def picture_urls(paths: Sequence[Path]) -> dict[Path, str]:
    """PNG files as data URLs: small ones as they are, large ones as WebP copies, a quarter of their size."""
    with ThreadPoolExecutor(max_workers=4) as pool:
        return dict(zip(paths, pool.map(_picture_url, paths), strict=True))


def _picture_url(path: Path) -> str:
    if path.stat().st_size <= SMALL:
        return png_url(path)
    buffer = BytesIO()
    try:
        with Image.open(path, formats=["PNG"]) as picture:  # of others; Pillow would run Ghostscript for EPS
            picture.convert("RGB").save(buffer, "WEBP", quality=80, method=0)
    except (OSError, ValueError, SyntaxError, Image.DecompressionBombError):
        raise UserError(f"{path} is no PNG picture, or too large; make the run again") from None
    return "data:image/webp;base64," + base64.b64encode(buffer.getvalue()).decode("ascii")


class Packed:
    """Arrays in one piece of memory; `add` gives the place and type by which the browser reads one."""

    def __init__(self) -> None:
        self._data = bytearray()

    def add(self, values: NDArray[Any]) -> dict[str, Any]:
        """Append an array of float64, float32, uint32, uint16 or uint8."""
        place = {"kind": str(values.dtype), "offset": len(self._data), "length": values.size}
        self._data += values.tobytes()
        self._data += bytes(-len(self._data) % 8)
        return place

    def add_steps(self, values: FloatArray, least: float = 0.0) -> dict[str, Any]:
        """Append values as steps of their range, or of `least` if that is more: low + step * number.

        All low bytes of the numbers come before all high ones, which compresses better.
        """
        low, high = float(values.min()), float(values.max())
        step = max((high - low) / 65_535, least) or 1.0
        steps = np.round((values.ravel() - low) / step).astype("<u2")
        return self.add(steps.view(np.uint8).reshape(-1, 2).T) | {"low": low, "step": step}

    def text(self) -> str:
        """All of it, compressed by gzip, in Base64."""
        return base64.b64encode(gzip.compress(self._data, compresslevel=6, mtime=0)).decode("ascii")
