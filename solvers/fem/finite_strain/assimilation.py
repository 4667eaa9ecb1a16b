"""Energy plus misfit to the markers at finite strain: springs at the markers along the load path.

At a stationary point of E(u) + 1/2 (B u - d)^T W (B u - d) the force f_j acts on component j of the markers,
where b_j . u + f_j / W_jj = d_j: the misfit is a compliant spring, as is a contact with a standard deviation.
On the path the observed displacements grow with the load.

To leave a marker out, Newton's method continues from the solution without its two springs and, where that
does not converge, from rest.
"""

import time

import numpy as np

from geometry.arrays import BoolArray, FloatArray
from geometry.errors import UserError
from solvers.assimilation.marker_forces import residual_phrase
from solvers.assimilation.marker_weighting import MarkerWeighting
from solvers.assimilation.misfit import leave_one_out_displacements
from solvers.fem.finite_strain.equilibrium import DisplacementConstraints, LoadState
from solvers.fem.finite_strain.load_path import LoadPath
from solvers.fem.finite_strain.solver import FemNonlinearSolver
from solvers.lagrange import LagrangeField, LagrangeSpace
from solvers.problem import Problem
from solvers.solution import Solution, Status
from solvers.solver import Progress, silent


def assimilated(problem: Problem, weighting: MarkerWeighting, *, degree: int, progress: Progress) -> Solution:
    """The stationary point that the load path leads to, with every marker and without each.

    The law is one of finite strain; `degree` is the elements'. A `UserError` refuses a problem without
    markers that weigh anything.
    """
    started = time.perf_counter()
    misfit = weighting.misfit(problem)
    if misfit is None:
        raise UserError(f"{weighting.solver_name} was given no markers to assimilate")
    space = LagrangeSpace(problem.mesh, degree)
    springs = DisplacementConstraints.springs(misfit, space)
    constraints = DisplacementConstraints.of(problem, space, weighting.slack).joined(springs)
    path = _path(problem, space, constraints)
    path.follow(lambda done, text: progress(0.5 * done, text))
    stats, phrase, last = path.stats, path.phrase, path.points[-1]
    forces = last.forces[-len(springs.targets) :]
    residual = (springs.targets - springs.values(last.nodal)).reshape(-1, 2)
    history = {name: path.history()[name] for name in ("load_fraction", "energy")}
    reaction = path.reaction(last) - forces.reshape(-1, 2).sum(axis=0)
    left_out = _left_out(path, problem, space, springs, progress) if last.fraction == 1 else None
    path.close()
    return Solution(
        solver=weighting.solver_name,
        problem=problem,
        field=LagrangeField(space, last.nodal),
        energy=float(history["energy"][-1]),
        reaction=reaction,
        status=_status(phrase, residual, left_out),
        stats={
            "seconds": time.perf_counter() - started,
            "unknowns": last.nodal.size,
            "triangles": len(problem.mesh.triangles),
            "degree": degree,
            **stats,
            "weight_factor": 1.0,
            "misfit": misfit.value(misfit.observed - residual),
            "marker_force": float(np.linalg.norm(forces.reshape(-1, 2), axis=1).max()),
        },
        history=history,
        left_out=None if left_out is None else leave_one_out_displacements(problem, left_out),
    )


def _path(problem: Problem, space: LagrangeSpace, constraints: DisplacementConstraints) -> LoadPath:
    # Shorter steps do not help: large forces at the markers invert elements.
    return FemNonlinearSolver(degree=space.degree, min_step=0.01).path(problem, space, constraints)


def _left_out(
    path: LoadPath,
    problem: Problem,
    space: LagrangeSpace,
    springs: DisplacementConstraints,
    progress: Progress,
) -> FloatArray:
    """Residual of each marker without it, shape (m, 2), mm; NaN where no equilibrium is found."""
    count = len(springs.targets) // 2
    first = len(path.points[-1].forces) - 2 * count
    missed = np.full((count, 2), np.nan)
    for marker in range(count):
        progress(0.5 + 0.5 * marker / count, f"without marker {marker}")
        own = slice(2 * marker, 2 * marker + 2)
        kept = np.ones(first + 2 * count, dtype=bool)
        kept[first:][own] = False
        point = path.relaxed(kept) or _from_rest(path, problem, space, kept)
        if point is not None:
            missed[marker] = (springs.targets - springs.values(point.nodal))[own]
    return missed


def _from_rest(path: LoadPath, problem: Problem, space: LagrangeSpace, kept: BoolArray) -> LoadState | None:
    """Equilibrium at the full load under some of a path's constraints; None if there is none."""
    again = _path(problem, space, path.equilibrium.constraints.only(kept))
    again.follow(silent)
    again.close()
    return again.points[-1] if again.points[-1].fraction == 1 else None


def _status(phrase: str, residual: FloatArray, left_out: FloatArray | None) -> Status:
    if left_out is None:
        return Status(
            False,
            f"{phrase}: load and markers contradict each other; let the contact slide, give it a "
            "contact_deviation or take smaller weights",
        )
    residuals = residual_phrase(residual, left_out[np.isfinite(left_out)])
    said = f"energy plus misfit is stationary: {phrase}; {residuals}"
    if lost := int(np.isnan(left_out[:, 0]).sum()):
        said += f"; no equilibrium was found without {lost} of the markers"
    return Status(True, said)
