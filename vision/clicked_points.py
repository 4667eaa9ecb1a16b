"""Displacements from points that were clicked by hand in two photographs, at rest and pressed."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations, product
from math import comb
from pathlib import Path
from typing import Literal

import numpy as np
from scipy.optimize import linear_sum_assignment
from scipy.sparse.csgraph import minimum_spanning_tree
from scipy.spatial.distance import pdist, squareform

from pinnray.geometry.observations import Observations
from pinnray.geometry.picture_frame import HAND_HELD, Homography, nearest_similarity
from pinnray.runtime.arrays import FloatArray, IntArray
from pinnray.runtime.errors import UserError
from pinnray.runtime.tables import read_table
from pinnray.vision.point_order import SURE, astray, likeliest_order, likelihoods, order_text

FEWEST = 3
"""Points that tell a picture's mirror image from itself."""
FAR = 0.1
"""Misfit of the points at rest, rms over their extent, beyond which they are not those of the drawing."""
ROUNDING = 1e-6
"""Misfit that says nothing, over the points' extent."""
UNKNOWN_BY = 1.5
"""A mirror image that fits worse by less than this factor may be the right one."""
OTHER_UNIT = 1.25
"""Ratio of the sizes of both pictures' points beyond which they are in two units or scales."""
FARTHEST = 0.5
"""Movement of a point, over the points' extent, beyond which the pictures may be turned or cut."""
STRETCHED = 0.04
"""Change of the distances between neighbouring points that is another scale; walls stretch by less."""
MOST_CHOICES, CLEAR = 5000, 5.0
"""Number of ways to leave out points of the longer list up to which they are tried, and lead in logarithmic
likelihood from which on one is the right one."""

NUMBERED = "number them in a column point, or write nan for one that is missing"
"""Advice for lists of which it is not clear which points they lack."""

LengthScale = Literal["same", "lengths"]


@dataclass(frozen=True, eq=False)
class Clicks:
    """The points of one photograph."""

    places: FloatArray  # Mean of the clicks at every point, shape (m, 2), any unit; NaN for an empty row
    noise: float | None  # Standard deviation of such a mean from repeats, a coordinate; None without repeats
    numbers: tuple[float, ...] = ()  # Of the points, ascending; empty where none were given


@dataclass(frozen=True, eq=False)
class ClickedPoints:
    """Measurements from clicks, and what was found on the way."""

    observations: Observations
    remarks: tuple[str, ...]  # On points that are missing, and on another order or direction
    reordered: bool  # Whether the points at rest are in another order than the markers
    scales: tuple[float, float]  # Of the pictures at rest and pressed, mm per unit
    mirrored: bool  # Whether y runs down in the pictures, as in most programs
    misfit: float  # Rms distance of a coordinate at rest from the drawing, mm
    noise: float  # Standard deviation of a clicked coordinate, mm
    reason: str  # Where that number comes from


