"""The explorer: one page with the emulator of a study's fields, which the browser evaluates."""

from pathlib import Path
from typing import Any

import numpy as np

from pinnray.comparison.report.page_body import packed_body
from pinnray.geometry.finger.parameters import SYMBOLS, Parameters
from pinnray.geometry.mesh.triangle_mesh import TriangleMesh
from pinnray.runtime import html
from pinnray.runtime.arrays import FloatArray
from pinnray.runtime.html import Packed
from pinnray.runtime.machine import package_versions
from pinnray.solvers.finger_figures import QUANTITIES, Quantity
from pinnray.solvers.lagrange import LagrangeSpace
from pinnray.solvers.load import Physics
from pinnray.studies.emulator.inputs import WIDE
from pinnray.studies.fields.emulator import FieldEmulator
from pinnray.studies.fields.gaussian_processes import Block
from pinnray.studies.fields.reader import FIGURES
from pinnray.studies.sweep.job import LEAST_MARKERS
from pinnray.studies.sweep.study import PHYSICS, Range, Value, unit_of

STEP = 2e-5
"""Least steps of displacements and places of nodes in the page, mm: over half an element, a thousandth of a
strain of 4 %."""

LARGEST = 0.75
"""Least stress of the last colour over the root mean square of the samples' largest one."""

TITLES = {
    "force": "Force",
    "tip_u": "Tip along the finger",
    "tip_v": "Tip across it",
    "wrap": "Wrap",
    "von_mises": "Largest von Mises stress",
    "contact_width": "Contact zone",
}
"""What the page calls the figures."""

CONTACT_ZONE = Quantity("mm", "deformed length of the front that touches the cylinder")
"""The figure that is no quantity of a finger."""


def write_explorer(emulator: FieldEmulator, path: Path) -> Path:
    """Write the page, atomically.

    Args:
        emulator: Of the study's fields.
        path: HTML file.
    """
    packed = Packed()
    content = manifest(emulator, packed)
    return html.write_html(
        path,
        "explorer.html.j2",
        room="pinnray.studies",
        title=f"Explorer: {emulator.study.name}",
        study=emulator.study,
        count=len(emulator.known),
        stroke=emulator.stroke,
        law=emulator.law,
        median_error=float(np.median(emulator.errors)),
        manifest=content,
        data=packed.text(),
        versions=package_versions(),
    )


