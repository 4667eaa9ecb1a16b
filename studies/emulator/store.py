"""The emulator of a sweep's folder, which is fitted once and kept in the cache."""

from functools import partial
from pathlib import Path

import numpy as np

from pinnray.runtime.atomic import write_arrays
from pinnray.runtime.cache import cache_folder, cached
from pinnray.runtime.content_hash import content_hash, sources_digest
from pinnray.runtime.machine import package_versions
from pinnray.runtime.stages import Stages
from pinnray.runtime.text_files import read_json
from pinnray.studies.emulator.emulator import Emulator, Learnt, fitted_emulator
from pinnray.studies.emulator.gaussian_process import GaussianProcess
from pinnray.studies.emulator.inputs import Inputs
from pinnray.studies.sweep.sweep import STUDY_FILE, Sweep, load_sweep

PARTS = ("inputs", "weights", "factor", "lengths", "numbers")


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
    return cached(
        cache_folder() / f"emulator-{digest_of(sweep, inputs)}.npz",
        "the fit of the emulator",
        partial(fitted_emulator, sweep, inputs, stages),
        partial(load, inputs=inputs),
        save,
    )


def digest_of(sweep: Sweep, inputs: Inputs) -> str:
    """SHA-256 of everything that an emulator of the sweep depends on, in hexadecimal."""
    return content_hash(
        {
            "study": sweep.study.model_dump(mode="json", exclude={"samples"}),
            "base": inputs.base,
            "samples": [(sweep.samples[each.number], each.values) for each in sweep.good],
            "versions": package_versions(),
            "program": sources_digest(__name__),
        }
    )


def save(emulator: Emulator, file: Path) -> None:
    """Write an emulator atomically."""
    arrays = {"names": np.array(list(emulator.learnt)), "count": np.array(emulator.count)}
    for name, learnt in emulator.learnt.items():
        arrays[f"{name}.positive"] = np.array(learnt.positive)
        arrays |= {f"{name}.{part}": getattr(learnt.process, part) for part in PARTS}
    write_arrays(file, arrays)


def load(file: Path, inputs: Inputs) -> Emulator:
    """The emulator in a file."""
    with np.load(file) as arrays:
        learnt = {
            name: Learnt(
                GaussianProcess(*(arrays[f"{name}.{part}"] for part in PARTS)),
                bool(arrays[f"{name}.positive"]),
            )
            for name in arrays["names"].tolist()
        }
        return Emulator(inputs, learnt, int(arrays["count"]))
