"""A step from a finger of the front along exact derivatives: better in every objective, to first order.

A linear program chooses it, within a trust region. Source: J. Nocedal, S. J. Wright, Numerical Optimization,
2nd ed., section 18.5 (sequential linear programming), of which this is one iteration.
"""

from collections.abc import Mapping

import numpy as np
from scipy.optimize import linprog

from pinnray.geometry.cache import finger_mesh
from pinnray.geometry.finger.design import Design
from pinnray.geometry.finger.parameters import Parameters
from pinnray.geometry.finger.rules import broken_rule
from pinnray.runtime.arrays import FloatArray
from pinnray.runtime.errors import UserError
from pinnray.solvers.finger_figures.measures import narrowest_gap, thinnest_wall
from pinnray.solvers.finger_figures.sensitivity import SMALLEST, sensitivity_of
from pinnray.solvers.problem import Problem
from pinnray.solvers.registry import make_solver
from pinnray.solvers.solver import with_law
from pinnray.studies.optimum.question import Question
from pinnray.studies.sweep.job import StudyJob, Task
from pinnray.studies.sweep.measurement import Measurement
from pinnray.studies.sweep.study import WHOLE, Value, physics_of

TRUST = 0.04
"""Longest change of a parameter over its range."""

LEAST_GAIN = 1e-3
"""Gain in every objective, over its size, below which no step is run: another mesh changes as much."""

NUDGE = 1e-3
"""Step of the differences of the smallest wall and gap, over the range."""

SMALLEST_OF = {"thinnest_wall": thinnest_wall, "narrowest_gap": narrowest_gap}


def stepped(
    job: StudyJob[Question], finger: Mapping[str, Value], run: Measurement
) -> dict[str, Value] | None:
    """The finger a step away that is better in every objective and obeys the constraints, to first order.

    Args:
        job: Of the search.
        finger: Values of its varied parameters.
        run: Its result.

    Returns:
        Values of the varied parameters; None where no step gains, or the derivatives are not known.
    """
    question = job.study
    names = steerable(question)
    task = job.task(run.number, finger)
    try:
        slopes = _slopes(question, task, names)
    except UserError:  # such as an equilibrium that is not stable
        return None
    low, high = np.array([question.varied[name].ends for name in names]).T
    at = np.array([float(finger[name]) for name in names])
    reach = TRUST * (high - low)
    rows, limits = [], []
    for name, sense in question.objectives.items():
        sign = 1.0 if sense == "least" else -1.0
        rows.append([*(sign * slopes[name]), abs(run.values[name])])
        limits.append(0.0)
    for name, limit in question.constraints.items():
        for bound, sign in ((limit.at_most, 1.0), (limit.at_least, -1.0)):
            if bound is not None:
                rows.append([*(sign * slopes[name]), 0.0])
                limits.append(sign * (bound - run.values[name]))
    bounds = [*zip(np.maximum(low - at, -reach), np.minimum(high - at, reach), strict=True), (0.0, None)]
    found = linprog([*np.zeros(len(names)), -1.0], np.array(rows), np.array(limits), bounds=bounds)
    if found.status or found.x[-1] < LEAST_GAIN:
        return None
    moved = dict(finger) | dict(zip(names, map(float, at + found.x[:-1]), strict=True))
    return None if broken_rule(Parameters(**job.task(run.number, moved).definition)) else moved


def steerable(question: Question) -> list[str]:
    """The varied parameters that are numbers, of any size within their range."""
    return [
        name
        for name, values in question.varied.items()
        if values.values is None and values.step is None and name not in WHOLE and "." not in name
    ]


def _slopes(question: Question, task: Task, names: list[str]) -> dict[str, FloatArray]:
    """Derivatives of the objectives' and constraints' quantities by parameters, shape (p,) each."""
    design = Design(**task.definition)
    material, load = physics_of(task.physics)
    mesh = finger_mesh(design, settings=task.mesh)
    lawful = with_law(material, make_solver(task.solver, **task.settings))
    found = sensitivity_of(Problem(mesh, lawful, load, finger=design))
    slopes = {}
    for quantity in question.names:
        if quantity in SMALLEST:
            slopes[quantity] = np.array([_difference(design, question, quantity, name) for name in names])
        else:
            known = found.derivatives[quantity]
            slopes[quantity] = np.array([known.get(name, 0.0) for name in names])
    if not all(np.isfinite(each).all() for each in slopes.values()):
        raise UserError("a quantity has no derivative")
    return slopes


def _difference(design: Design, question: Question, quantity: str, name: str) -> float:
    """Central difference of the smallest wall or gap by a parameter; zero for one of material or load."""
    if name not in Parameters.model_fields:
        return 0.0
    low, high = question.varied[name].ends
    step = NUDGE * (high - low)
    ends = [design.replaced(**{name: getattr(design, name) + sign * step}).section for sign in (-1, 1)]
    below, above = map(SMALLEST_OF[quantity], ends)
    return (above - below) / (2 * step)
