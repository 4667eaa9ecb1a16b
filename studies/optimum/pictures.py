"""Pictures of a search: the front among all runs, and the fingers on it."""

from collections.abc import Sequence

import numpy as np
from matplotlib.patches import Circle

from pinnray.comparison.figures import body
from pinnray.comparison.figures.canvas import Extent
from pinnray.comparison.figures.layout import HALO, axes_at, wrapped, write_heading
from pinnray.comparison.figures.solver_colours import solver_look
from pinnray.geometry.mesh.boundary import edge_paths
from pinnray.runtime.figure import CONTACT, MUTED, NARROW, SMALL, WIDTH, Figure, figure
from pinnray.runtime.tables import number
from pinnray.solvers.finger_figures import QUANTITIES
from pinnray.solvers.problem import Problem, contact_ends, front_points
from pinnray.solvers.solution import Solution
from pinnray.studies.optimum.search import Optimum, is_allowed
from pinnray.studies.sweep.measurement import Measurement

RUN = "run"
"""Stands for a quantity where the number of a run is meant."""


def draw_front(optimum: Optimum, shown: Sequence[int], page: float = WIDTH) -> Figure:
    """Draw every run over two quantities; the best are filled, the shown ones numbered, limits are dashed.

    The first two objectives; or one over the first quantity with a limit, or over the runs. The page has a
    width in inches.
    """
    question = optimum.study
    limited = (name for name in question.constraints if name not in question.objectives)
    across = [next(limited, RUN)] if question.single else []
    first, second, *third = [*across, *question.objectives]
    rest = f"the third objective, {third[0]}, is not drawn" if third else "every point is a run"
    count = f"{len(optimum.measurements)} runs of {question.solver}; {rest}"
    note = "\n".join(wrapped(text, page) for text in (f"Wanted: {question.wanted}", count))
    head = 0.35 + 0.15 * (note.count("\n") + 1)
    with figure(head + 3.35, page) as drawn:
        write_heading(drawn, question.heading, note)
        axes = axes_at(drawn, (0.7, head, page - 0.9, 2.75))
        others = [each for each in optimum.measurements if each.number not in optimum.front and each.values]
        allowed = np.array([is_allowed(optimum.study, each) for each in others], dtype=bool)
        points = np.array([_place(each, first, second) for each in others]).reshape(-1, 2)
        axes.plot(*points[allowed].T, "o", ms=3.5, mfc="none", c=MUTED, label="other runs")
        if not allowed.all():
            axes.plot(*points[~allowed].T, "x", ms=3.5, c=MUTED, label="impossible or against a constraint")
        best = np.array([_place(optimum.measurements[run], first, second) for run in optimum.front])
        line = "-" if len(question.objectives) == 2 else "none"
        colour = solver_look(question.solver).colour
        axes.plot(*best.T, color=colour, lw=0.8, ls=line)
        axes.scatter(best[:, 0], best[:, 1], s=18, color=colour, zorder=3, label=question.heading.lower())
        for name, limit in ((first, axes.axvline), (second, axes.axhline)):
            for end in question.constraints[name].ends if name in question.constraints else ():
                limit(end, color=MUTED, lw=0.8, ls="--")
        for run in shown[:1] if question.single else shown:  # the best of one objective lie side by side
            axes.annotate(
                str(optimum.place(run)),
                _place(optimum.measurements[run], first, second),
                xytext=(5, 4),
                textcoords="offset points",
                color=CONTACT,
                weight="bold",
                path_effects=HALO,
            )
        axes.set(xlabel=_axis(first), ylabel=_axis(second))
        axes.legend(loc="best")
    return drawn


def draw_front_fingers(optimum: Optimum, solutions: dict[int, Solution], page: float = WIDTH) -> Figure:
    """Draw fingers on the front, at rest and deformed, to one scale.

    Args:
        optimum: The search.
        solutions: Solutions of the runs to draw, by their numbers.
        page: Width of the figure, inches.
    """
    meshes = {run: solution.problem.mesh for run, solution in solutions.items()}
    moved = {run: mesh.points + solutions[run].displacement(mesh.points) for run, mesh in meshes.items()}
    ends = {run: cylinder_at_end(solution.problem) for run, solution in solutions.items()}
    halves = [  # at least the lower half of a cylinder is seen
        np.subtract(each.center, [[each.radius, each.radius], [-each.radius, 0]])
        for each in ends.values()
        if each
    ]
    extent = Extent.around(*(mesh.points for mesh in meshes.values()), *moved.values(), *halves, margin=1)
    columns = 1 if page < NARROW else 2
    width = (page - 0.3) / columns - 0.1
    titles = {run: wrapped(f"{optimum.place(run)}:  {_said(optimum, run)}", width) for run in meshes}
    label = 0.27 + 0.15 * (1 + max(text.count("\n") for text in titles.values()))
    height = width * extent.height / extent.width
    with figure(0.55 + -(-len(meshes) // columns) * (height + label), page) as drawn:
        write_heading(drawn, optimum.study.heading, "grey: at rest; black: under the load; all to one scale")
        for place, (run, mesh) in enumerate(meshes.items()):
            row, column = divmod(place, columns)
            box = (0.1 + column * (width + 0.2), 0.5 + row * (height + label) + label, width, height)
            axes = axes_at(drawn, box)
            body.prepare(axes, extent)
            paths = edge_paths(mesh.boundary_edges)
            body.draw_outline(axes, paths, mesh.points, colour="#b0b0b0", width=0.6)
            body.draw_outline(axes, paths, moved[run], width=0.8)
            if circle := ends[run]:
                axes.add_patch(circle)
            axes.set_title(titles[run], size=SMALL, loc="left")
    return drawn


def cylinder_at_end(problem: Problem) -> Circle | None:
    """The cylinder of the load where it ends; None for other loads."""
    if problem.load.radius is None:
        return None
    middle = front_points(problem.mesh, np.array([np.mean(contact_ends(problem))]))[0]
    centre = middle + problem.load.values + np.array([0.0, problem.load.radius])
    return Circle((centre[0], centre[1]), problem.load.radius, fill=False, color=CONTACT, lw=0.8)


def _said(optimum: Optimum, run: int) -> str:
    """The first quantities of the question, of a run."""
    values = optimum.measurements[run].values
    words = (f"{name} {number(values[name], 3)} {_unit(name)}" for name in optimum.study.names[:3])
    said = ", ".join(words).replace("mises", "Mises").replace(" °", "°")
    return said.replace("_", "\N{NO-BREAK SPACE}")


def _place(run: Measurement, first: str, second: str) -> tuple[float, float]:
    """The place of a run in the picture."""
    values = {RUN: run.number, **run.values}
    return values[first], values[second]


def _axis(name: str) -> str:
    unit = "" if name == RUN else _unit(name)
    return f"{name}, {unit}" if unit else name


def _unit(name: str) -> str:
    return QUANTITIES[name].unit.replace("deg", "°")
