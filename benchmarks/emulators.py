"""Emulators of a sweep on fingers that they have not seen: error, coverage of the 95 % intervals, and cost.

- `frame + process`: what `pinnray predict` has.
- `process`: the same Gaussian process on the parameters alone.
- `frame + networks`: three networks in PyTorch; intervals by split-conformal calibration on a fifth.
- `frame + boosting`: gradient boosting of scikit-learn; intervals likewise.
- `coarse mesh + process`: finite elements of degree 1 at 2 mm for every answer, and a process for the rest.

The last 1,000 samples of the sweep are not seen. The sweep is made first, in out/benchmark-predict, and goes
on where it was stopped: allow an hour on two cores, and ten minutes for the emulators.
"""

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Protocol

import numpy as np
import torch
from rich.table import Table

from compare.emulator.gaussian_process import LEVEL, GaussianProcess
from compare.emulator.inputs import Inputs
from compare.runtime.stages import Stages
from compare.sweep.measurement import measured
from compare.sweep.study import TaskMaker, load_study
from compare.sweep.sweep import Sweep, SweepJob, run_sweep
from geometry.arrays import FloatArray

STUDY = Path(__file__).with_name("emulators.toml")
OUT = Path("out/benchmark-predict")
UNSEEN = 1000
COUNTS = (250, 500, 1000, 2000, 4000)
COARSE = {"count": 250, "unseen": 250, "mesh_size": 2.0}
SIGNED = ("tip_u", "tip_v", "wrap")
NAMES = ("force", *SIGNED, "compliance_along", "compliance_across", "von_mises", "principal_strain")
STRESSES = 3
"""Inputs that the frame gives: the last columns."""

TIMED = 100
MEMBERS, EPOCHS, WIDTH, BATCH = 3, 300, 128, 64


