"""Derivatives of a finger's figures by its parameters, those of its material and of its load."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from math import atan2, cos, degrees, hypot, radians, sin
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from pinnray.geometry.finger.design import Design
from pinnray.geometry.finger.parameters import parameter_info
from pinnray.geometry.mesh.design_motion import MovingMesh
from pinnray.geometry.mesh.wall_motion import WallMotion
from pinnray.runtime.errors import UserError
from pinnray.solvers.fem.boundary_conditions import reaction_by_residual_work
from pinnray.solvers.fem.finite_strain.load_path import LoadPath
from pinnray.solvers.fem.finite_strain.solver import FemNonlinearSolver
from pinnray.solvers.fem.linear import FemSolver
from pinnray.solvers.finger_figures.figures import QUANTITIES, FingerFigures, figures_of
from pinnray.solvers.lagrange import LagrangeField, LagrangeSpace
from pinnray.solvers.problem import Problem
from pinnray.solvers.solution import Solution, Status
from pinnray.solvers.solver import NoSolutionError, Progress, silent

if TYPE_CHECKING:
    import pandas as pd

    from pinnray.runtime.figure import Figure

STEP = 1e-2
"""Step of a parameter, mm, or of Young's modulus over its value; ten times as much of an angle, degrees, and
a tenth as much of Poisson's ratio, on which much depends near 0.5."""
WALLS = ("front_thickness", "back_thickness", "rib_thickness", "base_thickness")
"""Whose thickness a print misses."""
LEFT_OUT = ("marker_diameter", "marker_height")
"""Parameters on which no figure depends."""
SMALLEST = ("thinnest_wall", "narrowest_gap")
"""Figures without derivatives: the smallest of several, which often are equal."""
LEAST = 0.005
"""Smallest share that `plot` shows, percent per percent."""


class VariedParameter(NamedTuple):
    """A parameter with the problems a step below and above it."""

    name: str
    value: float
    unit: str
    step: float
    low: Problem
    high: Problem


@dataclass(frozen=True, eq=False)
class LocalSensitivity:
    """Derivatives of a finger's figures by its parameters.

    Attributes:
        solution: About which the figures change.
        figures: What the finger does.
        values: Of the parameters, in `units`.
        derivatives: Of the figures of `QUANTITIES`, but for the smallest wall and gap, by every parameter, in
            the figure's unit over the parameter's; NaN where a figure is not known.
    """

    solution: Solution
    figures: FingerFigures
    values: Mapping[str, float]
    units: Mapping[str, str]
    derivatives: Mapping[str, Mapping[str, float]]

    def relative(self, figure: str) -> dict[str, float]:
        """Change of a figure in percent per percent of each parameter; NaN where the parameter is zero."""
        slopes, own = self._of(figure), getattr(self.figures, figure)
        return {
            name: slope * self.values[name] / own if own and self.values[name] else float("nan")
            for name, slope in slopes.items()
        }

    def tolerance(self, figure: str, *, wall_error: float = 0.1, young_error: float = 0.1) -> float:
        """Half of the 95 % interval of a figure over many prints.

        Args:
            figure: Its name.
            wall_error: Half of the 95 % interval of every wall's thickness, mm; walls err independently.
            young_error: The same of Young's modulus, over its value.
        """
        errors = dict.fromkeys(WALLS, wall_error) | {"young": young_error * self.values["young"]}
        slopes = self._of(figure)
        return float(np.sqrt(sum((slopes[name] * errors[name]) ** 2 for name in errors if name in slopes)))

    def rows(self) -> list[dict[str, float | str]]:
        """A row for each parameter: its value, its unit, and the derivative of every figure that is known."""
        known = [name for name in self.derivatives if np.isfinite(getattr(self.figures, name))]
        rows = []
        for name, value in self.values.items():
            row: dict[str, float | str] = {"parameter": name, "value": value, "unit": self.units[name]}
            rows.append(row | {figure: self.derivatives[figure][name] for figure in known})
        return rows

    def table(self) -> "pd.DataFrame":
        """`rows` as a data frame."""
        import pandas as pd

        return pd.DataFrame(self.rows()).set_index("parameter")

    def plot(self, name: str = "force") -> "Figure":
        """A bar for each parameter: percent of a figure per percent of it, the largest on top."""
        from pinnray.runtime.figure import CONTACT, INK, WIDTH, figure

        shares = {each: share for each, share in self.relative(name).items() if abs(share) >= LEAST}
        if not shares:
            raise UserError(f"no parameter changes {name}, which is {getattr(self.figures, name):.4g}")
        order = sorted(shares, key=lambda each: abs(shares[each]))
        room, side = 0.19 * len(order), 1.45  # inches
        total = room + 0.95
        with figure(total) as drawn:
            axes = drawn.add_axes((side / WIDTH, 0.5 / total, (WIDTH - side - 0.3) / WIDTH, room / total))
            lengths = [shares[each] for each in order]
            axes.barh(order, lengths, color=[INK if each > 0 else CONTACT for each in lengths], height=0.6)
            for row, length in enumerate(lengths):
                away, side_of = (4, "left") if length > 0 else (-4, "right")
                where: dict[str, Any] = {"textcoords": "offset points", "ha": side_of, "va": "center"}
                axes.annotate(
                    f"{length:+.2g}".replace("-", "\N{MINUS SIGN}"), (length, row), (away, 0), **where
                )
            axes.axvline(0, color=INK, lw=0.6)
            axes.margins(x=0.14, y=0.02)
            axes.spines["left"].set_visible(False)
            axes.tick_params(axis="y", length=0)
            axes.set_xlabel("percent per percent of the parameter")
            value, unit = getattr(self.figures, name), QUANTITIES[name].unit
            drawn.text(0.12 / WIDTH, 1 - 0.14 / total, f"{name}, {value:.4g} {unit}", weight="bold", va="top")
        return drawn

    def _of(self, figure: str) -> Mapping[str, float]:
        if figure not in self.derivatives:
            raise UserError(f"there is no figure {figure!r}; there are {', '.join(self.derivatives)}")
        return self.derivatives[figure]


