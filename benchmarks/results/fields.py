"""Fields that an emulator predicts against fields that it has not seen; their sweeps are kept in `out/`.

- `fields`: loads of one finger, docs/examples/loads.toml; half an hour on two cores, then two minutes.
- `friction`: the same with friction, docs/examples/friction.toml; as long.
- `fingers`: fingers of other walls, docs/examples/fingers.toml; an hour on two cores, then five minutes.
"""

from functools import partial
from pathlib import Path

import numpy as np
from rich.table import Table

from benchmarks.tables import DOCS
from pinnray.runtime.arrays import FloatArray
from pinnray.solvers.solution import stroke_axes
from pinnray.studies.fields.emulator import FieldEmulator
from pinnray.studies.fields.reader import FIGURES
from pinnray.studies.fields.snapshots import KnownSamples, Snapshots
from pinnray.studies.fields.store import fields_of
from pinnray.studies.sweep.job import StudyJob
from pinnray.studies.sweep.study import Study
from pinnray.studies.sweep.sweep import run_sweep

STROKES, SEED = 7, 11
"""Of what is unseen: strokes between those of the samples."""

MEASURES = ("displacement", "von Mises stress away from corners", *FIGURES)


def _judged(name: str, paths: int) -> Table:
    """Median and 95th percentile of each relative error, and how many lie within the interval."""
    file = DOCS / "examples" / f"{name}.toml"
    study = Study.load(file)
    unseen = study.model_copy(update={"samples": paths, "strokes": STROKES, "seed": SEED})
    known, others = Path("out") / name, Path("out") / f"{name}-unseen"
    for each, folder in ((study, known), (unseen, others)):
        run_sweep(StudyJob(each, file.parent, folder, processes=2))
    true = Snapshots.load(KnownSamples.of(others))
    errors, within = _compared(fields_of(known), true)
    every = true.numbers[..., 0].size
    title = f"{every} fields that {file.name} has not seen, {every - len(errors)} of them refused"
    table = Table("", "median", "95 %", "within", title=title)
    for measure, column, held in zip(MEASURES, errors.T, within.T, strict=True):
        share = "" if np.isnan(held).any() else f"{held.mean():.1%}"
        table.add_row(measure, f"{np.median(column):.2%}", f"{np.quantile(column, 0.95):.2%}", share)
    return table


def _compared(emulator: FieldEmulator, true: Snapshots) -> tuple[FloatArray, FloatArray]:
    """Relative errors of `MEASURES`, and one where the interval holds, NaN without one, (n, m) each."""
    errors, within = [], []
    for sample, path, numbers in zip(true.known.samples, true.nodal, true.numbers, strict=True):
        if emulator.fault(sample, emulator.stroke):
            continue
        for share, nodal, (force_u, force_v, _, _, width) in zip(true.shares, path, numbers, strict=True):
            found = emulator.predict(sample, share * emulator.stroke)
            load, points = found.problem.load, found.mesh.points
            position, lame = float(load.position or 0), found.problem.material.lame
            stress = emulator.reader.stress(points, nodal, emulator.law, lame)
            counted = emulator.reader.counted(points, position)
            read = emulator.reader.figures(points, nodal, stress, position)
            force = float(stroke_axes(load)[0] @ (force_u, force_v)) * found.mesh.depth
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


loads, friction = partial(_judged, "loads", 72), partial(_judged, "friction", 72)
fingers = partial(_judged, "fingers", 500)
