"""A table of texts, for the terminal and the report."""

from collections.abc import Sequence
from dataclasses import dataclass


@dataclass(frozen=True)
class Grid:
    """A table of texts.

    Attributes:
        title: Above the table.
        headings: Headings of the columns.
        rows: As many texts as headings.
        caption: Below the table.
    """

    title: str
    headings: Sequence[str]
    rows: Sequence[Sequence[str]]
    caption: str = ""
