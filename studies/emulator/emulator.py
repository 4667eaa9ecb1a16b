"""The emulator of a sweep: fitted to its samples, kept in its folder, asked for any finger in its range."""

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from pinnray.geometry.finger.parameters import Parameters
from pinnray.geometry.finger.section import finger_section
from pinnray.geometry.section.section import Section
from pinnray.runtime.arrays import FloatArray
from pinnray.runtime.errors import UserError
from pinnray.runtime.stages import Stages
from pinnray.solvers.finger_figures import QUANTITIES, heading
from pinnray.solvers.finger_figures.measures import narrowest_gap, thinnest_wall
from pinnray.studies.emulator.gaussian_process import GaussianProcess
from pinnray.studies.emulator.inputs import Features, Inputs
from pinnray.studies.sweep.study import Study, Value, title
from pinnray.studies.sweep.sweep import Sweep

FEWEST = 20
"""Least number of converged samples: of fewer, no residual is exceeded with a probability of 5 %."""

MOST = 4000
"""Largest number of samples that a process is fitted to: time grows with their cube."""

EXACT: Mapping[str, Callable[[Section, Parameters, Study], float]] = {
    "area": lambda section, _, __: section.area,
    "mass": lambda section, shape, study: section.area * shape.depth * study.density / 1000,
    "thinnest_wall": lambda section, _, __: thinnest_wall(section),
    "narrowest_gap": lambda section, _, __: narrowest_gap(section),
}
"""Quantities that follow from the section."""


@dataclass(frozen=True, eq=False)
class Learnt:
    """A quantity that a process predicts.

    Attributes:
        process: Of the logarithm of the quantity over its base, or of the difference over its unit.
        positive: Whether it is the logarithm.
    """

    process: GaussianProcess
    positive: bool


@dataclass(frozen=True, eq=False)
class Emulator:
    """Predicts the quantities of a study's fingers; made by `emulator_of`.

    Attributes:
        inputs: Makes the numbers of fingers.
        learnt: The processes by quantity.
        count: Number of samples that it was fitted to.
    """

    inputs: Inputs
    learnt: Mapping[str, Learnt]
    count: int

    @property
    def study(self) -> Study:
        """The study."""
        return self.inputs.study

    @property
    def names(self) -> tuple[str, ...]:
        """The quantities that it predicts."""
        return tuple(name for name in QUANTITIES if name in {*self.learnt, *EXACT})

    def predict(
        self, fingers: Sequence[Mapping[str, Value]], names: Sequence[str] | None = None
    ) -> dict[str, FloatArray]:
        """Predict quantities of fingers given by the study's varied parameters.

        Args:
            fingers: Values of every varied parameter; see `Inputs.fault`, which is not asked again.
            names: Quantities; None means all. Those that follow from the section alone (`area`, `mass`,
                `thinnest_wall`, `narrowest_gap`) are exact, and take most of the time.

        Returns:
            By quantity, in the order of `pinnray.solvers.finger_figures.QUANTITIES`: predictions, lower and
            upper ends of their 95 % intervals, in its unit, shape (3, n); equal where they are exact.
        """
        chosen = [name for name in self.names if names is None or name in names]
        shapes = [self.inputs.parameters(finger) for finger in fingers]
        found: dict[str, FloatArray] = {}
        if self.learnt.keys() & chosen:
            numbers = self.inputs.numbers(fingers, shapes)
        if EXACT.keys() & chosen:
            pairs = [(finger_section(shape), shape) for shape in shapes]
        for name in chosen:
            if name in self.learnt:
                found[name] = _predicted(self.learnt[name], name, numbers)
            else:
                found[name] = np.tile([EXACT[name](*pair, self.study) for pair in pairs], (3, 1))
        return found


def fitted_emulator(
    sweep: Sweep,
    inputs: Inputs,
    stages: Stages | None = None,
    *,
    names: Collection[str] = QUANTITIES,
    fewest: int = FEWEST,
    quick: bool = False,
) -> Emulator:
    """The emulator of quantities of a sweep's converged samples, of which it needs `fewest`.

    With `quick` the intervals of few samples may be too narrow; see `GaussianProcess.fitted`.

    Raises:
        UserError: If there are too few of them.
    """
    good = sweep.good
    if len(good) < fewest:
        raise UserError(
            f"the sweep {sweep.study.name} has {len(good)} converged samples, and an emulator needs at least "
            f"{fewest}; let `pinnray sweep` finish, or raise samples in the study"
        )
    order = np.random.default_rng(0).permutation(len(good))[:MOST]
    fingers = [sweep.samples[good[place].number] for place in order]
    table = {
        name: np.array([good[place].values.get(name, np.nan) for place in order], dtype=np.float64)
        for name in names
        if name not in EXACT
    }
    known = {name: column for name, column in table.items() if np.isfinite(column).sum() >= fewest}
    numbers = inputs.numbers(fingers, [inputs.parameters(finger) for finger in fingers])
    learnt: dict[str, Learnt] = {}
    with (stages or Stages(quiet=True)).stage("emulator") as progress:
        for place, (name, values) in enumerate(known.items()):
            progress(place / len(known), name)
            learnt[name] = _learnt(values, name, numbers, quick=quick)
        progress(1.0, f"{len(order)} samples")
    return Emulator(inputs, learnt, len(order))


def prediction_table(
    emulator: Emulator, fingers: Sequence[Mapping[str, Value]], found: Mapping[str, FloatArray]
) -> pd.DataFrame:
    """A row for every finger: its varied parameters, and each quantity with the ends of its interval.

    A quantity that is exact for every finger has no columns for the ends.
    """
    columns = {title(name): [finger[name] for finger in fingers] for name in emulator.study.varied}
    for name, (values, low, high) in found.items():
        columns[heading(name)] = values.tolist()
        if (low != high).any():
            columns |= {f"{heading(name)}_low": low.tolist(), f"{heading(name)}_high": high.tolist()}
    return pd.DataFrame(columns)


def _learnt(values: FloatArray, name: str, numbers: Features, *, quick: bool) -> Learnt:
    good = np.isfinite(values)
    base = numbers.bases[name]
    positive = bool((values[good] > 0).all() and (base > 0).all())
    with np.errstate(divide="ignore", invalid="ignore"):
        wanted = np.log(values / base) if positive else (values - base) / numbers.units[name]
    process = GaussianProcess.fitted(numbers.inputs[good], wanted[good], quick=quick)
    return Learnt(process, positive)


def _predicted(learnt: Learnt, name: str, numbers: Features) -> FloatArray:
    """Prediction and both ends of the interval, shape (3, n)."""
    middle, width = learnt.process.predict(numbers.inputs)
    ends = np.stack([middle, middle - width, middle + width])
    if learnt.positive:
        return np.asarray(numbers.bases[name] * np.exp(ends))
    return np.asarray(numbers.bases[name] + numbers.units[name] * ends)
