"""Fingers that are worth a run: NSGA-II on the emulator, then the largest growth of the hypervolume."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from pymoo.algorithms.moo.nsga2 import NSGA2
from pymoo.core.problem import Problem
from pymoo.optimize import minimize

from pinnray.runtime.arrays import FloatArray
from pinnray.studies.emulator.emulator import Emulator
from pinnray.studies.optimum.front import hypervolume, unbeaten
from pinnray.studies.optimum.question import Question
from pinnray.studies.sweep.sampling import places_of, sample_at
from pinnray.studies.sweep.study import Value

POPULATION, GENERATIONS = 60, 25

HOPE = 0.5
"""Share of the interval's half width by which a prediction is taken better than it is, so that the search
also looks where the emulator knows little."""

APART = 0.02
"""Smallest distance of a proposal from any other run, in the unit cube of the parameters."""


def proposals(
    question: Question,
    emulator: Emulator,
    costs: FloatArray,
    tried: Sequence[Mapping[str, Value]],
    reference: FloatArray,
    *,
    count: int,
    seed: int,
) -> list[dict[str, Value]]:
    """Fingers to run next.

    Args:
        question: Objectives, constraints and parameters.
        emulator: Fitted to the runs so far.
        costs: Of the runs that obey the constraints, shape (n, m).
        tried: The fingers of all runs so far.
        reference: Point of the hypervolume, shape (m,).
        count: Number of fingers.
        seed: Of NSGA-II.
    """
    before = np.array([places_of(question, finger) for finger in tried])
    random = np.random.default_rng(seed).random((POPULATION, before.shape[1]))
    first = np.concatenate([before[-POPULATION // 2 :], random])[:POPULATION]
    found = minimize(
        _Emulated(question, emulator),
        NSGA2(pop_size=POPULATION, sampling=first),
        ("n_gen", GENERATIONS),
        seed=seed,
    )
    people = found.pop.get("X"), found.pop.get("F"), found.pop.get("G")
    places, hoped, excess = (np.asarray(each, dtype=np.float64) for each in people)
    places = np.array([places_of(question, sample_at(question, row)) for row in places])  # of whole numbers
    allowed = (excess <= 0).all(axis=1)
    order = np.argsort(np.maximum(excess, 0).sum(axis=1), kind="stable")
    chosen: list[int] = []

    def apart(number: int) -> bool:
        others = np.concatenate([before, places[chosen]])
        return bool(np.linalg.norm(others - places[number], axis=1).min() > APART)

    known = costs[unbeaten(costs)]
    while len(chosen) < count:
        candidates = [number for number in np.flatnonzero(allowed) if number not in chosen and apart(number)]
        if not candidates:
            break
        volumes = [hypervolume(np.vstack([known, hoped[number]]), reference) for number in candidates]
        best = int(candidates[int(np.argmax(volumes))])
        chosen.append(best)
        known = np.vstack([known, hoped[best]])
    for number in map(int, order):
        if len(chosen) == count:
            break
        if (
            number not in chosen
            and apart(number)
            and emulator.inputs.fault(sample_at(question, places[number])) is None
        ):
            chosen.append(number)
    return [sample_at(question, places[number]) for number in chosen]


class _Emulated(Problem):  # type: ignore[misc] # pymoo has no annotations
    """The question, answered by the emulator, in the unit cube of the parameters."""

    def __init__(self, question: Question, emulator: Emulator) -> None:
        self._question, self._emulator = question, emulator
        super().__init__(
            n_var=len(question.varied),
            n_obj=len(question.objectives),
            n_ieq_constr=1 + len(question.constraints),
            xl=0.0,
            xu=1.0,
        )

    def _evaluate(self, places: FloatArray, out: dict[str, Any], *_: object, **__: object) -> None:
        fingers = [sample_at(self._question, row) for row in places]
        sound = np.array([self._emulator.inputs.fault(finger) is None for finger in fingers])
        costs = np.full((len(fingers), self.n_obj), 1e9)
        excess = np.full((len(fingers), self.n_ieq_constr), 1e9)
        if sound.any():
            good = [finger for finger, fine in zip(fingers, sound, strict=True) if fine]
            predicted = self._emulator.predict(good, self._question.names)
            middle = {name: values for name, (values, _, _) in predicted.items()}
            ends = (predicted[name][1:] for name in self._question.objectives)
            hoped = HOPE * np.array([(high - low) / 2 for low, high in ends])
            costs[sound] = (np.array(self._question.costs(middle)) - hoped).T
            excess[sound] = np.stack([np.zeros(len(good)), *self._question.excesses(middle)], axis=1)
        out["F"], out["G"] = costs, excess