class Model(Protocol):
    """Predicts logarithms of ratios to the base, or differences from it, with the intervals' half widths."""

    def predict(self, inputs: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Both of shape (q, n)."""


@dataclass(frozen=True)
class Data:
    """Numbers of n fingers: inputs, bases (q, n) and the solver's quantities (q, n)."""

    inputs: FloatArray
    bases: FloatArray
    truth: FloatArray

    def part(self, which: slice) -> "Data":
        """Some of the fingers."""
        return Data(self.inputs[which], self.bases[:, which], self.truth[:, which])

    @property
    def wanted(self) -> FloatArray:
        """What a model learns, shape (q, n)."""
        rows = zip(NAMES, self.truth, self.bases, strict=True)
        return np.array([t - b if name in SIGNED else np.log(t / b) for name, t, b in rows])

    def quantities(self, wanted: FloatArray) -> FloatArray:
        """The quantities of what a model predicts, shape (q, n)."""
        rows = zip(NAMES, wanted, self.bases, strict=True)
        return np.array([b + w if name in SIGNED else b * np.exp(w) for name, w, b in rows])


@dataclass(frozen=True)
class Processes:
    """A Gaussian process for every quantity."""

    each: Sequence[GaussianProcess]

    @classmethod
    def fitted(cls, data: Data) -> "Processes":
        """Fit them."""
        return cls([GaussianProcess.fitted(data.inputs, row) for row in data.wanted])

    def predict(self, inputs: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Mean and half width."""
        values, widths = zip(*(process.predict(inputs) for process in self.each), strict=True)
        return np.array(values), np.array(widths)


@dataclass(frozen=True)
class Calibrated:
    """A model without intervals of its own, and half widths that hold for a fifth that it has not seen."""

    mean: Callable[[FloatArray], FloatArray]
    widths: FloatArray

    @classmethod
    def fitted(cls, fit: Callable[[Data], Callable[[FloatArray], FloatArray]], data: Data) -> "Calibrated":
        """Fit to four fifths and calibrate."""
        cut = len(data.inputs) * 4 // 5
        mean, kept = fit(data.part(slice(cut))), data.part(slice(cut, None))
        residuals = np.sort(np.abs(mean(kept.inputs) - kept.wanted), axis=1)
        count = residuals.shape[1]
        return cls(mean, residuals[:, min(int(np.ceil(LEVEL * (count + 1))), count) - 1])

    def predict(self, inputs: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Mean and half width."""
        values = self.mean(inputs)
        return values, np.broadcast_to(self.widths[:, None], values.shape)


def networks(data: Data) -> Callable[[FloatArray], FloatArray]:
    """Mean of networks with two hidden layers, trained by Adam with a falling rate."""
    torch.set_num_threads(1)
    wanted = data.wanted.T
    centre, spread = wanted.mean(axis=0), wanted.std(axis=0)
    x = torch.tensor(data.inputs, dtype=torch.float32)
    y = torch.tensor((wanted - centre) / spread, dtype=torch.float32)
    members = []
    for seed in range(MEMBERS):
        torch.manual_seed(seed)
        net = torch.nn.Sequential(
            *(torch.nn.Linear(x.shape[1], WIDTH), torch.nn.SiLU()),
            *(torch.nn.Linear(WIDTH, WIDTH), torch.nn.SiLU(), torch.nn.Linear(WIDTH, y.shape[1])),
        )
        steps = EPOCHS * -(-len(x) // BATCH)
        adam = torch.optim.Adam(net.parameters(), lr=3e-3)
        falling = torch.optim.lr_scheduler.CosineAnnealingLR(adam, steps)
        for _ in range(EPOCHS):
            for batch in torch.randperm(len(x)).split(BATCH):
                adam.zero_grad()
                torch.nn.functional.mse_loss(net(x[batch]), y[batch]).backward()
                adam.step()
                falling.step()
        members.append(net)

    def mean(inputs: FloatArray) -> FloatArray:
        with torch.no_grad():
            given = torch.tensor(inputs, dtype=torch.float32)
            answer = torch.stack([net(given) for net in members]).mean(dim=0).numpy()
        return np.asarray((centre + spread * answer).T, dtype=np.float64)

    return mean


def boosting(data: Data) -> Callable[[FloatArray], FloatArray]:
    """Gradient-boosted trees, one model a quantity."""
    from sklearn.ensemble import HistGradientBoostingRegressor

    trees = [
        HistGradientBoostingRegressor(max_iter=300, learning_rate=0.05, random_state=0).fit(data.inputs, row)
        for row in data.wanted
    ]
    return lambda inputs: np.array([each.predict(inputs) for each in trees])


def main() -> Table:
    """Make the sweep, and compare the emulators on it."""
    study = load_study(STUDY)
    with Stages() as stages:
        sweep = run_sweep(SweepJob(study, STUDY.parent, OUT, processes=2), stages)
    base = TaskMaker(study, STUDY.parent).task(0, sweep.samples[0]).definition
    return compared(sweep, Inputs(study, base))


def compared(sweep: Sweep, inputs: Inputs, counts: Sequence[int] = COUNTS) -> Table:
    """The table of a sweep's emulators."""
    good = sweep.good
    fingers = [sweep.samples[each.number] for each in good]
    shapes = [inputs.parameters(finger) for finger in fingers]
    numbers = inputs.numbers(fingers, shapes)
    truth = np.array([[each.values[name] for each in good] for name in NAMES])
    framed = Data(numbers.inputs, np.array([numbers.bases[name] for name in NAMES]), truth)
    bases = np.array([np.full(len(good), 0.0 if name in SIGNED else 1.0) for name in NAMES])
    plain = Data(numbers.inputs[:, :-STRESSES], bases, truth)
    table = Table(title=f"Emulators on {UNSEEN:,} unseen fingers: median relative error, %")
    for column in ("way", "samples", "fit, s", "ms a finger", *NAMES, "coverage, %"):
        table.add_column(column, justify="left" if column == "way" else "right")
    frame_ms = milliseconds(lambda place: inputs.numbers([fingers[place]], [shapes[place]]))
    ways: Mapping[str, tuple[Data, Callable[[Data], Model], float]] = {
        "frame + process": (framed, Processes.fitted, frame_ms),
        "process": (plain, Processes.fitted, 0.0),
        "frame + networks": (framed, partial(Calibrated.fitted, networks), frame_ms),
        "frame + boosting": (framed, partial(Calibrated.fitted, boosting), frame_ms),
    }
    possible = [count for count in counts if count <= len(good) - UNSEEN]
    for way, (data, fit, before) in ways.items():
        for count in possible if way == "frame + process" else possible[-1:]:
            row = judged(data.part(slice(count)), data.part(slice(-UNSEEN, None)), fit, before)
            table.add_row(way, f"{count:,}", *row)
    table.add_row("coarse mesh + process", f"{COARSE['count']}", *coarse_row(sweep, plain))
    return table


def judged(seen: Data, unseen: Data, fit: Callable[[Data], Model], before: float) -> list[str]:
    """Cells of a way: seconds, milliseconds, errors and the range of the coverage."""
    started = time.perf_counter()
    model = fit(seen)
    seconds = time.perf_counter() - started
    each = before + milliseconds(lambda place: model.predict(unseen.inputs[place : place + 1]))
    wanted, width = model.predict(unseen.inputs)
    found = unseen.quantities(wanted)
    errors = 100 * np.median(np.abs(found / unseen.truth - 1), axis=1)
    low, high = unseen.quantities(wanted - width), unseen.quantities(wanted + width)
    held = 100 * ((low <= unseen.truth) & (unseen.truth <= high)).mean(axis=1)
    cells = [f"{seconds:.0f}", f"{each:.1f}", *(f"{error:.3f}" for error in errors)]
    return [*cells, f"{held.min():.1f} to {held.max():.1f}"]


def coarse_row(sweep: Sweep, plain: Data) -> list[str]:
    """Cells of the coarse mesh: fewer samples, because every one has to be solved again."""
    changes = {"mesh_size": COARSE["mesh_size"], "settings": {"degree": 1}}
    maker = TaskMaker(sweep.study.model_copy(update=changes), STUDY.parent)
    places = [*range(int(COARSE["count"])), *range(-int(COARSE["unseen"]), 0)]
    started = time.perf_counter()
    answers = [measured(maker.task(0, sweep.samples[sweep.good[place].number])) for place in places]
    each = 1000 * (time.perf_counter() - started) / len(places)
    bases = np.array([[answer.values[name] for answer in answers] for name in NAMES])
    data = Data(plain.inputs[places], bases, plain.truth[:, places])
    count = int(COARSE["count"])
    return judged(data.part(slice(count)), data.part(slice(count, None)), Processes.fitted, each)


def milliseconds(task: Callable[[int], object]) -> float:
    """Median time of a task on single fingers, ms."""
    times = []
    for place in range(TIMED):
        started = time.perf_counter()
        task(place)
        times.append(time.perf_counter() - started)
    return 1000 * float(np.median(times))