def read_clicks(path: Path) -> Clicks:
    """Clicks from a table with columns x and y, a row a click; one of nan is a missing point.

    With a column `point`, clicks of one number are repeats, and points are in the order of their numbers. A
    `UserError` names what cannot be read.
    """
    table = read_table(path, "clicks", {"x": "x", "y": "y"}, {"point": "point"})
    values = np.array(table.numbers(besides=("point",))).reshape(-1, len(table.titles))
    seen = np.isfinite(values[:, 0])
    clicks = values[:, :2]
    numbers, group = np.arange(len(clicks))[seen], np.arange(seen.sum())
    if "point" in table.titles:
        numbers, group = np.unique(values[seen, 2], return_inverse=True)
    if len(numbers) < FEWEST:
        raise UserError(f"{path} has {len(numbers)} points; give at least {FEWEST}")
    if "point" not in table.titles:
        return Clicks(clicks, None)
    clicks, counts = clicks[seen], np.bincount(group)
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
    one is moved with it. Its own frame is `HAND_HELD`. A point that is missing in one picture is left out; a
    pressed list in another order than that at rest is put into this order, unless its points are numbered.

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
        UserError: If it is not clear which points are missing, those of both are the same, in two units or
            with y the other way, or those at rest do not lie as on the drawing.
    """
    zoom = _size(rest.places) / _size(pressed.places) if scale == "lengths" else 1.0
    if isinstance(scale, tuple):
        zoom = scale[1] / scale[0]
    one, other, names, remarks = _paired(rest, pressed, zoom)
    here, there = rest.places[one], pressed.places[other]
    most = max(len(each.places) for each in (rest, pressed))
    if len(here) > len(markers) or (most < len(markers) and not rest.numbers):
        raise UserError(
            f"{len(rest.places)} points at rest, {len(pressed.places)} pressed, {len(markers)} markers on "
            f"the drawing; {NUMBERED}"
        )
    _check_pair(here, zoom * there)
    found = likeliest_order(here, zoom * there, may_flip=True)
    if found.flipped:
        raise UserError(
            "y runs the other way in the pressed list than at rest; save both with y down, or both with y up"
        )
    far = np.linalg.norm(zoom * there[found.order] - here, axis=1).max() / np.ptp(here, axis=0).max()
    if far > FARTHEST:
        remarks.append(
            f"a point moves by {far:.0%} of the points' extent: is a picture cut, turned or mirrored?"
        )
    clicked = np.flatnonzero(np.isfinite(rest.places[:, 0]))
    clicked = clicked if len(clicked) <= len(markers) else one
    listed = clicked if len(rest.places) == len(markers) else None
    owner, mirrored = _matched(rest.places[clicked], markers, listed)
    owner = owner[np.searchsorted(clicked, one)]
    own, sign = markers[owner], np.array([1.0, -1.0 if mirrored else 1.0])
    order = found.order if not rest.numbers else np.arange(len(here))
    here, given = here * sign, there * sign
    there = given[order]
    if isinstance(scale, tuple):
        scales = scale
    elif scale == "same":
        scales = (1 + float(nearest_similarity(here, own).values[3]),) * 2
    else:
        scales = (_length(own) / _length(here), _length(own) / _length(there))
    here, there, given = scales[0] * here, scales[1] * there, scales[1] * given
    motion: Homography = nearest_similarity(here, own, rigid=True)
    here, there, given = motion.moved(here), motion.moved(there), motion.moved(given)
    if (mixed := found.order != np.arange(len(here))).any():
        text = order_text(found.order, names)
        far, least = (
            float(np.linalg.norm((each - here)[mixed], axis=1).max()) for each in (given, given[found.order])
        )
        remarks.append(
            f"the pressed points are in another order than those at rest: {text} the farthest of "
            f"them moves by {least:.3g} mm, not {far:.3g}; "
            + ("see their numbers" if rest.numbers else "they were taken in that order")
        )
    if _misfit(there, own) < _misfit(here, own) / UNKNOWN_BY - ROUNDING * float(np.ptp(own)):
        remarks.append("the pressed points are nearer to the drawing than those at rest: exchanged?")
    if (order == found.order).all():
        remarks += _doubts(own, here, there, names)
    if len(absent := np.setdiff1d(np.arange(len(markers)), owner)):
        remarks.append(f"not visible, for want of a point: marker {_listed(absent + 1)}")
    misfit = float(np.sqrt(((here - own) ** 2).sum() / max(2 * len(own) - 4, 1)))
    misfit = max(misfit, ROUNDING * float(np.ptp(own)))
    noise, reason = misfit, "the points at rest against the drawing"  # how well it was marked counts, too
    repeats = [each.noise * scale for each, scale in zip((rest, pressed), scales, strict=True) if each.noise]
    if repeats:
        noise, reason = float(np.sqrt(np.mean(np.square(repeats)))), "the repeats"
    displacements, seen = np.zeros_like(markers), np.isin(np.arange(len(markers)), owner)
    displacements[owner] = there - here
    deviations, reordered = np.full(markers.shape, np.sqrt(2) * noise), bool((np.diff(owner) < 0).any())
    observations = Observations(
        markers, displacements, deviations, seen, source, marker_radius=marker_radius, pressed=HAND_HELD
    )
    return ClickedPoints(observations, tuple(remarks), reordered, scales, mirrored, misfit, noise, reason)


def _paired(rest: Clicks, pressed: Clicks, zoom: float) -> tuple[IntArray, IntArray, list[str], list[str]]:
    """Numbers of the points that both lists have, in each, their names, and remarks on the others."""
    if bool(rest.numbers) != bool(pressed.numbers):
        raise UserError("the points of one picture are numbered, those of the other are not")
    spots = [np.flatnonzero(np.isfinite(each.places[:, 0])) for each in (rest, pressed)]
    labels = [
        np.array(each.numbers)[own] if each.numbers else own + 1
        for each, own in zip((rest, pressed), spots, strict=True)
    ]
    if rest.numbers or len(rest.places) == len(pressed.places):
        _, one, other = np.intersect1d(labels[0], labels[1], return_indices=True)
    else:
        one, other = _likeliest_choice(rest.places[spots[0]], zoom * pressed.places[spots[1]])
    if len(one) < FEWEST:
        raise UserError(f"{len(one)} points are in both pictures; give at least {FEWEST}")
    if rest.numbers != pressed.numbers:
        _check_numbers(rest.places, zoom * pressed.places, one, other)
    missing = {"in the pressed picture": np.delete(labels[0], one), "at rest": np.delete(labels[1], other)}
    remarks = [
        f"left out, as missing {where}: point {_listed(each)}" for where, each in missing.items() if len(each)
    ]
    return spots[0][one], spots[1][other], [f"{label:g}" for label in labels[0][one]], remarks


def _check_numbers(here: FloatArray, there: FloatArray, one: IntArray, other: IntArray) -> None:
    """Refuse numbers of which those of one list look shifted: in their order the points are likelier."""
    listed = (np.arange(len(here)),) * 2
    try:
        listed = listed if len(here) == len(there) else _likeliest_choice(here, there)
    except UserError:
        return
    found = [likelihoods(here[i], there[j][None])[0] / len(i) for i, j in (listed, (one, other))]
    if (found[0] - found[1]) * len(here) > SURE:
        raise UserError("the numbers of one list look shifted; give a point the same number in both lists")


def _likeliest_choice(here: FloatArray, there: FloatArray) -> tuple[IntArray, IntArray]:
    """Numbers of the points in two lists of different lengths that give the likeliest displacements."""
    fewer, more = sorted((here, there), key=len)
    said = f"{len(here)} points at rest and {len(there)} pressed; {NUMBERED}"
    if comb(len(more), len(fewer)) > MOST_CHOICES:
        raise UserError(said)
    choices = np.array(list(combinations(range(len(more)), len(fewer))))
    found = likelihoods(fewer, more[choices])
    if len(found) > 1 and np.diff(np.sort(found)[-2:])[0] < CLEAR:
        raise UserError(said)
    every, chosen = np.arange(len(fewer)), choices[found.argmax()]
    return (every, chosen) if len(here) < len(there) else (chosen, every)


def _check_pair(here: FloatArray, there: FloatArray) -> None:
    """Refuse points of one picture given twice, and those of two pictures in two units."""
    if np.array_equal(np.sort(here, axis=0), np.sort(there, axis=0)):
        raise UserError("both lists have the same points; give those of the pressed picture as well")
    ratio = _size(here) / _size(there)
    if not 1 / OTHER_UNIT < ratio < OTHER_UNIT:
        nearer = "closer together" if ratio > 1 else "farther apart"
        raise UserError(
            f"the pressed points lie {max(ratio, 1 / ratio):.3g} times {nearer} than those at rest: give "
            "both lists in one unit (10 is between mm and cm), or scale both by their lengths"
        )
    if min(len(np.unique(each, axis=0)) for each in (here, there)) < len(here):
        raise UserError("two points of one picture are at one place; click each of them once")


def _size(places: FloatArray) -> float:
    """Rms distance of the points from their middle, without those that are missing."""
    size = float(np.sqrt(np.nanvar(places, axis=0).sum()))
    if size <= ROUNDING * float(np.nanmax(np.abs(places))):
        raise UserError("all points of a picture are at one place")
    return size


def _doubts(own: FloatArray, here: FloatArray, there: FloatArray, names: list[str]) -> list[str]:
    """Remarks on a picture at another scale, and on a point that goes astray; places in mm, shape (m, 2)."""
    remarks = []
    for less, more, where in (
        (own, here, "at rest than on the drawing"),
        (here, there, "pressed than at rest"),
    ):
        stretch, deviation = _stretch(less, more)
        if abs(stretch) > max(STRETCHED, 3 * deviation):
            way = "farther apart" if stretch > 0 else "closer together"
            remarks.append(
                f"neighbouring points lie {abs(stretch):.1%} {way} {where}, more than walls stretch: see the "
                "scale of each picture"
            )
    if (alone := astray(here, there)) is not None:
        remarks.append(f"point {names[alone]} moves unlike the points around it: see both of its clicks")
    return remarks


def _stretch(less: FloatArray, more: FloatArray) -> tuple[float, float]:
    """Median relative change of the distances between neighbours in `less`, and its standard deviation.

    Neighbours are those of the shortest tree that joins all points: they mostly lie along one wall.
    """
    tree = minimum_spanning_tree(squareform(pdist(less))).tocoo()
    changes = np.linalg.norm(more[tree.row] - more[tree.col], axis=1) / tree.data - 1
    median = float(np.median(changes))
    spread = 1.4826 * float(np.median(np.abs(changes - median)))
    return median, spread * float(np.sqrt(np.pi / 2 / len(changes)))


def _listed(names: Sequence[float] | FloatArray | IntArray) -> str:
    return ", ".join(f"{each:g}" for each in names)


def _matched(places: FloatArray, markers: FloatArray, listed: IntArray | None) -> tuple[IntArray, bool]:
    """The marker of every click, and whether the picture is mirrored: as listed, or else the nearest."""
    size = float(np.sqrt(markers.var(axis=0).sum()))
    misfits = (
        [np.inf] if listed is None else [_misfit(places * [1, sign], markers[listed]) for sign in (1, -1)]
    )
    if listed is None or min(misfits) > FAR * size:
        found = [_nearest(places * [1, sign], markers) for sign in (1, -1)]
        misfits = [misfit for _, misfit in found]
        if min(misfits) > FAR * size:
            raise UserError(
                f"the points at rest do not lie as the markers do: at best {min(misfits):.3g} mm off (rms); "
                "give the points of this drawing, those at rest first"
            )
        listed = found[int(np.argmin(misfits))][0]
    if max(misfits) < UNKNOWN_BY * min(misfits) + ROUNDING * size:
        raise UserError(
            "the points at rest and their mirror image fit the drawing alike; click points off one line, "
            "or give y upwards"
        )
    return listed, misfits[1] < misfits[0]


def _nearest(places: FloatArray, markers: FloatArray) -> tuple[IntArray, float]:
    """The markers of least misfit, mm: from each orientation of the main axes, to the nearest in turns."""
    best = np.arange(len(places)), np.inf
    frames = [np.linalg.svd(each - each.mean(axis=0))[2] for each in (places, markers)]
    spread = [np.sqrt(each.var(axis=0).sum()) for each in (places, markers)]
    for signs in product((1, -1), repeat=2):
        turn = frames[0].T @ np.diag(signs) @ frames[1]
        if np.linalg.det(turn) < 0:
            continue
        moved = (places - places.mean(axis=0)) @ turn * spread[1] / spread[0] + markers.mean(axis=0)
        for _ in range(20):
            apart = np.linalg.norm(moved[:, None] - markers, axis=2)
            owner = linear_sum_assignment(apart**2)[1]
            moved = nearest_similarity(places, markers[owner]).moved(places)
        misfit = _misfit(places, markers[owner])
        if misfit < best[1]:
            best = owner, misfit
    return best


def _misfit(places: FloatArray, markers: FloatArray) -> float:
    """Rms distance of points from the markers after the similarity that brings them nearest, mm."""
    moved = nearest_similarity(places, markers).moved(places)
    return float(np.sqrt(((moved - markers) ** 2).sum(axis=1).mean()))


def _length(places: FloatArray) -> float:
    return float(np.linalg.norm(np.diff(places, axis=0), axis=1).sum())
