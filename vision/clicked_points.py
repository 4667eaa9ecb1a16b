"""Displacements from points that were clicked by hand in two photographs, at rest and pressed."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Literal

import numpy as np
from scipy.optimize import linear_sum_assignment

from pinnray.geometry.observations import Observations
from pinnray.geometry.registration import HAND_HELD, Homography, nearest_similarity
from pinnray.runtime.arrays import FloatArray, IntArray
from pinnray.runtime.errors import UserError
from pinnray.runtime.tables import read_number, read_table

FEWEST = 3
"""Points that tell a picture's mirror image from itself."""
FAR = 0.1
"""Misfit of the points at rest, rms over their extent, beyond which they are not those of the drawing."""
ROUNDING = 1e-6
"""Misfit that says nothing, over the points' extent."""
UNKNOWN_BY = 1.5
"""A mirror image that fits worse by less than this factor may be the right one."""

LengthScale = Literal["same", "lengths"]


@dataclass(frozen=True, eq=False)
class Clicks:
    """The points of one photograph."""

    places: FloatArray  # Mean of the clicks at every point, shape (m, 2), pixels or any other unit
    noise: float | None  # Standard deviation of such a mean from repeats, a coordinate; None without repeats
    numbers: tuple[float, ...] = ()  # Of the points, ascending; empty where none were given


@dataclass(frozen=True, eq=False)
class ClickedPoints:
    """Measurements from clicks, and what was found on the way."""

    observations: Observations
    order: IntArray  # Click of every marker, shape (m,)
    scales: tuple[float, float]  # Of the pictures at rest and pressed, mm per unit
    mirrored: bool  # Whether y runs down in the pictures, as in most programs
    misfit: float  # Rms distance of a coordinate at rest from the drawing, mm
    noise: float  # Standard deviation of a clicked coordinate, mm
    reason: str  # Where that number comes from


def read_clicks(path: Path) -> Clicks:
    """Clicks from a CSV file with columns x and y, a row a click.

    With a column `point`, clicks of one number are repeats, and points are in the order of their numbers. A
    `UserError` names what cannot be read.
    """
    table = read_table(path, "clicks", {"x": "x", "y": "y"}, {"point": "point"})
    values = []
    for line, cells in table.rows:
        values.append([read_number(cell) for cell in cells.values()])
        for name, value in zip(cells, values[-1], strict=True):
            if not np.isfinite(value):
                raise UserError(f"{path}, line {line}: {name} is {cells[name]!r}, which is no finite number")
    if len(values) < FEWEST:
        raise UserError(f"{path} has {len(values)} points; give at least {FEWEST}")
    clicks = np.array(values)[:, :2]
    if "point" not in table.titles:
        return Clicks(clicks, None)
    numbers, group = np.unique(np.array(values)[:, 2], return_inverse=True)
    if len(numbers) < FEWEST:
        raise UserError(f"{path} has {len(numbers)} points; give at least {FEWEST}")
    counts = np.bincount(group)
    means = np.column_stack([np.bincount(group, weights=clicks[:, axis]) / counts for axis in (0, 1)])
    freedom = len(clicks) - len(counts)
    noise = None
    if freedom:
        squares = float(((clicks - means[group]) ** 2).sum()) / (2 * freedom)
        noise = float(np.sqrt(squares * (1 / counts).mean()))
    return Clicks(means, noise, tuple(numbers.tolist()))


