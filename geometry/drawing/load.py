"""Reads a drawing, settles its clamp, contact and markers, and places it in the finger's frame."""

import re
from collections.abc import Mapping
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from typing import NamedTuple

import numpy as np

from pinnray.geometry.drawing import proposal
from pinnray.geometry.drawing.checks import body, check_contact, check_markers
from pinnray.geometry.drawing.description import (
    DRAWINGS,
    Description,
    description_beside,
    load_description,
)
from pinnray.geometry.drawing.drawn_finger import DrawnFinger
from pinnray.geometry.drawing.formats.closed_loops import straightened
from pinnray.geometry.drawing.formats.drawing import LABELS, Drawing, place
from pinnray.geometry.drawing.placement import placed, with_part
from pinnray.geometry.drawing.ready_mesh import ready_mesh
from pinnray.geometry.section.loop import Loop
from pinnray.geometry.section.section import Section
from pinnray.runtime.arrays import FloatArray
from pinnray.runtime.content_hash import file_digest
from pinnray.runtime.errors import UserError


class ContactPlace(NamedTuple):
    """The contact in the frame of the drawing."""

    middle: FloatArray  # (2,), mm
    ends: FloatArray | None  # (2, 2), mm, where the drawing has them
    source: str  # `given`, `drawn` or `proposed`


def finger_from_file(path: str | Path, description: Description | None = None) -> DrawnFinger:
    """The finger of a STEP, DXF, SVG or MSH file.

    Args:
        path: The drawing.
        description: Clamp, contact and markers; None means those in the TOML file of the same name beside the
            drawing, if there is one. What neither it nor the drawing has is proposed.

    Raises:
        UserError: In one line, if the drawing cannot be read, is no sound section, or the description does
            not fit it.
    """
    path = Path(path)
    if description is None:
        description = load_description(description_beside(path))
    wanted = description.units, description.plane, description.tolerance
    drawing = read_drawing(path, *wanted, depth_known=description.depth is not None)
    try:
        return finger_of(drawing, description)
    except UserError as error:
        raise UserError(f"{path.name}: {error}") from None


def read_drawing(
    path: Path,
    units: str | None = None,
    plane: str | None = None,
    tolerance: float | None = None,
    *,
    depth_known: bool = False,
) -> Drawing:
    """The curves of a STEP, DXF, SVG or MSH file.

    Args:
        path: The file.
        units: Unit of its coordinates; None means the file's own, or mm.
        plane: Plane in which a solid is cut, such as `z = 6`.
        tolerance: Largest gap between two ends of curves that is closed, mm; None means 0.001 mm.
        depth_known: Whether the depth is given, so that a solid need not be extruded.
    """
    suffix = path.suffix.lower()
    if suffix not in DRAWINGS:
        raise UserError(f"cannot read {path.name} as a drawing; there are {', '.join(DRAWINGS)}")
    if not path.is_file():
        raise UserError(f"there is no drawing {path}")
    if plane is not None and suffix not in (".step", ".stp"):
        raise UserError(f"{path.name} is plane already; a plane cuts solids of STEP files only")
    try:
        digest = file_digest(path)
        kind = suffix[1:].replace("stp", "step")
        read = getattr(import_module(f"pinnray.geometry.drawing.formats.{kind}"), f"read_{kind}")
        solid = {"plane": plane, "depth_known": depth_known} if kind == "step" else {}
        drawing: Drawing = read(path, units, tolerance, **solid)
    except OSError as error:
        raise UserError(f"cannot read the drawing {path}: {error.strerror}") from None
    except UserError as error:
        raise UserError(f"{path.name}: {error}") from None
    return replace(drawing, file=path.name, sha256=digest)


