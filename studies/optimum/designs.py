"""Files of the fingers on a front: the design, and the whole problem as the search solved it."""

import json
from pathlib import Path
from shlex import quote
from typing import Any

from pinnray.geometry.drawing.drawn_finger import finger_from
from pinnray.geometry.finger.design import Design
from pinnray.runtime.atomic import write_text
from pinnray.runtime.errors import UserError
from pinnray.studies.optimum.question import Question
from pinnray.studies.sweep.job import StudyJob, Task

COMMAND = "pinnray compare --from {}"
"""Solves the problem in a file."""

PROBLEMS = "problems"
"""Folder of the problems, beside that of the designs."""


def write_designs(job: StudyJob[Question], task: Task, path: Path) -> Path:
    """Write the design of a task's finger, and under the same name in `problems` the whole problem.

    `compare` takes its options from there and solves the finger as the search did, wherever the file lies.

    Args:
        job: Of the search.
        task: Of the finger.
        path: Of the design.

    Returns:
        The path of the design.
    """
    problem = path.parent.with_name(PROBLEMS) / path.name
    remark = f"# The shape alone; with load, material and solver: {COMMAND.format(quote(str(problem)))}"
    told = f"# The finger of {path.parent.name}/{path.name} as the search solved it: options of compare"
    for file, head, values in (
        (path, remark, changed_parameters(job, task)),
        (problem, f"{told}\n[options]", problem_options(job, task)),
    ):
        lines = [f"{name} = {json.dumps(value)}" for name, value in values.items()]
        write_text(file, "\n".join([head, *lines]) + "\n")
    return path


def changed_parameters(job: StudyJob[Question], task: Task) -> dict[str, Any]:
    """The parameters of a task's finger that differ from the default ones, with its markers."""
    finger = finger_from(job.marked(task))
    if not isinstance(finger, Design):
        raise UserError("a drawing has no parameters to write")
    plain = Design().definition()
    changed = {name: value for name, value in finger.definition().items() if value != plain[name]}
    changed.pop("name", None)
    return changed


def problem_options(job: StudyJob[Question], task: Task) -> dict[str, Any]:
    """The options of `compare` that make the problem of a task."""
    shape = {"name": task.definition["name"], **changed_parameters(job, task)}
    physics = {name: value for name, value in task.physics.items() if value is not False}
    settings = [f"{task.solver}.{name}={value}" for name, value in task.settings.items()]
    options: dict[str, Any] = {"set": [f"{name}={value}" for name, value in shape.items()], **physics}
    options |= {"solvers": task.solver, "mesh-size": task.mesh.size}
    return options | ({"solver-set": settings} if settings else {})