def manifest(emulator: FieldEmulator, packed: Packed) -> dict[str, Any]:
    """Everything that the browser needs, with arrays' places in the packed numbers."""
    study, mesh, reader = emulator.study, emulator.mesh, emulator.reader
    middle = {name: round(value, 9) for name, value in study.middle.items()}
    material, load = emulator.inputs.physics(middle)
    unit = material.model_copy(update={"young": 1.0}).lame
    shape = emulator.inputs.parameters(middle)
    own = {name: value for name, value in study.fixed.items() if name in Parameters.model_fields}
    own |= LEAST_MARKERS if emulator.inputs.moves else {}  # those of the design may not fit thin walls
    lower = np.tril_indices(emulator.field.landmarks)
    return {
        "name": study.name,
        "design": study.design,
        "law": emulator.law,
        "plane": material.plane,
        "meshSize": study.mesh_size,
        "stroke": emulator.stroke,
        "shares": emulator.shares.tolist(),
        "spline": np.transpose(emulator.spline.c, (1, 2, 0)).tolist(),
        "parameters": [_parameter(name, values, middle[name]) for name, values in study.varied.items()],
        "fixed": {
            "young": material.young,
            "depth": shape.depth,
            "radius": load.radius,
            "direction": study.fixed.get("direction", 0.0),
            "contact_position": shape.contact_abscissa,
            "friction": load.friction,
            "poisson": material.poisson,
            **own,
        },
        "shapeNames": [*(name for name in study.varied if name in Parameters.model_fields), *own],
        "baseYoung": emulator.young,
        "lame": [unit.λ, unit.μ],
        "figures": [
            {"name": name, "title": TITLES[name], "unit": figure.unit, "meaning": figure.meaning}
            for name, figure in ((name, QUANTITIES.get(name, CONTACT_ZONE)) for name in FIGURES)
        ],
        "colourStress": float(LARGEST * emulator.scales[-1, 1 + FIGURES.index("von_mises")]),
        "thickness": reader.thickness,
        "contactWidth": reader.contact_width,
        **packed_body(mesh, packed),
        "cells": packed.add(LagrangeSpace(mesh, 2).cell_nodes.astype("<u4")),
        "front": packed.add(reader.front.astype("<u4")),
        "base": packed.add(np.unique(mesh.boundary("base")).astype("<u4")),
        "away": packed.add(reader.away.astype("<u2")),
        "space": [
            [packed.add_steps(part, STEP / size) for part in _corners_and_middles(vector, mesh)]
            for vector, size in zip(emulator.space.vectors, _amplitudes(emulator), strict=True)
        ],
        "field": {
            **_block(emulator.field, packed),
            "factors": [packed.add(factor[lower]) for factor in emulator.field.factors],
        },
        "numbers": _block(emulator.numbers, packed),
        "motion": None if emulator.motion is None else _block(emulator.motion, packed, STEP),
        "strength": emulator.strength.tolist(),
        "units": emulator.units.tolist(),
        "errors": packed.add(emulator.error_modes[: len(emulator.field.factors)].astype("<f4")),
        "known": packed.add(emulator.known.astype("<f8")),
        "lost": packed.add(emulator.lost.astype("<f8")),
        "reasons": list(emulator.reasons),
        "scales": emulator.scales.tolist(),
        "calibration": emulator.calibration.tolist(),
    }


def _corners_and_middles(vector: FloatArray, mesh: TriangleMesh) -> tuple[FloatArray, FloatArray]:
    """Displacements of the corners of elements, and of the middles of edges less the mean of the edge's ends.

    These, three nodes in four, are small: they are of the second derivatives.
    """
    corners, middles = np.split(vector.reshape(-1, 2), [len(mesh.points)])
    return corners, middles - corners[mesh.edges].mean(axis=1)


def _block(block: Block, packed: Packed, step: float = 0.0) -> dict[str, Any]:
    """A block's arrays; vectors in steps of their own range, or of `step` in what they are combined to."""
    spreads = block.numbers[1]
    return {
        "inputs": packed.add(block.inputs.astype("<f8")),
        "rates": packed.add(block.rates.astype("<f8")),
        "weights": packed.add(block.weights.astype("<f8")),
        "numbers": packed.add(block.numbers.astype("<f8")),
        "mean": packed.add(block.modes.mean.astype("<f8")),
        "vectors": [
            packed.add_steps(vector, step / spread)
            for vector, spread in zip(block.modes.vectors, spreads, strict=True)
        ],
    }


def _amplitudes(emulator: FieldEmulator) -> FloatArray:
    """Largest coefficients of the displacement's modes at the full stroke, over the samples, shape (r,)."""
    paths = [emulator.field.vector(at).reshape(len(emulator.shares), -1)[-1] for at in emulator.known]
    return np.asarray(np.abs(paths).max(axis=0))


def _parameter(name: str, values: Range, middle: Value) -> dict[str, Any]:
    low, high = values.ends
    model = Parameters if name in Parameters.model_fields else Physics
    described = model.model_fields[name].description or name
    symbols = {parameter: symbol for symbol, parameter in SYMBOLS.items()}
    return {
        "name": name,
        "symbol": symbols.get(name, ""),
        "meaning": described.split(" [")[0].split("; none")[0].replace("`", ""),
        "unit": unit_of(name),
        "low": low,
        "high": high,
        "value": middle,
        "log": low > 0 and high / low >= WIDE,
        "factor": name in ("young", "depth"),
        "shape": name not in PHYSICS,
    }
