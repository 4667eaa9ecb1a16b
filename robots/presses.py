"""A finger pressed by a cylinder at several places: what robot models are fitted to and scored against."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from pinnray.runtime.arrays import FloatArray
from pinnray.runtime.errors import UserError
from pinnray.solvers.contact.cylinder import touching_centre
from pinnray.solvers.problem import Load, Problem
from pinnray.solvers.registry import make_solver
from pinnray.solvers.solution import Solution
from pinnray.solvers.solver import Progress, check_law, silent, solved, with_law

FIRST, LAST = 0.2, 0.7
"""Places of the cylinder for the fit, as fractions of the front face from base to tip.

The first is at least the cylinder's radius from the base. Half way between neighbours are the places for the
score, each with two loads: at about half of the stroke and at the full one.
"""
SMALL = tuple(np.linspace(0.1, 0.9, 9))
"""Places of the small loads that the fit takes from `fem`."""


@dataclass(frozen=True, eq=False)
class Press:
    """One equilibrium of the pressed finger."""

    place: float  #: Abscissa where the indenter touched first, mm
    centre: FloatArray  #: Of the cylinder when it touched, shape (2,), mm
    travel: float  #: Of the indenter into the finger, mm
    force: FloatArray  #: On the finger for the whole depth, shape (2,), N
    force_place: float  #: Abscissa, before the load, of the force, mm
    moved: FloatArray  #: Displacements of the front's points, shape (m, 2), mm


@dataclass(frozen=True, eq=False)
class PressedFinger:
    """A finger and its equilibria under a cylinder.

    Attributes:
        problem: Mesh, material of finite strain and the cylinder's largest travel.
        front: Points of the front face from base to tip, shape (m, 2), mm.
        small: Small loads by the linear law.
        fitted: Equilibria to fit: all on the way to each full stroke.
        held_out: Equilibria to score, at places between those of `fitted`.
        lost: A line for every load that `fem-nonlinear` did not reach.
    """

    problem: Problem
    front: FloatArray
    small: tuple[Press, ...]
    fitted: tuple[Press, ...] = ()
    held_out: tuple[Press, ...] = ()
    lost: tuple[str, ...] = ()

    @property
    def full(self) -> list[Press]:
        """The last of the fitted equilibria at each place."""
        return list({each.place: each for each in self.fitted}.values())

    @property
    def radius(self) -> float:
        """Radius of the cylinder, mm."""
        return float(self.problem.load.radius or 0)


def press(problem: Problem, progress: Progress = silent, *, scored: bool, places: int) -> PressedFinger:
    """Press a finger at the places to fit and at those to score.

    The travel is the load's stroke from the finger's own contact on; nearer to the base it is less, in
    proportion, so that the front turns by about one angle everywhere.

    Args:
        problem: The finger, and a cylinder without friction that moves into it.
        progress: See `Solver`.
        scored: Whether to press at the places for the score, too.
        places: Number of places for the fit.

    Raises:
        UserError: If the load is another one, or too few are reached.
    """
    load = problem.load
    if load.kind != "cylinder" or load.friction or load.displacement[0] != 0.0:
        raise UserError(
            "a robot model is fitted under a cylinder without friction that moves into the finger"
        )
    solver = make_solver("fem-nonlinear")
    check_law([solver], problem.material)
    problem = replace(problem, material=with_law(problem.material, solver), observations=None)
    finger = at_rest(problem)
    start, end = finger.front[[0, -1], 0]
    own = float(problem.mesh.points[problem.mesh.contact_node, 0])
    shares = np.linspace(max(FIRST, finger.radius / (end - start)), LAST, 2 * places - 1)
    fitted, held_out = shares[::2], shares[1::2] if scored else shares[:0]
    found: dict[float, list[Press]] = {}
    lost = []
    for count, share in enumerate(asked := [*fitted, *held_out]):
        place = float(start + share * (end - start))
        progress(count / len(asked), f"cylinder at x = {place:.3g} mm")
        stroke = -float(load.values[1]) * min(1.0, (place - start) / (own - start))
        there = Load("cylinder", stroke=stroke, position=place, radius=load.radius)
        solution = solved(solver, replace(problem, load=there), silent)
        if solution.status.converged:
            found[share] = _along(solution, finger.front, place, stroke)
        else:
            lost.append(f"{stroke:.3g} mm at x = {place:.3g} mm is left out: {solution.status.message}")
    for needed, least in ((fitted, 2), (held_out, min(1, len(held_out)))):
        if len(found.keys() & set(needed)) < least:
            raise UserError(f"fem-nonlinear reaches too few loads; take a smaller stroke ({lost[0]})")
    return replace(
        finger,
        fitted=tuple(each for share in fitted for each in found.get(share, [])),
        held_out=tuple(each for share in held_out for each in _half_and_full(found.get(share, []))),
        lost=tuple(lost),
    )


def _along(solution: Solution, front: FloatArray, place: float, stroke: float) -> list[Press]:
    """The equilibria along the travel in which the cylinder touches."""
    mesh, history = solution.problem.mesh, solution.history
    forces = mesh.depth * np.stack([history["reaction_x"], history["reaction_y"]], axis=1)
    where, centre = mesh.locate(front), touching_centre(solution.problem)
    return [
        Press(
            place=place,
            centre=centre,
            travel=float(stroke * history["load_fraction"][row]),
            force=forces[row],
            force_place=float(history["force_abscissa_mm"][row]),
            moved=state.displacement(where),
        )
        for row, state in enumerate(solution.states)
        if history["load_fraction"][row] > 0 and forces[row].any()
    ]


def _half_and_full(along: Sequence[Press]) -> list[Press]:
    if not along:
        return []
    half = min(along, key=lambda each: abs(each.travel - along[-1].travel / 2))
    return [along[-1]] if half is along[-1] else [half, along[-1]]


def at_rest(problem: Problem) -> PressedFinger:
    """A finger with small loads by `fem` only: 1 mm along it or into it, without a move in the other way."""
    from pinnray.solvers.fem.linear import FemSolver

    nodes = problem.mesh.points[np.unique(problem.mesh.boundary("front"))]
    front = nodes[nodes[:, 0].argsort()]
    linear = problem.material.model_copy(update={"law": "linear"})
    prepared = FemSolver(estimate=False).prepare(replace(problem, load=Load(), material=linear))
    where = problem.mesh.locate(front)
    small = []
    for share in SMALL:
        place = float(front[0, 0] + share * np.ptp(front[:, 0]))
        for way in ((1.0, 0.0), (0.0, -1.0)):
            solution = prepared.solve(Load(displacement=way, position=place))
            force = problem.mesh.depth * solution.reaction
            small.append(
                Press(place, np.full(2, np.nan), 1.0, force, place, solution.field.displacement(where))
            )
    prepared.destroy()
    return PressedFinger(problem, front, tuple(small))