def sensitivity_of(problem: Problem, progress: Progress = silent, degree: int = 2) -> LocalSensitivity:
    """Derivatives of a finger's figures by every continuous parameter that it has.

    They are central differences of solutions on a mesh that follows the parameters, each from the equilibrium
    of the finger itself, and have three digits or more. A parameter at zero, such as a fillet that is not
    there, has none.

    Args:
        problem: Of a design, or of a drawn finger, of whose section the walls' thicknesses are varied.
        progress: Called as it proceeds.
        degree: Of the elements, 1 or 2.

    Raises:
        UserError: If there is friction, whose forces depend on the way to the load.
        NoSolutionError: If the full load is not reached.
    """
    if problem.load.friction:
        raise UserError("derivatives are without friction, whose forces depend on the way to the load")
    parameters = list(_parameters(problem))
    solution, near = _solved(problem, degree, lambda share, text: progress(0.5 * share, text))
    derivatives: dict[str, dict[str, float]] = {name: {} for name in QUANTITIES if name not in SMALLEST}
    for number, each in enumerate(parameters):
        low, high = (_values(near(end)) for end in (each.low, each.high))
        for name, slopes in derivatives.items():
            slopes[each.name] = (high[name] - low[name]) / (2 * each.step)
        progress(0.5 + 0.5 * number / len(parameters), each.name)
    values = {each.name: each.value for each in parameters}
    units = {each.name: each.unit for each in parameters}
    return LocalSensitivity(solution, figures_of(solution), values, units, derivatives)


def _solved(
    problem: Problem, degree: int, progress: Progress
) -> tuple[Solution, Callable[[Problem], Solution]]:
    """The solution by `fem` or `fem-nonlinear`, as the law is, and a function for problems near it."""
    if problem.material.law == "linear":
        linear = FemSolver(degree=degree, estimate=False)
        return linear.solve(problem), linear.solve
    solver = FemNonlinearSolver(degree=degree)

    def path(of: Problem) -> LoadPath:
        return solver.path(of, LagrangeSpace(of.mesh, degree))

    whole = path(problem)
    followed = solver.followed(solver.coarser(problem), whole, progress)
    start = whole.points[-1]
    if start.fraction < 1:
        raise NoSolutionError(whole.phrase)
    solution = _at_end(problem, whole)
    followed.close()

    def near(other: Problem) -> Solution:
        own = path(other)
        if (state := own.settled_from(start)) is None:
            raise NoSolutionError("a finger that is a little different has no equilibrium near; see solve")
        own.points.append(state)
        found = _at_end(other, own)
        own.close()
        return found

    return solution, near


