"""Marker displacements as a CSV file: one row per marker, from base to tip, units in the header."""

import csv
import re
from collections.abc import Mapping, Sequence
from math import hypot
from pathlib import Path
from types import MappingProxyType

import numpy as np

from pinnray.geometry.finger.parameters import value_and_deviation
from pinnray.geometry.observations import Observations
from pinnray.geometry.picture_frame import FIXED, HAND_HELD, Registration
from pinnray.runtime.arrays import FloatArray
from pinnray.runtime.atomic import atomic_path
from pinnray.runtime.errors import UserError
from pinnray.runtime.tables import EMPTY, read_number, read_table

POSITION = ("x_mm", "y_mm")
DISPLACEMENT = ("u_mm", "v_mm")
REQUIRED = (*POSITION, *DISPLACEMENT)
OPTIONAL = {"std_u_mm": 0.0, "std_v_mm": 0.0, "visible": 1.0}
TITLES = {name: name for name in REQUIRED}, {name: name for name in OPTIONAL}
"""Titles of the columns that must and that may be there, by their names."""
WORDS = {"true": "1", "false": "0", "yes": "1", "no": "0", "wahr": "1", "falsch": "0"}
"""Other ways to write `visible`, in lower case; German spreadsheets write WAHR."""
CLICKED = 0.05
"""Median standard deviation, mm, from which points were set by hand: fixed cameras do better."""
SMALLEST_DISTANCE = 1e-3
"""Distance below which two markers are the same one, mm: less than a camera tells apart."""
LARGEST = 1e6
"""Size of a coordinate or displacement that cannot be of a finger, mm."""
SIMULATED_MARK, SOLID = "# simulated", " in three dimensions"
SOURCE_MARK, WEIGHED_MARK = "# source: ", "# weighed: "
PICTURES = {"pressed": "# pressed picture: ", "drawn": "# picture at rest: "}
"""Marks of the comments that say how well the pictures' frames are known."""


def write_measurements(path: Path, observations: Observations) -> None:
    """Write observations atomically; `read_measurements` restores them.

    A marker that was not seen has only its position, and is read back with zeros.
    """
    with atomic_path(path) as partial, partial.open("w", newline="", encoding="utf-8") as file:
        if observations.simulated:
            file.write(f"{SIMULATED_MARK}{SOLID if observations.solid else ''}\n")
        file.write(f"{SOURCE_MARK}{' '.join(observations.source.split())}\n")
        if observations.weighed is not None:
            force, deviation = observations.weighed
            file.write(f"{WEIGHED_MARK}{force!r} ± {deviation!r} N\n")
        for picture, mark in PICTURES.items():
            known = getattr(observations, picture)
            if known != _unsaid(observations.simulated, observations.standard_deviations)[picture]:
                file.write(f"{mark}{known}\n")
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(["marker", *REQUIRED, *OPTIONAL])
        known = np.hstack([observations.displacements, observations.standard_deviations]).tolist()
        rows = zip(observations.points.tolist(), known, observations.visible.tolist(), strict=True)
        for number, (point, numbers, visible) in enumerate(rows, start=1):
            writer.writerow([number, *point, *(numbers if visible else [""] * 4), int(visible)])


def read_measurements(path: Path, *, marker_radius: float) -> Observations:
    """Read observations of markers whose discs have a radius, mm: `Design.marker_radius`.

    The columns `x_mm, y_mm` (initial position in the finger's frame) and `u_mm, v_mm` (displacement, final
    minus initial) are needed; `std_u_mm, std_v_mm` (standard deviations) and `visible` (1 or 0, or one of
    `WORDS`) may be left out. Only the position is read of a marker that is not visible; one whose u and v are
    both `EMPTY` is not, unless `visible` says that it is.

    Comment lines start with `#`. `# source: TEXT` names the origin of the numbers. `# simulated` means that
    no camera was involved and the finger is in plane strain, unless `in three dimensions` follows.
    `# weighed: 2.62 ± 0.05 N` is the force along the stroke that a scale showed in the pressed picture.
    `# pressed picture: TEXT` says how well the pressed picture's frame is known in that at rest, and `#
    picture at rest: TEXT` how well that one's is in the drawing, in words of `Registration.parse`. Where
    nothing is said they are fixed, but a pressed picture is `HAND_HELD` whose points were `CLICKED`.

    Raises:
        UserError: If the file cannot be read, a column is missing, a value is no number
            or a marker occurs twice; the message names the line.
    """
    table = read_table(path, "measurements", *TITLES)
    sources = _said(table.comments, SOURCE_MARK)
    marks = [re.fullmatch(rf"#\s*simulated({SOLID})?", comment, re.I) for comment in table.comments]
    simulated, solid = any(marks), any(mark and mark[1] for mark in marks)
    known = {picture: said[0] for picture, mark in PICTURES.items() if (said := _said(table.comments, mark))}
    weighed = _said(table.comments, WEIGHED_MARK)
    return measurements_of(
        [(f"line {line}", cells) for line, cells in table.rows],
        marker_radius=marker_radius,
        table=str(path),
        source=sources[0] if sources else f"measurements from {path.name}",
        simulated=simulated,
        solid=solid,
        weighed=weighed[0] if weighed else None,
        pictures=known,
    )


