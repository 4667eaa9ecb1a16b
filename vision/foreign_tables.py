"""Recognises tables of other tracking programs by their headers, and says how to use them here."""

from collections.abc import Sequence

CLICKS = (
    "write the mean x and y of every point at rest, and those pressed, into two tables with the columns x "
    "and y, and give both to pinnray points"
)
"""Makes measurements of two lists of places in any unit."""
TITLES: dict[str, tuple[str, ...]] = {
    "TrackPy": ("x", "y", "frame", "particle"),
    "TrackMate": ("track_id", "position_x", "position_y", "frame"),
    "SLEAP": ("frame_idx", "instance.score"),
}
"""Titles that the header of a program's table has, in lower case."""
PLACES: dict[str, str] = {
    "DeepLabCut": "pixels of body parts in every frame",
    "OptiTrack": "places in space of markers in every frame",
    "TrackPy": "pixels of particles in every frame",
    "TrackMate": "places of spots in every frame",
    "SLEAP": "pixels of nodes in every frame",
}


def foreign_table(rows: Sequence[Sequence[str]]) -> str | None:
    """A clause on the table's program and the way from it to measurements; None if none is recognised.

    Args:
        rows: Cells of the first lines, stripped.

    Source: files as DeepLabCut 2 and 3, Motive 1 to 3, TrackPy 0.6, TrackMate 7 and SLEAP 1.3 write them.
    """
    if (program := _program(rows)) is None:
        return None
    plane = ", along two axes in the plane of the finger" if program == "OptiTrack" else ""
    return f"it is an export of {program}, {PLACES[program]}: {CLICKS}{plane}"


def _program(rows: Sequence[Sequence[str]]) -> str | None:
    lower = [[cell.lower() for cell in row] for row in rows[:8]]
    first = [row[0] for row in lower if row]
    if "bodyparts" in first and ("scorer" in first or "coords" in first):
        return "DeepLabCut"
    if first[:1] == ["format version"] or any(row[:2] == ["frame", "time (seconds)"] for row in lower):
        return "OptiTrack"
    header = set(lower[0]) if lower else set()
    return next((name for name, titles in TITLES.items() if header.issuperset(titles)), None)
