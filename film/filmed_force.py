"""The course of a filmed finger, and the indenter's true force in every frame."""

from collections.abc import Callable

import numpy as np
from scipy.integrate import trapezoid
from scipy.interpolate import CubicSpline
from scipy.signal import lfilter

from pinnray.runtime.arrays import FloatArray
from pinnray.runtime.tables import Cell
from pinnray.solvers.solution import Solution, stroke_axes
from pinnray.vision.rig.motion import Motion
from pinnray.vision.rig.recording import Recording

LONGEST_STEP = 0.05
"""Longest load step of a filmed simulation: a spline through its equilibria is then exact to micrometres."""
RELAXATION = 0.3
"""Relaxation time over that of the loading: near the largest loss that one relaxation time gives."""
STEPS = 16
"""Steps of a frame in which the relaxation is followed."""


def filmed_course(solution: Solution) -> CubicSpline | None:
    """A solution's nodal displacements, mm, by the share of the load; None for a linear one."""
    if not solution.states:
        return None
    nodes = solution.problem.mesh.at_nodes()
    states = np.array([state.displacement(nodes) for state in solution.states])
    return CubicSpline(solution.history["load_fraction"], states)


def true_forces(
    solution: Solution, recording: Recording, depth: float, loss: float = 0.0
) -> list[dict[str, Cell]]:
    """A row for every frame: the force of the indenter along and across its stroke, and where it acts.

    Args:
        solution: Behind the recording's course.
        recording: The film.
        depth: Of the finger, mm.
        loss: Of the material. Its displacements are the elastic ones, as they are prescribed and the whole
            body relaxes alike; see `viscoelastic_forces`.
    """
    history = solution.history
    if solution.states:
        shares = history["load_fraction"]
        reactions = np.column_stack([history["reaction_x"], history["reaction_y"]])
    else:
        shares, reactions = np.array([0.0, 1.0]), np.array([np.zeros(2), solution.reaction])
    components = CubicSpline(shares, depth * reactions @ stroke_axes(solution.problem.load).T)
    places = history.get("force_abscissa_mm")
    place = None if places is None else CubicSpline(shares, places)
    loads = [recording.load(number) for number in range(len(recording.motion))]
    forces = viscoelastic_forces(components, recording.motion, loss) if loss else components(loads)
    return [
        {
            "frame": number,
            "time_s": number / recording.motion.rate,
            "load": load,
            "force_N": force,
            "tangential_force_N": across,
            "position_mm": "" if place is None else float(place(load)),
        }
        for number, (load, (force, across)) in enumerate(zip(loads, forces.tolist(), strict=True))
    ]


def viscoelastic_forces(
    elastic: Callable[[FloatArray], FloatArray], motion: Motion, loss: float
) -> FloatArray:
    """Forces in the frames of a film of a material that loses energy, shape (f, 2), N.

    They are those of a standard linear solid: F - g R, where R is how much of the elastic force F has relaxed
    with one time constant, `RELAXATION` of the time of the loading. The share g gives the loss to a cycle at
    the speed of the loading, without a hold. All forces are scaled so that the largest one of that loading is
    the elastic one: Young's modulus is that of a loading. The indenter is fixed to the finger and pulls on
    the last of the way back.

    Args:
        elastic: Forces of the elastic finger, shape (n, 2), N, along the stroke and across it, at shares of
            the load, shape (n,).
        motion: Of the film.
        loss: Share of the work of the loading that the cycle loses.
    """
    times = np.arange(len(motion) * STEPS + 1) / STEPS
    cycle = np.linspace(0.0, 2.0, 801)
    whole = elastic(1 - np.abs(1 - cycle))
    relaxed = _relaxed(whole, RELAXATION / (cycle[1] - cycle[0]))
    (up, up_relaxed), (down, down_relaxed) = (
        [trapezoid(each[part, 0], cycle[part]) for each in (whole, relaxed)]
        for part in (slice(401), slice(400, None))
    )
    share = (down - (1 - loss) * up) / (down_relaxed - (1 - loss) * up_relaxed)
    forces = elastic(motion.load(times))
    found = forces - share * _relaxed(forces, RELAXATION * motion.loading_time * STEPS)
    scale = whole[400, 0] / (whole[400, 0] - share * relaxed[400, 0])
    middles = np.arange(len(motion)) + motion.shutter / 2
    return np.column_stack([scale * np.interp(middles, times, each) for each in found.T])


def _relaxed(forces: FloatArray, steps: float) -> FloatArray:
    """How much of forces, shape (n, 2), has relaxed, with a time constant of so many of their steps."""
    decay, increments = np.exp(-1 / steps), np.diff(forces, axis=0, prepend=forces[:1])
    kept = lfilter([steps * (1 - decay)], [1, -decay], increments, axis=0)
    return np.asarray(forces - forces[0] - kept)
