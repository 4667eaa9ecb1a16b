"""`fem-nonlinear`: finite-strain elasticity with DOLFINx, the project's virtual experiment."""

import time
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pinnray.runtime.errors import UserError
from pinnray.solvers.contact.contact_region import CONTACT_AT_END, ContactRegion, contact_of
from pinnray.solvers.fem.boundary_conditions import DisplacementConstraints
from pinnray.solvers.fem.error_estimate import ErrorEstimator, locking_advice
from pinnray.solvers.fem.finite_strain.load_path import LoadPath, LoadSteps, check_stops
from pinnray.solvers.fem.finite_strain.nested_path import coarser, followed
from pinnray.solvers.lagrange import LagrangeField, LagrangeSpace
from pinnray.solvers.problem import Problem
from pinnray.solvers.solution import Solution, Status, unstable_phrase
from pinnray.solvers.solver import Cost, ElementSettings, Progress, check_problem, silent

MOST = 2 / 3
"""Coarse elements over the given ones up to which the load is followed on them."""


@dataclass(frozen=True)
class FemNonlinearSolver(LoadSteps, ElementSettings):
    """Plane strain by Newton's method, the load applied in adaptive steps; see `LoadPath`.

    A `patch` whose tangential component is free slides. A `cylinder` may have friction: its load
    steps are small, because friction depends on the way there.
    """

    name = "fem-nonlinear"
    family = "finite elements"
    laws = ("neo-hookean", "st-venant-kirchhoff", "gent")
    loads = ("mean", "point", "patch", "cylinder")
    friction = True
    cost = Cost(per_triangle=140)

    def __post_init__(self) -> None:
        super().__post_init__()
        if not 0 < self.min_step <= self.first_step <= self.max_step <= 1:
            raise UserError("fem-nonlinear needs 0 < min_step <= first_step <= max_step <= 1")
        if not 0 < self.tolerance <= 1e-3:
            raise UserError(f"{self.name} needs 0 < tolerance <= 0.001, not {self.tolerance:g}")
        check_stops(self.name, self.stops)

    def solve(self, problem: Problem, progress: Progress = silent) -> Solution:
        """Solve the finite-strain problem; see `Solver`."""
        check_problem(self, problem)
        on_way = problem.load.friction or self.stops  # friction depends on the way, and stops are on it
        coarse = None if on_way else coarser(problem, MOST)
        started = time.perf_counter()
        space = LagrangeSpace(problem.mesh, self.degree)
        path = self.path(problem, space)
        way = None
        if coarse is not None:
            way = self.path(coarse, LagrangeSpace(coarse.mesh, self.degree), rough=True)
        whole = followed(path, way, progress)
        last, history, regions = path.points[-1], whole.history(), whole.regions()
        abscissa = path.force_abscissa(last)
        if whole is path:  # else the tangent there has just been factorised
            path.equilibrium.factorise(last)
        unstable = path.equilibrium.unstable
        solved = time.perf_counter()
        touched = path.equilibrium.contact is None or last.contact.any()
        error = None  # of a part of the load, and where it has no limit or there is no force
        if last.fraction == 1 and problem.load.kind != "point" and touched:
            error = ErrorEstimator(problem, space).estimate(last.nodal, path.equilibrium.response)
        whole.close()
        known = f"error of the discretisation {error.phrase}" if error else ""
        remarks = [known, locking_advice(self.degree, problem.material)]
        return Solution(
            solver=self.name,
            problem=problem,
            field=LagrangeField(space, last.nodal),
            energy=float(history["energy"][-1]),
            reaction=np.array([history[name][-1] for name in ("reaction_x", "reaction_y")]),
            status=path_status(path, whole.phrase, regions, unstable, "; ".join(filter(None, remarks))),
            stats={
                "seconds": solved - started,
                "estimate_seconds": time.perf_counter() - solved,
                "unknowns": last.nodal.size,
                **whole.stats,
                "unstable_directions": unstable,
                "left_unstable": path.left,
                "degree": self.degree,
                **({} if abscissa is None else {"force_abscissa_mm": abscissa}),
                **(regions[-1].stats() if regions[-1] else {}),
            },
            history=history,
            states=[LagrangeField(space, nodal) for nodal in whole.states()],
            error=error,
            contact=contact_of(problem, abscissa, regions[-1]),
        )

    def path(
        self,
        problem: Problem,
        space: LagrangeSpace,
        constraints: DisplacementConstraints | None = None,
        *,
        rough: bool = False,
    ) -> LoadPath:
        """The load path, not yet followed; for the arguments see `LoadPath`."""
        near = problem.load.kind == "cylinder" and not self.stops  # is near enough on the way to the end
        exact_from = np.inf if rough else float(near)
        return LoadPath(problem, space, constraints, steps=self, exact_from=exact_from)


def path_status(
    path: LoadPath, taken: str, regions: Sequence[ContactRegion | None], unstable: int, remarks: str
) -> Status:
    """Success at the full load with remarks, or advice."""
    contact = path.equilibrium.contact
    if path.points[-1].fraction < 1:
        return Status(False, f"{taken}; {path.advice}")
    if unstable:
        return Status(False, f"{taken}, but {unstable_phrase(unstable)}")
    if path.left:
        taken += (
            f"; {path.left} unstable equilibria were left for a stable one beside them, of lower energy: "
            "the finger buckles, and there may be other branches"
        )
    if any(region and region.at_end for region in regions):
        return Status(False, f"{taken}, but {CONTACT_AT_END}")
    if contact is not None and regions[-1] is None:
        return Status(True, f"{taken}; the cylinder does not touch the finger any more")
    if (region := regions[-1]) is not None:
        parts = f" in {region.parts} parts" if region.parts > 1 else ""
        taken += f"; contact from x = {region.start:.4g} to {region.end:.4g} mm{parts}"
        if region.points.friction.any():
            taken += f", of {region.width:.3g} mm {region.sticking:.3g} mm stick"
    return Status(True, "; ".join(filter(None, [taken, remarks])))
