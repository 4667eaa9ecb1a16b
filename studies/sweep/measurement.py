"""The work of a worker: one sample from its definition to its quantities."""

import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np

from pinnray.comparison.evaluation.deformed_body import THROUGH_ITSELF, DeformedBody
from pinnray.comparison.evaluation.plausibility import problem_remarks
from pinnray.geometry.finger.parameters import Parameters
from pinnray.geometry.finger.rules import broken_rule
from pinnray.runtime.errors import UserError
from pinnray.solvers.finger_figures import QUANTITIES
from pinnray.solvers.solver import TrainedSolver, TrainingContext, TrainingDiverged
from pinnray.studies.sweep.field_path import FieldPath
from pinnray.studies.sweep.job import Task
from pinnray.studies.sweep.quantities import quantities

Ending = Literal["done", "not converged", "refused", "failed"]
"""`refused`: the design breaks a rule or the solver does not take it; `failed`: an error of the program."""


@dataclass(frozen=True)
class Measurement:
    """What one sample gave.

    Attributes:
        number: Of the sample, or its name.
        state: How it ended.
        message: The solver's sentence, or the reason why there is no result.
        seconds: Time of the worker, meshing included, s.
        values: The quantities by name, ready for JSON; empty if there is no result.
    """

    number: Any
    state: Ending
    message: str
    seconds: float
    values: dict[str, Any] = field(default_factory=dict)

    @property
    def through_itself(self) -> bool:
        """Whether the deformed body goes through itself: a result that no real finger has."""
        return THROUGH_ITSELF in self.message


def sampled(task: Task, _report: Callable[..., None]) -> list[Measurement]:
    """The one sample of a task, as a worker answers."""
    return [measured(task)]


def measured(task: Task) -> Measurement:
    """Draw, mesh and solve one sample.

    Whatever goes wrong with this sample is told in the answer, so that it does not stop the others.
    """
    started = time.perf_counter()

    def ended(state: Ending, message: str, values: dict[str, float] | None = None) -> Measurement:
        words = " ".join(message.split())
        return Measurement(task.number, state, words, time.perf_counter() - started, values or {})

    try:
        if "section" not in task.definition and (fault := broken_rule(Parameters(**task.definition))):
            return ended("refused", fault)
        solver, problem = task.problem()
        if task.checkpoints and isinstance(solver, TrainedSolver):
            solver = solver.in_context(TrainingContext(task.checkpoints, resume=True))
        solution, values = quantities(problem, solver, density=task.density)
    except TrainingDiverged as error:
        return ended("not converged", str(error))
    except UserError as error:
        return ended("failed" if task.checkpoints else "refused", str(error))
    except Exception as error:
        return ended("failed", f"{type(error).__name__}: {error}")
    if task.fields and solution.status.converged:
        FieldPath.of(solution, task.fields.strokes).save(task.fields.file)
    status, _ = DeformedBody(problem.mesh).status(solution)
    said = "; ".join([status.message, *problem_remarks(problem)])
    sometimes = {name for name, quantity in QUANTITIES.items() if not quantity.always}
    if unknown := [name for name, value in values.items() if np.isnan(value) and name not in sometimes]:
        return ended("not converged", f"{', '.join(unknown)} cannot be computed; {said}", values)
    return ended("done" if status.converged else "not converged", said, values)