def _at_end(problem: Problem, path: LoadPath) -> Solution:
    nodal, equilibrium = path.points[-1].nodal, path.equilibrium
    return Solution(
        solver=FemNonlinearSolver.name,
        problem=problem,
        field=LagrangeField(path.space.section, nodal),
        energy=equilibrium.energy(nodal),
        reaction=reaction_by_residual_work(path.space, equilibrium.internal_force(nodal)),
        status=Status(True, "the full load alone"),
        stats={},
    )


def _values(solution: Solution) -> dict[str, float]:
    """The figures; area and mass are those of the mesh, which alone follows the walls of a drawn finger."""
    found, area = figures_of(solution).values(), float(solution.problem.mesh.areas.sum())
    return found | {"area": area, "mass": found["mass"] * area / found["area"]}


def _parameters(problem: Problem) -> Iterator[VariedParameter]:
    """The parameters on which the problem depends."""
    if isinstance(problem.finger, Design):
        yield from _of_design(problem, problem.finger)
    else:
        yield from _of_walls(problem)
    material, load = problem.material, problem.load

    def varied(
        name: str, value: float, unit: str, step: float, at: Callable[[float], Problem]
    ) -> VariedParameter:
        return VariedParameter(name, value, unit, step, at(value - step), at(value + step))

    def of_constant(name: str) -> Callable[[float], Problem]:
        return lambda to: replace(problem, material=material.model_copy(update={name: to}))

    def moved(u: float, v: float) -> Problem:
        ways = zip(load.displacement, (u, v), strict=True)
        given = tuple(None if old is None else float(new) for old, new in ways)
        return replace(problem, load=load.model_copy(update={"displacement": given}))

    yield varied("young", material.young, "MPa", STEP * material.young, of_constant("young"))
    yield varied("poisson", material.poisson, "", 0.1 * STEP, of_constant("poisson"))
    u, v = (value or 0.0 for value in load.displacement)
    stroke, angle = hypot(u, v), atan2(u, -v)
    yield varied("stroke", stroke, "mm", STEP, lambda to: moved(u * to / stroke, v * to / stroke))
    if None not in load.displacement:

        def turned(degrees: float) -> Problem:
            return moved(stroke * sin(radians(degrees)), -stroke * cos(radians(degrees)))

        yield varied("direction", degrees(angle), "deg", 10 * STEP, turned)
    if load.radius is not None:

        def rounded(radius: float) -> Problem:
            return replace(problem, load=load.model_copy(update={"radius": radius}))

        yield varied("radius", load.radius, "mm", STEP, rounded)


def _of_walls(problem: Problem) -> Iterator[VariedParameter]:
    motion = WallMotion.of(problem.mesh)
    for name, thickness in zip(motion.names, motion.thickness.tolist(), strict=True):
        low, high = (
            replace(problem, mesh=replace(problem.mesh, points=motion.moved(motion.changes({name: to}))))
            for to in (thickness - STEP, thickness + STEP)
        )
        yield VariedParameter(name, thickness, "mm", STEP, low, high)


def _of_design(problem: Problem, design: Design) -> Iterator[VariedParameter]:
    mesh = MovingMesh(problem.mesh, design)
    for name, field in Design.model_fields.items():
        value = design.contact_abscissa if name == "contact_position" else getattr(design, name)
        if name in LEFT_OUT or field.annotation not in (float, float | None) or value is None:
            continue
        unit = str(parameter_info(name, "unit"))
        step = 10 * STEP if unit == "deg" else STEP
        ends = []
        for to in (value - step, value + step):
            try:
                finger = design.replaced(**{name: to})
            except UserError:  # at an end of its range, or a feature that is not there
                break
            if (moved := mesh.of(finger)) is None:
                break
            ends.append(replace(problem, mesh=moved, finger=finger))
        if len(ends) == 2 and ends[0].mesh.digest != ends[1].mesh.digest:
            yield VariedParameter(name, float(value), unit, step, *ends)
