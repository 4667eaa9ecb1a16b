"""The file of an emulator: arrays as safetensors, the rest as JSON in its header."""

import json
from pathlib import Path

from pinnray.runtime.content_hash import content_hash, sources_digest
from pinnray.runtime.machine import package_versions
from pinnray.runtime.stages import Stages
from pinnray.runtime.text_files import read_json
from pinnray.studies.emulator.arrays_file import keep_arrays, kept_arrays
from pinnray.studies.emulator.emulator import Emulator, Learnt, fitted_emulator
from pinnray.studies.emulator.gaussian_process import GaussianProcess
from pinnray.studies.emulator.inputs import Inputs
from pinnray.studies.sweep.sweep import STUDY_FILE, Sweep, load_sweep

FILE = "emulator.safetensors"
PARTS = ("inputs", "weights", "factor", "lengths", "numbers")


def emulator_of(folder: Path, *, refit: bool = False, stages: Stages | None = None) -> Emulator:
    """The emulator of a sweep's folder: the one that is kept there, or fitted and kept.

    Args:
        folder: Of the sweep.
        refit: Fit again although the one kept there is of the same samples.
        stages: Shows the progress of a fit.

    Raises:
        UserError: If the folder holds no sweep, too few samples, or a study that cannot be emulated; or if
            the file of the emulator is damaged.
    """
    sweep = load_sweep(folder)
    inputs = Inputs(sweep.study, read_json(folder / STUDY_FILE, "sweep").get("finger", {}))
    file, digest = folder / FILE, digest_of(sweep, inputs)
    kept = None if refit else load(file, inputs, digest)
    if kept is None:
        kept = fitted_emulator(sweep, inputs, stages)
        save(file, kept, digest)
    return kept


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


def save(file: Path, emulator: Emulator, digest: str) -> None:
    """Write an emulator atomically, with the digest of what it depends on."""
    arrays = {
        f"{name}.{part}": getattr(learnt.process, part)
        for name, learnt in emulator.learnt.items()
        for part in PARTS
    }
    keep_arrays(
        file,
        arrays,
        digest,
        positive=json.dumps({name: learnt.positive for name, learnt in emulator.learnt.items()}),
        ratios=json.dumps(dict(emulator.ratios)),
        count=str(emulator.count),
    )


def load(file: Path, inputs: Inputs, digest: str) -> Emulator | None:
    """The emulator in a file; None if there is none, or one of something else.

    Raises:
        UserError: If the file is damaged.
    """
    if (content := kept_arrays(file, digest)) is None:
        return None
    arrays, texts = content
    learnt = {
        name: Learnt(GaussianProcess(*(arrays[f"{name}.{part}"] for part in PARTS)), positive)
        for name, positive in json.loads(texts["positive"]).items()
    }
    ratios = {name: (other, ratio) for name, (other, ratio) in json.loads(texts["ratios"]).items()}
    return Emulator(inputs, learnt, ratios, int(texts["count"]))
