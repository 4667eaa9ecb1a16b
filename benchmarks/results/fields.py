"""Fields that an emulator predicts against fields of loads that it has not seen; an hour on two cores.

The study is docs/examples/loads.toml, the unseen loads are 48 other load paths at seven strokes each. Both
are kept in `out/`, so that a second run takes two minutes.
"""

from pathlib import Path

import numpy as np
from rich.table import Table

from benchmarks.tables import DOCS
from geometry.arrays import FloatArray
from studies.fields.emulator import FieldEmulator, grip_force
from studies.fields.reader import FIGURES
from studies.fields.snapshots import KnownSamples, Snapshots
from studies.fields.store import fields_of
from studies.sweep.job import StudyJob
from studies.sweep.study import Study, load_study
from studies.sweep.sweep import run_sweep

STUDY = DOCS / "examples" / "loads.toml"
PATHS, STROKES, SEED = 48, 7, 11
"""Of the unseen loads: strokes between those of the samples."""

MEASURES = ("displacement", "von Mises stress away from corners", *FIGURES)


def main() -> Table:
    """Median and 95th percentile of each relative error, and how many lie within the interval."""
    study = load_study(STUDY)
    unseen = study.model_copy(update={"samples": PATHS, "strokes": STROKES, "seed": SEED})
    known, others = (
        _swept(each, Path("out") / name) for each, name in ((study, "loads"), (unseen, "loads-unseen"))
    )
    emulator = fields_of(known)
    errors, within = _compared(emulator, Snapshots.load(KnownSamples.of(others)))
    table = Table("", "median", "95 %", "within", title=f"{len(errors)} loads that {STUDY.name} has not seen")
    for name, column, held in zip(MEASURES, errors.T, within.T, strict=True):
        share = "" if np.isnan(held).any() else f"{held.mean():.1%}"
        table.add_row(name, f"{np.median(column):.2%}", f"{np.quantile(column, 0.95):.2%}", share)
    return table


def _swept(study: Study, folder: Path) -> Path:
    run_sweep(StudyJob(study, STUDY.parent, folder, processes=2))
    return folder


def _compared(emulator: FieldEmulator, true: Snapshots) -> tuple[FloatArray, FloatArray]:
    """Relative errors of `MEASURES`, and one where the interval holds, NaN without one, (n, m) each."""
    errors, within = [], []
    for sample, path, numbers in zip(true.samples, true.nodal, true.numbers, strict=True):
        for share, nodal, (force_u, force_v, _, _, width) in zip(true.shares, path, numbers, strict=True):
            found = emulator.predict(sample, share * emulator.stroke)
            load, points = found.problem.load, found.mesh.points
            position, lame = float(load.position or 0), found.problem.material.lame
            stress = emulator.reader.stress(points, nodal, emulator.law, lame)
            counted = emulator.reader.counted(points, position)
            read = emulator.reader.figures(points, nodal, stress, position)
            force = grip_force(np.array([force_u, force_v]), load) * found.mesh.depth
            wanted = dict(zip(FIGURES, (force, *read, float(width)), strict=True))
            off = [_relative(found.nodal, nodal), _relative(found.von_mises[counted], stress[counted])]
            held = [float(off[0] <= found.error), np.nan]
            for name, value in wanted.items():
                off.append(abs(found.figures[name] - value) / abs(value))
                low, high = found.intervals[name]
                held.append(float(low <= value <= high))
            errors.append(off)
            within.append(held)
    return np.array(errors), np.array(within)


def _relative(found: FloatArray, true: FloatArray) -> float:
    return float(np.linalg.norm(found - true) / np.linalg.norm(true))