def finger_of(drawing: Drawing, description: Description) -> DrawnFinger:
    """The finger of a drawing with a description; a `UserError` says what does not fit."""
    labelled = body(drawing.loops)
    outline, clamp_source = _clamped(labelled.outline, description, drawing.unit)
    cavities = tuple(straightened(loop.renamed([""] * len(loop.points))) for loop in labelled.cavities)
    section = Section(outline, cavities)
    contact = _contact(drawing, labelled.outline, section, description)
    which, fraction = check_contact(outline, contact.middle)
    points, diameter, marker_sources = _markers(drawing, section, description)
    section, placement = placed(section, which, fraction)
    if contact.ends is None:
        x = float(placement(outline.along(which, fraction))[0, 0])
        proposed = proposal.contact_width(section.outline, x)
        width, width_source = _length(description.contact_width, drawing.unit, None, proposed)
    else:
        ends = placement(contact.ends)[:, 0]
        x, width, width_source = float(ends.mean()), float(np.ptp(ends)), contact.source
        if width < 1e-6:
            raise UserError(
                f"the contact begins and ends at {place(contact.ends[0])}; call only the part contact that "
                "the indenter touches"
            )
    depth, depth_source = _length(description.depth, drawing.unit, drawing.depth, 20.0)
    height, height_source = _length(description.marker_height, drawing.unit, drawing.marker_height, 0.6)
    markers = placement(points)
    markers = markers[np.lexsort((-markers[:, 1], markers[:, 0]))]
    mesh = ready_mesh(drawing.mesh, placement, section, markers, (x, width)) if drawing.mesh else None
    return DrawnFinger(
        name=description.name or _name(drawing.file),
        section=section,
        markers=mesh.markers if mesh else markers,
        contact_abscissa=x,
        contact_width=width,
        depth=depth,
        marker_diameter=diameter,
        marker_height=height,
        file=drawing.file,
        sha256=drawing.sha256,
        note=drawing.note,
        placement=placement,
        sources={
            "clamp": clamp_source,
            "contact": contact.source,
            "contact_width": width_source,
            **marker_sources,
            "marker_height": height_source,
            "depth": depth_source,
        },
        unit=drawing.unit,
        reading={
            key: value for key in ("units", "plane", "tolerance") if (value := getattr(description, key))
        },
        mesh=mesh,
    )


def _clamped(outline: Loop, description: Description, unit: float) -> tuple[Loop, str]:
    """The outline with its clamp as the pieces `base` and no other name, and the clamp's source."""
    if description.clamp is not None:
        outline, source = straightened(outline.renamed([""] * len(outline.points))), "given"
        for pair in description.clamp:
            outline = with_part(outline, unit * np.array(pair), "base")
    else:
        bases = ("base" if LABELS.get(name) == "base" else "" for name in outline.names)
        outline, source = straightened(outline.renamed(bases)), "drawn"
        if "base" not in outline.names:
            outline, source = straightened(proposal.with_clamp(outline)), "proposed"
    if all(name == "base" for name in outline.names):
        raise UserError("the whole outline is clamped; leave a part free")
    return outline, source


def _contact(drawing: Drawing, labelled: Loop, section: Section, description: Description) -> ContactPlace:
    if description.contact is not None:
        return ContactPlace(drawing.unit * np.array(description.contact), None, "given")
    if pieces := list(labelled.pieces("contact")):
        return ContactPlace(*_run(labelled, pieces), "drawn")
    if drawing.contact is not None:
        return ContactPlace(drawing.contact, None, "drawn")
    return ContactPlace(proposal.contact_point(section), None, "proposed")


def _run(loop: Loop, pieces: list[int]) -> tuple[FloatArray, FloatArray]:
    """Middle (2,) and ends (2, 2) of a run of pieces."""
    run, *others = loop.runs(pieces)
    if others:
        raise UserError("the contact is in several parts; call one connected part of the outline contact")
    middle = loop.along(*loop.place_in(run, float(loop.lengths[run].sum()) / 2))[0]
    return middle, np.stack([loop.ends[run[0], 0], loop.ends[run[-1], 1]])


def _markers(
    drawing: Drawing, section: Section, description: Description
) -> tuple[FloatArray, float, Mapping[str, str]]:
    """Centres (m, 2) and diameter of the markers, mm, and the sources of both."""
    given = description.markers
    if isinstance(given, tuple):
        points, source = drawing.unit * np.array(given), "given"
    elif isinstance(given, int):
        points, source = proposal.marker_places(section, given), "proposed"
    elif len(drawing.markers):
        points, source = drawing.markers, "drawn"
    else:
        points, source = proposal.marker_places(section, proposal.MARKERS), "proposed"
    check_markers(section, points, 0.0)
    drawn = drawing.marker_diameter if source == "drawn" else None
    proposed = proposal.marker_diameter(section, points)
    diameter, diameter_source = _length(description.marker_diameter, drawing.unit, drawn, proposed)
    check_markers(section, points, diameter)
    return points, diameter, {"markers": source, "marker_diameter": diameter_source}


def _length(given: float | None, unit: float, drawn: float | None, proposed: float) -> tuple[float, str]:
    """A length, mm, and its source; `given` is in the drawing's unit."""
    if given is not None:
        return given * unit, "given"
    return (proposed, "proposed") if drawn is None else (drawn, "drawn")


def _name(file: str) -> str:
    """The file's name without its suffix, as a finger may be called."""
    return re.sub(r"[^A-Za-z0-9._-]", "-", Path(file).stem).lstrip("._-")[:64] or "drawing"
