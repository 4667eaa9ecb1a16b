"""The emulator of the fields of a sweep's folder, which is fitted once and kept in the cache."""

from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from pinnray.runtime.arrays import FloatArray
from pinnray.runtime.atomic import write_arrays
from pinnray.runtime.cache import cache_folder, cached
from pinnray.runtime.content_hash import content_hash, sources_digest
from pinnray.runtime.machine import package_versions
from pinnray.runtime.stages import Stages
from pinnray.studies.fields.emulator import FieldEmulator, fitted_fields
from pinnray.studies.fields.gaussian_processes import Block
from pinnray.studies.fields.reduction import Modes
from pinnray.studies.fields.snapshots import KnownSamples, Snapshots

ARRAYS = ("strength", "units", "known", "lost", "scales", "calibration", "errors")
BLOCKS = ("field", "numbers", "motion")
PARTS = ("inputs", "rates", "weights", "numbers", "factors")


def fields_of(folder: Path, stages: Stages | None = None) -> FieldEmulator:
    """The emulator of the fields in a sweep's folder: the one that the cache has, or fitted and kept.

    Args:
        folder: Of the sweep, whose study has `strokes`.
        stages: Shows the progress of a fit.

    Raises:
        UserError: If the sweep has no fields or too few.
    """
    known = KnownSamples.of(folder)
    digest = content_hash(
        {
            "study": known.study.model_dump(mode="json", exclude={"samples"}),
            "base": known.inputs.base,
            "samples": [known.samples, known.results],
            "lost": [known.lost, known.reasons],
            "versions": package_versions(),
            "program": sources_digest(__name__),
        }
    )
    return cached(
        cache_folder() / f"fields-{digest}.npz",
        "the fit of the emulator",
        lambda: fitted_fields(Snapshots.load(known), stages),
        partial(load, known=known),
        save,
    )


def save(emulator: FieldEmulator, file: Path) -> None:
    """Write an emulator atomically."""
    arrays = {name: getattr(emulator, name) for name in ARRAYS}
    arrays |= {"space.mean": emulator.space.mean, "space.vectors": emulator.space.vectors}
    for name in BLOCKS:
        block: Block | None = getattr(emulator, name)
        if block is not None:
            arrays |= {f"{name}.{part}": getattr(block, part) for part in PARTS}
            arrays |= {f"{name}.mean": block.modes.mean, f"{name}.vectors": block.modes.vectors}
    write_arrays(file, arrays)


def load(file: Path, known: KnownSamples) -> FieldEmulator:
    """The emulator in a file."""
    with np.load(file) as archive:
        arrays = dict(archive)
    blocks = {
        name: Block(_modes(arrays, name), *(arrays[f"{name}.{part}"] for part in PARTS))
        if f"{name}.mean" in arrays
        else None
        for name in BLOCKS
    }
    parts: Any = {name: arrays[name] for name in ARRAYS} | blocks
    return FieldEmulator(
        inputs=known.inputs,
        mesh=known.meshes.mesh,
        space=_modes(arrays, "space"),
        reasons=known.reasons,
        **parts,
    )


def _modes(arrays: Mapping[str, FloatArray], name: str) -> Modes:
    return Modes(arrays[f"{name}.mean"], arrays[f"{name}.vectors"])
