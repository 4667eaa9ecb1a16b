"""The page of a search: the front, its fingers, and a design file for each."""

from collections.abc import Collection
from pathlib import Path
from typing import Any

import numpy as np

from compare.runtime.html import write_html
from compare.runtime.tables import TextTable
from geometry.atomic import write_text
from geometry.cache import finger_mesh
from geometry.drawing.drawn_finger import finger_from
from geometry.errors import UserError
from geometry.finger.design import Design
from solvers.finger_figures import QUANTITIES, heading
from solvers.problem import Problem
from solvers.registry import make_solver
from solvers.solution import Solution
from solvers.solver import solved, with_law
from studies.optimum.pictures import draw_front, draw_front_fingers, draw_growth
from studies.optimum.question import Question
from studies.optimum.search import Optimum
from studies.sweep.job import StudyJob, Task
from studies.sweep.study import physics_of, title

PAGE = "front.html"

FILES = (
    "front.csv (the table), front/NN.toml (each finger of the table, in its order), question.json (the "
    "question, versions and hashes), journal.sqlite (every run)"
)

DRAWN = 6
"""Largest number of fingers that are drawn."""


def write_front(
    optimum: Optimum,
    job: StudyJob[Question],
    folder: Path,
    record: dict[str, Any],
    formats: Collection[str] = (),
) -> tuple[list[Path], list[Path]]:
    """Write the table, design files, pictures and page of a front.

    Args:
        optimum: The search.
        job: The job that made it.
        folder: Where to write.
        record: Start, durations and machine, from `Stages.record`.
        formats: Of the pictures besides PNG.

    Returns:
        Page, table and pictures, and a design file for each run on the front.
    """
    tasks = {run: job.task(run, optimum.fingers[run]) for run in optimum.front}
    designs = [
        _write_design(task, folder / "front" / f"{place:02d}.toml")
        for place, task in enumerate(tasks.values(), start=1)
    ]
    grid = front_grid(optimum)
    lines = [",".join(grid.headings), *(",".join(row) for row in grid.rows)]
    write_text(folder / "front.csv", "\n".join(lines) + "\n")
    shown = spread(optimum)
    solutions = {run: _solved(tasks[run]) for run in shown}
    drawn = {
        "front": (draw_front(optimum, shown), "The objectives of every run, with the Pareto front."),
        "fingers": (
            draw_front_fingers(optimum, solutions),
            "Fingers on the front at rest and under the load, numbered as in the table.",
        ),
        "growth": (draw_growth(optimum), "Hypervolume of the front over the number of runs."),
    }
    pictures = {each.save(folder / f"{name}.png", formats): text for name, (each, text) in drawn.items()}
    page = write_html(
        folder / PAGE,
        "designs.html.j2",
        title=f"Front of {optimum.question.name}",
        sentences=front_sentences(optimum),
        tables=[grid],
        pictures=pictures,
        note=f"Files beside this page: {FILES}. Started {record['started']}.",
    )
    return [page, folder / "front.csv", *pictures], designs


def front_sentences(optimum: Optimum) -> list[str]:
    """The search in sentences."""
    question = optimum.question
    senses = " and ".join(f"{sense} {name}" for name, sense in question.objectives.items())
    limits = []
    for name, limit in question.constraints.items():
        bounds = (("at least", limit.at_least), ("at most", limit.at_most))
        words = " and ".join(f"{word} {bound:g}" for word, bound in bounds if bound is not None)
        limits.append(f"{name} {words} {QUANTITIES[name].unit}".rstrip())
    load = [name for name in question.fixed if name in ("load", "stroke", "radius", "law")]
    said = ", ".join(f"{name} = {question.fixed[name]}" for name in load)
    allowed = f", with {', '.join(limits)}" if limits else ""
    crossed = sum(each.through_itself for each in optimum.measurements)
    itself = f" {crossed} runs do not count: the finger goes through itself." if crossed else ""
    return [
        f"Wanted: {senses}{allowed}. {len(optimum.front)} of {len(optimum.measurements)} runs of "
        f"{question.solver} ({said + ', ' if said else ''}elements of {question.mesh_size:g} mm) are on the "
        f"front: none of them is beaten in every objective by another run.{itself} "
        "An emulator proposed fingers; all numbers here are the solver's.",
        "front/01.toml is the design of the first finger of the table, for `compare` and `pinnray design`.",
    ]


def front_grid(optimum: Optimum) -> TextTable:
    """A row for each run on the front: parameters and quantities."""
    varied, first = list(optimum.question.varied), optimum.question.names
    others = [name for name in QUANTITIES if name not in first]
    rows: list[tuple[str, ...]] = []
    for place, run in enumerate(optimum.front, start=1):
        finger, values = optimum.fingers[run], optimum.measurements[run].values
        numbers = [
            *(values[name] for name in first),
            *(finger[name] for name in varied),
            *(values[name] for name in others),
        ]
        texts = (f"{value:.6g}" if isinstance(value, float) else str(value) for value in numbers)
        rows.append((str(place), str(run), *texts))
    headings = ("finger", "run", *map(heading, first), *map(title, varied), *map(heading, others))
    return TextTable("Fingers on the front", headings, rows)


def spread(optimum: Optimum, count: int = DRAWN) -> list[int]:
    """Runs on the front at about equal distances along it, both ends among them."""
    if len(optimum.front) <= count:
        return optimum.front
    costs = np.array([optimum.question.costs(optimum.measurements[run].values) for run in optimum.front])
    steps = np.linalg.norm(np.diff(costs / np.ptp(costs, axis=0), axis=0), axis=1)
    along = np.concatenate([[0.0], np.cumsum(steps)])
    places = [int(np.abs(along - at).argmin()) for at in np.linspace(0, along[-1], count)]
    return [optimum.front[place] for place in dict.fromkeys(places)]


def _solved(task: Task) -> Solution:
    """The solution of a task once more, for its picture."""
    finger = finger_from(task.definition)
    mesh = finger_mesh(finger, settings=task.mesh)
    solver = make_solver(task.solver, **task.settings)
    material, load = physics_of(task.physics)
    return solved(solver, Problem(mesh, with_law(material, solver), load, finger=finger))


def _write_design(task: Task, path: Path) -> Path:
    """Write the parameters of a task's finger that differ from the default ones."""
    finger = finger_from(task.definition)
    if not isinstance(finger, Design):
        raise UserError("a drawing has no parameters to write")
    plain = Design().definition()
    changed = {name: value for name, value in finger.definition().items() if value != plain[name]}
    changed.pop("name", None)
    lines = [f"{name} = {value!r}" for name, value in changed.items()]
    write_text(path, "\n".join(lines) + "\n")
    return path
