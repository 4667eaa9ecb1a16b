"""The samples of a study: a grid or a Sobol sequence over its varied parameters."""

import warnings
from collections.abc import Mapping, Sequence
from itertools import product
from math import prod

import numpy as np
from scipy.stats import qmc

from pinnray.runtime.arrays import FloatArray
from pinnray.runtime.errors import UserError
from pinnray.studies.sweep.study import MOST, WHOLE, Range, Study, Value


def samples(study: Study) -> list[dict[str, Value]]:
    """The values of the varied parameters of every sample; the same study has the same samples.

    The first samples of a Sobol sequence are the same however many there are.

    Raises:
        UserError: If a grid has too many.
    """
    names = list(study.varied)
    if study.sampling == "grid":
        axes = [_choices(name, study.varied[name]) or () for name in names]
        if (count := prod(map(len, axes))) > MOST:
            raise UserError(f"the grid has {count:,} samples; at most {MOST:,} can be run")
        return [dict(zip(names, values, strict=True)) for values in product(*axes)]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # that only powers of two are balanced
        places = qmc.Sobol(len(names), rng=np.random.default_rng(study.seed)).random(study.samples)
    return [sample_at(study, row) for row in places]


def sample_at(study: Study, places: FloatArray) -> dict[str, Value]:
    """The sample at places from 0 to 1 of the varied parameters' ranges, shape (d,)."""
    pairs = zip(study.varied.items(), places, strict=True)
    return {name: value_at(name, values, float(at)) for (name, values), at in pairs}


def places_of(study: Study, sample: Mapping[str, Value]) -> list[float]:
    """The places of a sample: the inverse of `sample_at`."""
    return [position_of(name, values, sample[name]) for name, values in study.varied.items()]


def value_at(name: str, values: Range, place: float) -> Value:
    """The value of a parameter at a place from 0 to 1 of its range."""
    if (choices := _choices(name, values)) is not None:
        return choices[min(int(place * len(choices)), len(choices) - 1)]
    low, high = values.ends
    return low + place * (high - low)


def position_of(name: str, values: Range, value: Value) -> float:
    """The place from 0 to 1 of a value in a parameter's range: the inverse of `value_at`."""
    if (choices := _choices(name, values)) is not None:
        return (choices.index(value) + 0.5) / len(choices)
    low, high = values.ends
    return (float(value) - low) / (high - low)


def _choices(name: str, values: Range) -> Sequence[Value] | None:
    """The values that a parameter can have, if they are listed, whole or steps apart; else None."""
    if values.values is not None:
        return values.values
    step = values.step or (1 if name in WHOLE else None)
    if step is None:
        return None
    low, high = values.ends
    steps = range(int((high - low) / step + 1e-9) + 1)
    if name in WHOLE:
        return [int(low + number * step) for number in steps]
    return [round(low + number * step, 9) for number in steps]  # 0.95, not 0.9500000000000001
