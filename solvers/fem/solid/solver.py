"""`fem-3d`: linear and finite-strain elasticity of the extruded finger with DOLFINx."""

import time
from dataclasses import dataclass
from typing import ClassVar, Literal, get_args

import numpy as np

from geometry.errors import UserError
from geometry.machine_memory import free_memory_gb
from solvers.cylinder_contact import CONTACT_AT_END, ContactRegion, contact_of
from solvers.extrusion import ExtrudedSpace
from solvers.fem.finite_strain.equilibrium import LoadState
from solvers.fem.finite_strain.load_path import LoadPath, check_tolerance
from solvers.fem.finite_strain.solver import FemNonlinearSolver
from solvers.fem.linear_solvers import LinearSolver
from solvers.fem.ranks import communicator, on_all_ranks
from solvers.fem.solid.cost import Cost, affordable
from solvers.fem.solid.side_face import Face, FaceField
from solvers.problem import Problem
from solvers.solution import Solution, Status, unstable_phrase
from solvers.solver import Family, FieldSettings, Progress, check_problem, silent


class PlaneGuide:
    """The load path in plane strain, as states of the extruded body at any fraction of the load."""

    def __init__(self, problem: Problem, space: ExtrudedSpace, progress: Progress) -> None:
        self._space = space
        path = FemNonlinearSolver().path(problem, space.section)
        path.follow(progress)
        self._points = path.points
        path.close()

    def __call__(self, fraction: float) -> LoadState:
        """The state at a fraction of the load, between two of the path; beyond its end the last one."""
        places = [point.fraction for point in self._points]
        after = min(int(np.searchsorted(places, fraction)), len(places) - 1)
        last, first = self._points[after], self._points[max(after - 1, 0)]
        share = 1.0
        if last is not first:
            share = min(1.0, (fraction - first.fraction) / (last.fraction - first.fraction))
        nodal, forces, contact = (
            share * getattr(last, name) + (1 - share) * getattr(first, name)
            for name in ("nodal", "forces", "contact")
        )
        contact = np.outer(self._space.shares, contact).ravel()
        return LoadState(fraction, self._space.extruded(nodal), contact, forces)