def clicked_points(
    rest: Clicks,
    pressed: Clicks,
    markers: FloatArray,
    *,
    marker_radius: float,
    scale: LengthScale | tuple[float, float] = "same",
    source: str,
) -> ClickedPoints:
    """Displacements of markers (m, 2), mm, from clicks in their order, or at least of each other.

    The picture at rest is put on the drawing by turn, shift and, where it is not known, scale; the pressed
    one is moved with it. Its own frame is `HAND_HELD`.

    Args:
        rest: At rest.
        pressed: Pressed, in the same order; numbered points have the same numbers in both.
        markers: On the drawing.
        marker_radius: Of the markers, mm.
        scale: Millimetres per unit of both pictures; or "same": both have that which brings the picture at
            rest nearest to the drawing; or "lengths": each has that which gives the lines between successive
            points the sum of their lengths on the drawing, as along walls that hardly stretch.
        source: A sentence for the observations.

    Raises:
        UserError: If the points of both are not the same, or those at rest do not lie as on the drawing.
    """
    if rest.numbers != pressed.numbers:
        alone = sorted({*rest.numbers} ^ {*pressed.numbers})
        raise UserError(
            f"a point is numbered in one picture only: {', '.join(f'{each:g}' for each in alone)}"
        )
    counts = len(rest.places), len(pressed.places), len(markers)
    if len(set(counts)) > 1:
        raise UserError(
            f"{counts[0]} points at rest, {counts[1]} pressed, {counts[2]} markers on the drawing; give each "
            "marker one point in both pictures, in one order"
        )
    order, mirrored = _matched(rest.places, markers)
    sign = np.array([1.0, -1.0 if mirrored else 1.0])
    here, there = (each.places[order] * sign for each in (rest, pressed))
    if isinstance(scale, tuple):
        scales = scale
    elif scale == "same":
        scales = (1 + float(nearest_similarity(here, markers).values[3]),) * 2
    else:
        listed = np.argsort(order)
        own, one, two = (_length(each[listed]) for each in (markers, here, there))
        scales = (own / one, own / two)
    here, there = scales[0] * here, scales[1] * there
    motion: Homography = nearest_similarity(here, markers, rigid=True)
    here, there = motion.moved(here), motion.moved(there)
    misfit = float(np.sqrt(((here - markers) ** 2).sum() / (2 * len(markers) - 4)))
    misfit = max(misfit, ROUNDING * float(np.ptp(markers)))
    noise, reason = _noise(rest, pressed, scales, misfit)
    return ClickedPoints(
        observations=Observations(
            points=markers,
            displacements=there - here,
            standard_deviations=np.full(markers.shape, np.sqrt(2) * noise),
            visible=np.ones(len(markers), dtype=np.bool_),
            source=source,
            simulated=False,
            marker_radius=marker_radius,
            pressed=HAND_HELD,
        ),
        order=order,
        scales=scales,
        mirrored=mirrored,
        misfit=misfit,
        noise=noise,
        reason=reason,
    )


def _noise(rest: Clicks, pressed: Clicks, scales: Sequence[float], misfit: float) -> tuple[float, str]:
    """Standard deviation of a clicked coordinate, mm, and where it comes from.

    Without repeats it is the misfit at rest, which counts how well the finger was marked as well.
    """
    repeats = [each.noise * scale for each, scale in zip((rest, pressed), scales, strict=True) if each.noise]
    if repeats:
        return float(np.sqrt(np.mean(np.square(repeats)))), "the repeats"
    return misfit, "the points at rest against the drawing"


def _matched(places: FloatArray, markers: FloatArray) -> tuple[IntArray, bool]:
    """The click of every marker, and whether the picture is mirrored: as listed, or else by the nearest."""
    listed = np.arange(len(markers))
    misfits = [_misfit(places * [1, sign], markers) for sign in (1, -1)]
    size = float(np.sqrt(markers.var(axis=0).sum()))
    if min(misfits) > FAR * size:
        found = [_nearest(places * [1, sign], markers) for sign in (1, -1)]
        misfits = [misfit for _, misfit in found]
        if min(misfits) > FAR * size:
            raise UserError(
                f"the points at rest do not lie as the markers do: at best {min(misfits):.3g} mm off (rms); "
                "give the points of this drawing"
            )
        listed = found[int(np.argmin(misfits))][0]
    if max(misfits) < UNKNOWN_BY * min(misfits) + ROUNDING * size:
        raise UserError(
            "the points at rest and their mirror image fit the drawing alike; click points off one line, "
            "or give y upwards"
        )
    return listed, misfits[1] < misfits[0]


def _nearest(places: FloatArray, markers: FloatArray) -> tuple[IntArray, float]:
    """The assignment of least misfit, mm: from each orientation of the main axes, to the nearest in turns."""
    best = np.arange(len(markers)), np.inf
    frames = [np.linalg.svd(each - each.mean(axis=0))[2] for each in (places, markers)]
    spread = [np.sqrt(each.var(axis=0).sum()) for each in (places, markers)]
    for signs in product((1, -1), repeat=2):
        turn = frames[0].T @ np.diag(signs) @ frames[1]
        if np.linalg.det(turn) < 0:
            continue
        moved = (places - places.mean(axis=0)) @ turn * spread[1] / spread[0] + markers.mean(axis=0)
        for _ in range(20):
            apart = np.linalg.norm(markers[:, None] - moved[None], axis=2)
            order = linear_sum_assignment(apart**2)[1]
            moved = nearest_similarity(places[order], markers).moved(places)
        misfit = _misfit(places[order], markers)
        if misfit < best[1]:
            best = order, misfit
    return best


def _misfit(places: FloatArray, markers: FloatArray) -> float:
    """Rms distance of points from the markers after the similarity that brings them nearest, mm."""
    moved = nearest_similarity(places, markers).moved(places)
    return float(np.sqrt(((moved - markers) ** 2).sum(axis=1).mean()))


def _length(places: FloatArray) -> float:
    return float(np.linalg.norm(np.diff(places, axis=0), axis=1).sum())
