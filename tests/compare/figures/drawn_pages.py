"""The words of a matplotlib figure and their places."""

import itertools
import re
import zlib
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

import pytest
from matplotlib.backend_bases import RendererBase
from matplotlib.text import Text
from matplotlib.transforms import Bbox

from pinnray.runtime.figure import Figure


class Page(NamedTuple):
    """A matplotlib figure, what it wrote where when it was drawn, pixels, and sizes of its type, points."""

    figure: Figure
    words: list[tuple[str, Bbox]]
    smallest: float
    largest: float

    @property
    def text(self) -> str:
        return "\n".join(word for word, _ in self.words)

    def overlaps(self) -> list[tuple[str, str]]:
        """Pairs of words that cover each other by more than a pixel."""
        return [
            (a, b)
            for (a, one), (b, two) in itertools.combinations(self.words, 2)
            if min(one.x1, two.x1) - max(one.x0, two.x0) > 1 and min(one.y1, two.y1) - max(one.y0, two.y0) > 1
        ]

    def cut_off(self) -> list[str]:
        """Words that leave the page."""
        page = self.figure.bbox
        return [
            a for a, box in self.words if box.x0 < 0 or box.y0 < 0 or box.x1 > page.x1 or box.y1 > page.y1
        ]


def page_of(figure: Figure) -> Page:
    """The figure, drawn, with its words."""
    words: list[tuple[str, Bbox]] = []
    sizes: list[float] = []
    draw = Text.draw

    def noted(text: Text, renderer: RendererBase) -> None:
        draw(text, renderer)
        if text.get_visible() and text.get_text().strip():
            words.append((text.get_text(), text.get_window_extent(renderer)))
            sizes.append(float(text.get_fontsize()))

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Text, "draw", noted)
        figure.canvas.draw()
    return Page(figure, words, min(sizes), max(sizes))


def printed(figure: Figure) -> tuple[float, float]:
    """Width of a figure as PDF, mm, and the size of its smallest type, indices and exponents too, points."""
    with TemporaryDirectory() as folder:
        content = figure.save(Path(folder) / "figure.pdf").read_bytes()
    box = re.search(rb"/MediaBox \[ *0 0 ([\d.]+) ", content)
    streams = re.findall(rb"FlateDecode.*?>>\s*stream\r?\n(.*?)\r?\nendstream", content, re.DOTALL)
    written = b"".join(zlib.decompressobj().decompress(stream) for stream in streams)
    sizes = [float(size) for size in re.findall(rb"/F\d+ ([\d.]+) Tf", written)]
    assert box is not None
    return float(box[1]) * 25.4 / 72, min(sizes)