@dataclass(frozen=True)
class Fem3dSolver(FieldSettings):
    """Quadratic tetrahedra on the shared mesh, extruded through half of the depth; symmetry gives the rest.

    Its field is the side face, which a camera sees. Energy and reaction are means over the depth. Clamp and
    load do not depend on the depth; a `mean` load prescribes the mean over the depth, too. At finite strain
    Newton's method starts from the solution of plane strain.
    """

    layers: int = 4  # Layers of elements in half of the depth
    grading: float = 0.25  # Thickness of the layer at the side face over that at the middle plane
    face: Face = "side"  # Plane of the field: the "side" face or the "middle" plane
    sides: Literal["free", "held"] = "free"  # Side faces that are "held" do not move along z: plane strain
    # "direct" (MUMPS), "iterative" (conjugate gradients with algebraic multigrid) or "auto", which is direct
    # where memory allows it
    linear_solver: LinearSolver = "auto"
    max_step: float = 1.0  # Largest fraction of the load in one step, at finite strain
    min_step: float = 1e-2  # Fraction of the load below which the solver gives up
    tolerance: float = 1e-8  # Largest residual force over the largest internal force
    max_iterations: int = 20  # Newton iterations in one step
    name: ClassVar[str] = "fem-3d"
    family: ClassVar[Family] = "finite elements"
    laws: ClassVar[tuple[str, ...]] = ("linear", "neo-hookean", "st-venant-kirchhoff")
    loads: ClassVar[tuple[str, ...]] = ("mean", "patch", "cylinder")

    def __post_init__(self) -> None:
        if self.layers < 1:
            raise UserError(f"fem-3d needs at least 1 layer in half of the depth, not {self.layers}")
        if not 0 < self.grading <= 1:
            raise UserError(
                f"fem-3d has layers that get thinner outwards: 0 < grading <= 1, not {self.grading:g}"
            )
        for said, value, known in (
            ("the field of the faces", self.face, get_args(Face)),
            ("the sides", self.sides, ("free", "held")),
            ("the linear solvers", self.linear_solver, get_args(LinearSolver)),
        ):
            if value not in known:
                raise UserError(f"fem-3d has {said} {', '.join(known)}, not {value!r}")
        if not 0 < self.min_step <= self.max_step <= 1:
            raise UserError("fem-3d needs 0 < min_step <= max_step <= 1")
        check_tolerance(self.name, self.tolerance)

    def solve(self, problem: Problem, progress: Progress = silent) -> Solution:
        """Solve the problem in three dimensions; see `Solver`. A `UserError` says if memory is short."""
        check_problem(self, problem)
        return on_all_ranks(self._solve, problem, progress)

    def space(self, problem: Problem) -> ExtrudedSpace:
        """The elements of a problem."""
        return ExtrudedSpace.of(problem.mesh, self.layers, self.grading, self.sides == "held")

    def _solve(self, problem: Problem, progress: Progress) -> Solution:
        started = time.perf_counter()
        space, linear = self.space(problem), problem.material.law == "linear"
        free = communicator().bcast(free_memory_gb())
        cost = affordable(space.nodes.size, len(space.levels), self.linear_solver, free)
        progress(0.0, cost.words)
        guide, step = None, 1.0
        if not linear:
            guide = PlaneGuide(problem, space, lambda done, text: progress(0.1 * done, f"plane: {text}"))
            step = self.max_step
        path = LoadPath(
            problem,
            space,
            guide=guide,
            iterative=cost.iterative,
            first_step=step,
            max_step=step,
            min_step=self.min_step,
            tolerance=self.tolerance,
            max_iterations=self.max_iterations,
        )
        path.follow(lambda done, text: progress(0.1 + 0.9 * done, text))
        last, history = path.points[-1], path.history()
        unstable = 0 if linear else path.equilibrium.unstable
        region, abscissa = path.region(last), path.force_abscissa(last)
        path.close()
        return Solution(
            solver=self.name,
            problem=problem,
            field=FaceField(space, last.nodal, self.face),
            energy=float(history["energy"][-1]),
            reaction=np.array([history["reaction_x"][-1], history["reaction_y"][-1]]),
            status=self._status(path, cost, region, unstable),
            stats={
                "seconds": time.perf_counter() - started,
                "unknowns": last.nodal.size,
                "layers": self.layers,
                "depth_mm": problem.mesh.depth,
                **path.stats,
                **({} if unstable is None else {"unstable_directions": unstable}),
                "left_unstable": path.left,
                **path.equilibrium.factors.stats,
                **(region.stats() if region else {}),
                "estimated_memory_GB": cost.memory_gb,
                **({} if abscissa is None else {"force_abscissa_mm": abscissa}),
                "ranks": path.equilibrium.distributed.comm.size,
            },
            history=history,
            states=[FaceField(space, point.nodal, self.face) for point in path.points],
            contact=contact_of(problem, abscissa, region),
        )

    def _status(
        self, path: LoadPath, cost: Cost, region: ContactRegion | None, unstable: int | None
    ) -> Status:
        """Success at the full load, or advice; `unstable` is None where multigrid cannot tell."""
        if path.points[-1].fraction < 1:
            return Status(False, f"{path.phrase}; take a finer mesh, a wider contact or a smaller stroke")
        if region and region.at_end:
            return Status(False, CONTACT_AT_END)
        if unstable:
            return Status(False, f"all of the load applied, but {unstable_phrase(unstable)}")
        place = "side face" if self.face == "side" else "middle plane"
        how = "by multigrid" if cost.iterative else "solved directly"
        checked = "" if unstable is not None else " and its stability not checked"
        return Status(
            True,
            f"{path.phrase}, {how}; the field is that of the {place}; its discretisation error was not "
            f"estimated{checked}",
        )
