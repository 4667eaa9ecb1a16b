"""The page of a search: the front, its fingers, and a design file for each."""

from collections.abc import Collection
from dataclasses import replace
from pathlib import Path
from shlex import quote
from typing import Any

import numpy as np
import pandas as pd

from pinnray.runtime.atomic import write_text
from pinnray.runtime.figure import WIDTH
from pinnray.runtime.tables import TextTable
from pinnray.solvers.finger_figures import QUANTITIES, heading
from pinnray.solvers.solution import Solution
from pinnray.solvers.solver import solved, with_law
from pinnray.studies.optimum.designs import COMMAND, PROBLEMS, write_designs
from pinnray.studies.optimum.pictures import draw_front, draw_front_fingers
from pinnray.studies.optimum.question import Question
from pinnray.studies.optimum.search import Optimum
from pinnray.studies.sweep.job import StudyJob, Task
from pinnray.studies.sweep.page import write_page
from pinnray.studies.sweep.study import title
from pinnray.studies.sweep.tables import failure_grid, sample_table

PAGE = "front.html"

FILES = (
    "front.csv (both tables), front/NN.toml (each finger of the table, in its order), problems/NN.toml "
    "(its whole problem), question.json (the question, versions and hashes), journal.sqlite (every run)"
)

CIRCLE = " Circle: the cylinder where it ends."

DRAWN = 6
"""Largest number of fingers that are drawn."""


def write_front(
    optimum: Optimum,
    job: StudyJob[Question],
    folder: Path,
    record: dict[str, Any],
    formats: Collection[str] = (),
    page: float = WIDTH,
) -> tuple[list[Path], list[Path]]:
    """Write the table, design files, pictures and page of a front.

    Args:
        optimum: The search.
        job: The job that made it.
        folder: Where to write.
        record: Start, durations and machine, from `Stages.record`.
        formats: Of the pictures besides PNG.
        page: Width of the pictures, inches.

    Returns:
        Page, table and pictures, and a design file for each run on the front.
    """
    tasks = {run: job.task(run, optimum.samples[run]) for run in optimum.front}
    designs = [
        write_designs(job, task, folder / "front" / f"{place:02d}.toml")
        for place, task in enumerate(tasks.values(), start=1)
    ]
    table = front_table(optimum).to_csv(index=False, lineterminator="\n", float_format="%.6g")
    write_text(folder / "front.csv", table)
    shown = spread(optimum)
    solutions = {run: _solved(tasks[run]) for run in shown}
    drawn = {
        "front": (
            draw_front(optimum, shown, page),
            "Every run, with the fingers of the table; dashed: limits.",
        ),
        "fingers": (
            draw_front_fingers(optimum, solutions, page),
            "Fingers of the table at rest and under the load, by their numbers."
            f"{CIRCLE if any(each.problem.load.radius for each in solutions.values()) else ''}",
        ),
    }
    pages = write_page(
        folder / PAGE,
        f"{optimum.study.heading}: {optimum.study.name}",
        front_sentences(optimum, folder),
        [*page_tables(optimum), failure_grid(optimum)],
        drawn,
        f"{FILES}. Started {record['started']}.",
        formats,
    )
    return [*pages, folder / "front.csv"], designs


def front_sentences(optimum: Optimum, folder: Path) -> list[str]:
    """The search in sentences, and the command that solves the first finger in its folder."""
    question = optimum.study
    limits = []
    for name, limit in question.constraints.items():
        bounds = (("at least", limit.at_least), ("at most", limit.at_most))
        words = " and ".join(f"{word} {bound:g}" for word, bound in bounds if bound is not None)
        limits.append(f"{name} {words} {QUANTITIES[name].unit}".rstrip())
    load = [name for name in question.fixed if name in ("load", "stroke", "radius", "friction", "law")]
    said = ", ".join(f"{name} = {question.fixed[name]}" for name in load)
    allowed = f", with {', '.join(limits)}" if limits else ""
    crossed = sum(each.through_itself for each in optimum.measurements)
    itself = f" {crossed} runs do not count: the finger goes through itself." if crossed else ""
    best = (
        "in the table, the best one first"
        if question.single
        else "on the front: none of them is beaten in every objective by another run"
    )
    command = COMMAND.format(quote(str(folder / PROBLEMS / "01.toml")))
    return [
        f"Wanted: {question.wanted}{allowed}. {len(optimum.front)} of {len(optimum.measurements)} runs of "
        f"{question.solver} ({said + ', ' if said else ''}elements of {question.mesh_size:g} mm) are {best}."
        f"{itself} An emulator proposed fingers; all numbers here are the solver's.",
        "front/01.toml is the shape of the first finger of the table, for `pinnray design`. "
        f"`{command}` solves it with load, material and solver of this search.",
    ]


def front_table(optimum: Optimum) -> pd.DataFrame:
    """The samples on the front in its order: quantities of the question, parameters, other quantities."""
    first, varied = optimum.study.names, optimum.study.varied
    others = [name for name in QUANTITIES if name not in first]
    table = sample_table(optimum).set_index("sample").loc[optimum.front].rename_axis("run")
    table = table[[*map(heading, first), *map(title, varied), *map(heading, others)]].reset_index()
    table.insert(0, "finger", range(1, len(table) + 1))
    return table


def text_table(title: str, table: pd.DataFrame) -> TextTable:
    """A table of numbers with four digits."""
    rows = [[f"{each:.4g}" if isinstance(each, float) else str(each) for each in row] for row in table.values]
    return TextTable(title, list(table.columns), rows)


def page_tables(optimum: Optimum) -> list[TextTable]:
    """The front in tables that are narrow enough for a page."""
    table = front_table(optimum)
    table.columns = table.columns.str.replace("mm_per_N", "mm/N").str.replace("_", "\n")  # narrow ones
    split = 2 + len(optimum.study.names) + len(optimum.study.varied)
    found = [text_table(optimum.study.heading, table.iloc[:, :split])]
    for columns in np.array_split(np.arange(split, len(table.columns)), 2):
        found.append(text_table("Their other quantities", table.iloc[:, [0, *columns]]))
    return found


def spread(optimum: Optimum, count: int = DRAWN) -> list[int]:
    """Runs on the front at about equal distances along it, both ends among them."""
    if len(optimum.front) <= count:
        return optimum.front
    costs = np.array([optimum.study.costs(optimum.measurements[run].values) for run in optimum.front])
    steps = np.linalg.norm(np.diff(costs / np.ptp(costs, axis=0), axis=0), axis=1)
    along = np.concatenate([[0.0], np.cumsum(steps)])
    places = [int(np.abs(along - at).argmin()) for at in np.linspace(0, along[-1], count)]
    return [optimum.front[place] for place in dict.fromkeys(places)]


def _solved(task: Task) -> Solution:
    """The solution of a task once more, for its picture."""
    solver, problem = task.problem()
    return solved(solver, replace(problem, material=with_law(problem.material, solver)))
