"""The page of a search: the front, its fingers, and a design file for each."""

from collections.abc import Collection
from pathlib import Path
from typing import Any

import numpy as np

from pinnray.geometry.cache import finger_mesh
from pinnray.geometry.drawing.drawn_finger import finger_from
from pinnray.runtime.atomic import write_text
from pinnray.runtime.html import write_html
from pinnray.runtime.tables import TextTable
from pinnray.solvers.finger_figures import QUANTITIES, heading
from pinnray.solvers.problem import Problem
from pinnray.solvers.registry import make_solver
from pinnray.solvers.solution import Solution
from pinnray.solvers.solver import solved, with_law
from pinnray.studies.optimum.designs import COMMAND, write_designs
from pinnray.studies.optimum.pictures import draw_front, draw_front_fingers, draw_growth
from pinnray.studies.optimum.question import Question
from pinnray.studies.optimum.search import Optimum
from pinnray.studies.sweep.job import StudyJob, Task
from pinnray.studies.sweep.study import physics_of, title, unit_of
from pinnray.studies.sweep.sweep import Sweep
from pinnray.studies.sweep.tables import failure_grid

PAGE = "front.html"

FILES = (
    "front.csv (both tables), front/NN.toml (each finger of the table, in its order), problems/NN.toml "
    "(its whole problem), question.json (the question, versions and hashes), journal.sqlite (every run)"
)

CIRCLE = " Circle: the cylinder where it ends."

SHARP = 0.2
"""Radius of a tip below which it is called sharp, mm: half the line of a common nozzle."""

AT_AN_END = 0.02
"""Share of a range within which a value counts as at its end."""

MOST_AT_ENDS = 2 / 3
"""Share of a front's fingers at ends of a parameter's range from which it is told."""

DRAWN = 6
"""Largest number of fingers that are drawn."""


def write_front(
    optimum: Optimum,
    job: StudyJob[Question],
    folder: Path,
    record: dict[str, Any],
    formats: Collection[str] = (),
    *,
    command: str = COMMAND,
) -> tuple[list[Path], list[Path]]:
    """Write the table, design files, pictures and page of a front.

    Args:
        optimum: The search.
        job: The job that made it.
        folder: Where to write.
        record: Start, durations and machine, from `Stages.record`.
        formats: Of the pictures besides PNG.
        command: That solves the problem in a file, `{}`.

    Returns:
        Page, table and pictures, and a design file for each run on the front.
    """
    tasks = {run: job.task(run, optimum.fingers[run]) for run in optimum.front}
    designs = [
        write_designs(job, task, folder / "front" / f"{place:02d}.toml", command)
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
            "Fingers on the front at rest and under the load, numbered as in the table."
            f"{CIRCLE if any(each.problem.load.radius for each in solutions.values()) else ''}",
        ),
        "growth": (draw_growth(optimum), "Hypervolume of the front over the number of runs."),
    }
    pictures = {each.save(folder / f"{name}.png", formats): text for name, (each, text) in drawn.items()}
    page = write_html(
        folder / PAGE,
        "designs.html.j2",
        title=f"Front of {optimum.question.name}",
        sentences=front_sentences(
            optimum, min(task.definition.get("tip_radius", SHARP) for task in tasks.values()), command
        ),
        tables=page_tables(optimum),
        pictures=pictures,
        note=f"Files beside this page: {FILES}. Started {record['started']}.",
    )
    return [page, folder / "front.csv", *pictures], designs


def front_sentences(optimum: Optimum, sharpest: float = SHARP, command: str = COMMAND) -> list[str]:
    """The search in sentences.

    Args:
        optimum: The search.
        sharpest: Least radius of the tips on the front, mm.
        command: That solves the problem in a file, `{}`.
    """
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
        *ends_sentence(optimum),
        *tip_sentence(sharpest),
        "front/01.toml is the shape of the first finger of the table, for `pinnray design`. "
        f"`{command.format('problems/01.toml')}` solves it with load, material and solver of this search.",
    ]


def ends_sentence(optimum: Optimum) -> list[str]:
    """Which parameters of the front's fingers are at ends of their ranges, in a sentence; else nothing."""
    count, found = len(optimum.front), []
    for name, values in optimum.question.varied.items():
        if values.values is not None:
            continue
        low, high = values.ends
        places = [(float(optimum.fingers[run][name]) - low) / (high - low) for run in optimum.front]
        lower = sum(place <= AT_AN_END for place in places)
        upper = sum(place >= 1 - AT_AN_END for place in places)
        if lower + upper >= MOST_AT_ENDS * count:
            unit = f" {unit_of(name)}".rstrip()
            ends = ((lower, f"{low:g}{unit}"), (upper, f"{high:g}{unit}"))
            found.append(f"{name} ({', '.join(f'{many} at {end}' for many, end in ends if many)})")
    if not found:
        return []
    return [
        f"Of the {count} fingers most lie at an end of the range of {', '.join(found)}: wider ranges would "
        "give other fingers."
    ]


def tip_sentence(radius: float) -> list[str]:
    """What to do about fingers whose tip is a sharp edge; nothing if none is."""
    if radius >= SHARP:
        return []
    return [
        f"Tips are sharp (tip_radius = {radius:g} mm), which `thinnest_wall` does not see and no printer "
        "makes: give tip_radius = 0.5 in [fixed], say."
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


def page_tables(optimum: Optimum) -> list[TextTable]:
    """The columns of `front_grid` in two tables, narrow enough for a page, and runs without a result."""
    grid = front_grid(optimum)
    split = 2 + len(optimum.question.names) + len(optimum.question.varied)
    parts = (range(split), (0, *range(split, len(grid.headings))))
    titles = (grid.title, "Their other quantities")
    failures = failure_grid(as_sweep(optimum))
    tables = [
        TextTable(
            title,
            tuple(_in_lines(grid.headings[column]) for column in part),
            [tuple(_short(row[column]) for column in part) for row in grid.rows],
        )
        for title, part in zip(titles, parts, strict=True)
    ]
    return [*tables, *([failures] if failures.rows else [])]


def as_sweep(optimum: Optimum) -> Sweep:
    """The runs of a search as the samples of a sweep."""
    return Sweep(optimum.question, optimum.fingers, optimum.measurements)


def _in_lines(heading: str) -> str:
    """A heading with a line for each word: the columns stay narrow."""
    return heading.replace("mm_per_N", "mm/N").replace("_", "\n")


def _short(text: str) -> str:
    """A number with four digits, as far as it has more."""
    try:
        return text if text.isdigit() else f"{float(text):.4g}"
    except ValueError:
        return text


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
