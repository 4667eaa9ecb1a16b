"""The course of a filmed finger, and the indenter's true force in every frame."""

import numpy as np
from scipy.interpolate import CubicSpline

from pinnray.runtime.tables import Cell
from pinnray.solvers.solution import Solution, stroke_axes
from pinnray.vision.rig.motion import Course
from pinnray.vision.rig.recording import Recording

LONGEST_STEP = 0.05
"""Longest load step of a filmed simulation: a spline through its equilibria is then exact to micrometres."""


def filmed_course(solution: Solution) -> Course | None:
    """The nodal displacements of a solution on the way to its load; None for a linear one."""
    if not solution.states:
        return None
    nodes = solution.problem.mesh.at_nodes()
    states = np.array([state.displacement(nodes) for state in solution.states])
    return Course(solution.history["load_fraction"], states)


def true_forces(solution: Solution, recording: Recording, depth: float) -> list[dict[str, Cell]]:
    """A row for every frame: the force of the indenter along and across its stroke, and where it acts.

    Args:
        solution: Behind the recording's course.
        recording: The film.
        depth: Of the finger, mm.
    """
    history = solution.history
    if solution.states:
        shares = history["load_fraction"]
        forces = np.column_stack([history["reaction_x"], history["reaction_y"]])
    else:
        shares, forces = np.array([0.0, 1.0]), np.array([np.zeros(2), solution.reaction])
    components = CubicSpline(shares, depth * forces @ stroke_axes(solution.problem.load).T)
    places = history.get("force_abscissa_mm")
    place = None if places is None else CubicSpline(shares, places)
    rows: list[dict[str, Cell]] = []
    for number in range(len(recording.motion)):
        load = recording.load(number)
        force, across = components(load).tolist()
        rows.append(
            {
                "frame": number,
                "time_s": number / recording.motion.rate,
                "load": load,
                "force_N": force,
                "tangential_force_N": across,
                "position_mm": "" if place is None else float(place(load)),
            }
        )
    return rows
