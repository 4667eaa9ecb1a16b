"""The emulator of a sweep's folder, which is fitted once and kept in the cache."""

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TypeVar

from pinnray.runtime.cache import cache_folder, cached
from pinnray.runtime.content_hash import content_hash, sources_digest
from pinnray.runtime.machine import package_versions
from pinnray.runtime.stages import Stages
from pinnray.runtime.text_files import read_json
from pinnray.studies.emulator.emulator import Emulator, fitted_emulator
from pinnray.studies.emulator.inputs import Inputs
from pinnray.studies.sweep.sweep import STUDY_FILE, load_sweep

Fitted = TypeVar("Fitted")


def emulator_of(folder: Path, stages: Stages | None = None) -> Emulator:
    """The emulator of a sweep's folder: the one that the cache has of the same samples, or fitted and kept.

    Args:
        folder: Of the sweep.
        stages: Shows the progress of a fit.

    Raises:
        UserError: If the folder holds no sweep, too few samples, or a study that cannot be emulated.
    """
    sweep = load_sweep(folder)
    inputs = Inputs(sweep.study, read_json(folder / STUDY_FILE, "sweep").get("finger", {}))
    known = [(sweep.samples[each.number], each.values) for each in sweep.good]
    return kept(inputs, known, sources_digest(__name__), partial(fitted_emulator, sweep, inputs, stages))


def kept(inputs: Inputs, known: object, program: str, fit: Callable[[], Fitted]) -> Fitted:
    """What a fit gives, from the cache if it has been fitted to the same samples by the same program.

    Args:
        inputs: Of the study.
        known: The samples and their results, ready for JSON.
        program: Digest of the sources of the fit.
        fit: Fits it.
    """
    digest = content_hash(
        {
            "study": inputs.study.model_dump(mode="json", exclude={"samples"}),
            "base": inputs.base,
            "known": known,
            "versions": package_versions(),
            "program": program,
        }
    )
    return cached(cache_folder() / f"emulator-{digest}.pickle", "the fit of the emulator", fit)