def measurements_of(
    rows: Sequence[tuple[str, Mapping[str, str]]],
    *,
    marker_radius: float,
    table: str,
    source: str,
    simulated: bool = False,
    solid: bool = False,
    weighed: str | None = None,
    pictures: Mapping[str, str] = MappingProxyType({}),
) -> Observations:
    """Observations from a table; columns and defaults as in `read_measurements`.

    Args:
        rows: Name of every row in messages, and the texts of its marker by their columns of `TITLES`.
        marker_radius: Radius of the markers' discs, mm.
        table: Name of the table in messages.
        source: One sentence on the origin of the numbers.
        simulated: True if no camera was involved.
        solid: See `Observations`.
        weighed: Force that a scale showed, in words of `parse_weighed`.
        pictures: How well the frames of the pictures of `PICTURES` are known, in words.

    Raises:
        UserError: If a value is no number or a marker occurs twice.
    """
    if not rows:
        raise UserError(f"{table} has a header but no marker")
    markers: list[dict[str, float]] = []
    for number, cells in rows:
        marker = _marker(cells, f"{table}, {number}")
        if any(
            hypot(other["x_mm"] - marker["x_mm"], other["y_mm"] - marker["y_mm"]) < SMALLEST_DISTANCE
            for other in markers
        ):
            place = f"({marker['x_mm']:g}, {marker['y_mm']:g}) mm"
            raise UserError(f"{table}, {number}: there is already a marker at {place}; keep one")
        markers.append(marker)
    values = np.array([[marker[name] for name in (*REQUIRED, *OPTIONAL)] for marker in markers])
    points, displacements, deviations, visible = np.split(values, [2, 4, 6], axis=1)
    if not visible.any():
        raise UserError(f"{table}: none of the markers is visible; at least one is needed")
    try:
        known = _unsaid(simulated, deviations)
        known |= {picture: Registration.parse(said) for picture, said in pictures.items()}
        force = None if weighed is None else parse_weighed(weighed)
        return Observations(
            points,
            displacements,
            deviations,
            visible[:, 0] == 1,
            source,
            simulated=simulated,
            solid=solid,
            weighed=force,
            marker_radius=marker_radius,
            pressed=known["pressed"],
            drawn=known["drawn"],
        )
    except UserError as error:
        raise UserError(f"{table}: {error}") from None


def parse_weighed(text: str) -> tuple[float, float]:
    """A force and its standard deviation, N, out of a text such as `2.62±0.05` or `2.62 ± 0.05 N`.

    Raises:
        UserError: If it is none.
    """
    value, deviation = value_and_deviation(text.strip().removesuffix("N"))
    force = read_number(value), read_number(deviation)
    if not (np.isfinite(force).all() and force[1] > 0):
        raise UserError(f"weighed {text!r}: give a force and its standard deviation, N, such as 2.62±0.05")
    return force


def _unsaid(simulated: bool, deviations: FloatArray) -> dict[str, Registration]:
    """Registrations of pictures of which nothing is said, for standard deviations (m, 2), mm; zero unseen."""
    known = deviations[(deviations > 0).any(axis=1)]
    clicked = not simulated and len(known) > 0 and float(np.median(known)) >= CLICKED
    return {"pressed": HAND_HELD if clicked else FIXED, "drawn": FIXED}


def _said(comments: Sequence[str], mark: str) -> list[str]:
    """What comments say that begin with a mark."""
    words = re.escape(mark.strip("# ")).replace("\\ ", r"\s+")
    return [found[1] for each in comments if (found := re.match(rf"#\s*{words}\s*(.*)", each, re.I))]


def _marker(cells: Mapping[str, str], where: str) -> dict[str, float]:
    """The numbers of one row; zeros instead of the displacement of a marker that was not seen."""
    said = cells.get("visible")
    if said is None:
        visible = float(any(cells[name].lower() not in EMPTY for name in DISPLACEMENT))
    else:
        visible = read_number(WORDS.get(said.lower(), said))
        if visible not in (0, 1):
            raise UserError(
                f"{where}: visible is {said!r}; it must be 1 or True (seen), or 0 or False (not seen)"
            )
    values = dict.fromkeys((*DISPLACEMENT, "std_u_mm", "std_v_mm"), 0.0)
    for name in values if visible else ():
        values[name] = _number(cells, name, where)
    return values | {"visible": visible} | {name: _number(cells, name, where) for name in POSITION}


def _number(cells: Mapping[str, str], name: str, where: str) -> float:
    text = cells.get(name, str(OPTIONAL.get(name, "")))
    value = read_number(text)
    if not np.isfinite(value):
        remedy = ""
        if text.lower() in EMPTY:
            if name in DISPLACEMENT:
                remedy = "; of a marker that was not seen leave u and v empty, and put 0 into visible"
            elif name not in POSITION:
                remedy = "; give one, 0 if it is not known, or leave the column out"
        raise UserError(f"{where}: {name} is {text!r}, which is not a number{remedy}")
    if abs(value) > LARGEST:
        raise UserError(f"{where}: {name} is {text}, beyond {LARGEST:g} mm; give mm")
    return value
