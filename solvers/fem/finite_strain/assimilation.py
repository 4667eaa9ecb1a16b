"""Energy plus misfit to the markers at finite strain: springs pull at the markers along the load path.

At a stationary point of E(u) + 1/2 (B u - d)^T W (B u - d) component j of the markers is pulled by the force
f_j, where b_j . u + f_j / W_jj = d_j: the misfit is one more spring that gives way, as a contact that is not
certain is. On the path the observed displacements grow with the load.

There is no closed form for a marker that is left out: Newton's method goes on from the solution without its
two springs and, where that does not converge, all the way from rest.
"""

import time

import numpy as np

from geometry.arrays import BoolArray, FloatArray
from solvers.assimilation.marker_forces import residual_phrase
from solvers.assimilation.misfit import Misfit, leave_one_out_displacements
from solvers.fem.finite_strain.constraints import DisplacementConstraints
from solvers.fem.finite_strain.load_path import LoadPath
from solvers.fem.finite_strain.load_state import LoadState
from solvers.fem.finite_strain.solver import FemNonlinearSolver
from solvers.lagrange import LagrangeField, LagrangeSpace
from solvers.problem import Problem
from solvers.solution import Solution, Status
from solvers.solver import Progress

MIN_STEP = 0.01
"""Fraction of the load below which the path is given up: what pulls so hard tears elements."""
PATH_SHARE = 0.5
"""Of the progress that the load path is; the markers that are left out are the rest."""


def assimilated(
    name: str, problem: Problem, *, degree: int, misfit: Misfit, slack: float, progress: Progress
) -> Solution:
    """The displacement to which the load path leads, with each marker left out.

    Args:
        name: Of the solver.
        problem: With a law of finite strain, and observations.
        degree: Of the elements.
        misfit: To the observations.
        slack: Compliance of springs between contact and indenter, mm per N/mm, for `mean` and `point`.
        progress: Of the work.
    """
    started = time.perf_counter()
    space = LagrangeSpace(problem.mesh, degree)
    springs = DisplacementConstraints.springs(misfit, space)
    path = _path(problem, space, DisplacementConstraints.of(problem, space, slack).joined(springs))
    path.follow(lambda done, text: progress(PATH_SHARE * done, text))
    steps, iterations, last = len(path.points) - 1, path.iterations, path.points[-1]
    forces = last.forces[-len(springs.targets) :]
    residual = (springs.targets - springs.values(last.nodal)).reshape(-1, 2)
    energies = np.array([path.equilibrium.energy(point.nodal) for point in path.points])
    reaction = path.reaction(last) - forces.reshape(-1, 2).sum(axis=0)
    left_out = _left_out(path, problem, springs, progress) if last.fraction == 1 else None
    path.close()
    return Solution(
        solver=name,
        problem=problem,
        field=LagrangeField(space, last.nodal),
        energy=float(energies[-1]),
        reaction=reaction,
        status=_status(path, steps, iterations, residual, left_out),
        stats={
            "seconds": time.perf_counter() - started,
            "unknowns": last.nodal.size,
            "triangles": len(problem.mesh.triangles),
            "degree": degree,
            "load_steps": steps,
            "halved_steps": path.halved,
            "newton_iterations": iterations,
            "weight_factor": 1.0,
            "misfit": misfit.value(misfit.observed - residual),
            "marker_force": float(np.linalg.norm(forces.reshape(-1, 2), axis=1).max()),
        },
        history={
            "load_fraction": np.array([point.fraction for point in path.points]),
            "energy": energies,
        },
        left_out=None if left_out is None else leave_one_out_displacements(problem, left_out),
    )


def _path(problem: Problem, space: LagrangeSpace, constraints: DisplacementConstraints) -> LoadPath:
    return FemNonlinearSolver(degree=space.degree, min_step=MIN_STEP).path(problem, space, constraints)


def _left_out(
    path: LoadPath, problem: Problem, springs: DisplacementConstraints, progress: Progress
) -> FloatArray:
    """What each marker is missed by without it, shape (m, 2), mm; NaN where there is no equilibrium."""
    count = len(springs.targets) // 2
    first = len(path.points[-1].forces) - 2 * count
    missed = np.full((count, 2), np.nan)
    for marker in range(count):
        progress(PATH_SHARE + (1 - PATH_SHARE) * marker / count, f"without marker {marker}")
        own = slice(2 * marker, 2 * marker + 2)
        kept = np.ones(first + 2 * count, dtype=bool)
        kept[first:][own] = False
        point = path.relaxed(kept) or _from_rest(path, problem, kept)
        if point is not None:
            missed[marker] = (springs.targets - springs.values(point.nodal))[own]
    return missed


def _from_rest(path: LoadPath, problem: Problem, kept: BoolArray) -> LoadState | None:
    """Equilibrium at the full load under some of a path's constraints; None if there is none."""
    equilibrium = path.equilibrium
    again = _path(problem, equilibrium.distributed.space, equilibrium.constraints.only(kept))
    again.follow(lambda done, text: None)
    again.close()
    return again.points[-1] if again.points[-1].fraction == 1 else None


def _status(
    path: LoadPath, steps: int, iterations: int, residual: FloatArray, left_out: FloatArray | None
) -> Status:
    if left_out is None:
        return Status(
            False,
            f"stopped at {path.points[-1].fraction:.1%} of the load: Newton's method fails beyond "
            f"({path.reason}): load and markers contradict each other; let the contact slide, give it a "
            "contact_deviation or take smaller weights",
        )
    said = (
        f"energy plus misfit is stationary: all of the load applied in {steps} steps, {iterations} Newton "
        f"iterations; {residual_phrase(residual, left_out[np.isfinite(left_out)])}"
    )
    if lost := int(np.isnan(left_out[:, 0]).sum()):
        said += f"; no equilibrium was found without {lost} of the markers"
    return Status(True, said)
