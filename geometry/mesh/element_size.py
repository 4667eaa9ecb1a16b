"""Element sizes: fine in walls and ribs, finer at corners and contact if asked, growing into solid parts.

The only module besides `mesher` that imports Gmsh.
"""

from collections.abc import Iterable
from dataclasses import dataclass

import gmsh
import numpy as np

from geometry.finger.design import Design
from geometry.finger.section import back_offset_line
from geometry.mesh.settings import MeshSettings

SAMPLES = 400
"""Sampling points on each curve for Gmsh's distance to it."""

ON_LINE = 1e-6
"""Maximum distance of a curve's middle from a line that it lies on, mm."""


@dataclass(frozen=True)
class Refinement:
    """Elements of `size` within `reach` of some curves or points, all mm."""

    size: float
    reach: float
    curves: tuple[int, ...] = ()
    points: tuple[int, ...] = ()


def refinements(
    design: Design,
    settings: MeshSettings,
    elements_through_thickness: float,
    corners: Iterable[int],
    contact: Iterable[int],
) -> list[Refinement]:
    """Every refinement of the current Gmsh model.

    Args:
        design: The finger.
        settings: Element sizes.
        elements_through_thickness: A wall's thickness over its largest element.
        corners: Gmsh points at the cavities' corners and at the ends of the base.
        contact: Gmsh points at the contact's ends and middle.
    """
    size = settings.size
    thickness = {
        "front": design.front_thickness,
        "back": design.back_thickness,
        "base": design.base_thickness,
        "rib": design.rib_thickness,
    }
    by_kind = _cavity_curves(design)
    found = [
        Refinement(min(size, across / elements_through_thickness), across, curves=by_kind[kind])
        for kind, across in thickness.items()
    ]
    found.append(Refinement(size, 2 * size, curves=by_kind["tip"]))
    found.append(Refinement(min(size, design.fillet_radius / 3), 0.0, curves=by_kind["arc"]))
    found.append(Refinement(min(size, settings.contact_size or size), 0.0, points=tuple(contact)))
    if settings.corner_size is not None:
        found.append(Refinement(min(size, settings.corner_size), 0.0, points=tuple(corners)))
    return [entry for entry in found if entry.curves or entry.points]


def set_sizes(entries: Iterable[Refinement], settings: MeshSettings) -> None:
    """Set Gmsh's size field: the minimum over all refinements, each growing with the distance."""
    field = gmsh.model.mesh.field
    largest = settings.size * settings.coarsening
    thresholds = []
    for entry in entries:
        distance, threshold = field.add("Distance"), field.add("Threshold")
        field.setNumbers(distance, "CurvesList", entry.curves)
        field.setNumbers(distance, "PointsList", entry.points)
        field.setNumber(distance, "Sampling", SAMPLES)
        field.setNumber(threshold, "InField", distance)
        field.setNumber(threshold, "SizeMin", entry.size)
        field.setNumber(threshold, "SizeMax", largest)
        field.setNumber(threshold, "DistMin", entry.reach)
        field.setNumber(threshold, "DistMax", entry.reach + max(largest - entry.size, 1e-9) / settings.growth)
        thresholds.append(threshold)
    smallest = field.add("Min")
    field.setNumbers(smallest, "FieldsList", thresholds)
    field.setAsBackgroundMesh(smallest)
    for option in ("MeshSizeExtendFromBoundary", "MeshSizeFromPoints", "MeshSizeFromCurvature"):
        gmsh.option.setNumber(f"Mesh.{option}", 0)


def _cavity_curves(design: Design) -> dict[str, tuple[int, ...]]:
    """The cavities' curves in the current model by the part of the finger behind them."""
    slope, intercept = back_offset_line(design, design.back_thickness)
    kinds: dict[str, list[int]] = {
        kind: [] for kind in ("front", "back", "base", "tip", "rib", "arc", "outer")
    }
    for _, curve in gmsh.model.getEntities(1):
        low, high = gmsh.model.getParametrizationBounds(1, curve)
        x, y, _ = gmsh.model.getValue(1, curve, [(low[0] + high[0]) / 2])
        distances = {
            "outer": min(abs(x), abs(y), abs(y - (x * slope - design.base_width)) / np.hypot(1, slope)),
            "front": abs(y + design.front_thickness),
            "back": abs(y - slope * x - intercept) / np.hypot(1, slope),
            "base": abs(x - design.base_thickness),
            "tip": abs(x - (design.height - design.tip_length)),
        }
        kind = min(distances, key=distances.__getitem__)
        if distances[kind] > ON_LINE:
            kind = "rib"
        if gmsh.model.getType(1, curve) != "Line":
            kind = "arc"
        kinds[kind].append(curve)
    return {kind: tuple(curves) for kind, curves in kinds.items()}
