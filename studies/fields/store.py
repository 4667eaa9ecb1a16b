"""The file of an emulator of fields, which is fitted once for a sweep."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pinnray.runtime.arrays import FloatArray
from pinnray.runtime.content_hash import content_hash, sources_digest
from pinnray.runtime.machine import package_versions
from pinnray.runtime.stages import Stages
from pinnray.studies.emulator.arrays_file import keep_arrays, kept_arrays
from pinnray.studies.fields.emulator import FieldEmulator, fitted_fields
from pinnray.studies.fields.gaussian_processes import Block
from pinnray.studies.fields.reduction import Modes
from pinnray.studies.fields.snapshots import KnownSamples, Snapshots

FILE = "fields.safetensors"
ARRAYS = ("strength", "units", "known", "lost", "scales", "calibration", "errors")
BLOCKS = ("field", "numbers", "motion")
PARTS = ("inputs", "rates", "weights", "numbers", "factors")


def fields_of(folder: Path, *, refit: bool = False, stages: Stages | None = None) -> FieldEmulator:
    """The emulator of the fields in the folder of a sweep: the one that is kept there, or fitted and kept.

    Args:
        folder: Of the sweep, whose study has `strokes`.
        refit: Fit again although the one kept there is of the same samples.
        stages: Shows the progress of a fit.

    Raises:
        UserError: If the sweep has no fields or too few, or the file of the emulator is damaged.
    """
    known = KnownSamples.of(folder)
    file = folder / FILE
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
    kept = None if refit else kept_arrays(file, digest)
    if kept is not None:
        return _assembled(kept[0], known)
    made = fitted_fields(Snapshots.load(known), stages)
    keep_arrays(file, _parts(made), digest)
    return made


def _parts(emulator: FieldEmulator) -> dict[str, FloatArray]:
    """The arrays of an emulator by name."""
    arrays = {name: getattr(emulator, name) for name in ARRAYS}
    arrays |= {"space.mean": emulator.space.mean, "space.vectors": emulator.space.vectors}
    for name in BLOCKS:
        block: Block | None = getattr(emulator, name)
        if block is not None:
            arrays |= {f"{name}.{part}": getattr(block, part) for part in PARTS}
            arrays |= {f"{name}.mean": block.modes.mean, f"{name}.vectors": block.modes.vectors}
    return arrays


def _assembled(arrays: Mapping[str, FloatArray], known: KnownSamples) -> FieldEmulator:
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
