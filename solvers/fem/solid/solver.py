"""`fem-3d`: linear and finite-strain elasticity of the extruded finger with DOLFINx."""

import time
from dataclasses import dataclass
from typing import ClassVar, Literal, get_args

import numpy as np

from geometry.errors import UserError
from geometry.machine_memory import free_memory_gb
from solvers.cylinder_contact import CONTACT_AT_END, ContactRegion, contact_of
from solvers.extrusion import ExtrudedSpace
from solvers.fem.finite_strain.load_path import LoadPath, check_tolerance
from solvers.fem.ranks import communicator, on_all_ranks
from solvers.fem.solid.cost import Cost, LinearSolver, affordable
from solvers.fem.solid.plane_guide import PlaneGuide
from solvers.fem.solid.side_face import Face, FaceField
from solvers.problem import Problem
from solvers.solution import Solution, Status, unstable_phrase
from solvers.solver import Family, FieldSettings, Progress, check_problem, silent

PLANE_SHARE = 0.1
"""Share of the plane solution in the progress."""


@dataclass(frozen=True)
class Fem3dSolver(FieldSettings):
    """Quadratic tetrahedra on the shared mesh, extruded through half of the depth; symmetry gives the rest.

    The field is that of the side face, which a camera sees. Energy and reaction are means over the depth.
    Clamp and load are the same at every depth; a `mean` load prescribes the mean over the depth, too. At
    finite strain Newton's method starts from the solution of plane strain.

    Attributes:
        layers: Layers of elements in half of the depth.
        grading: Thickness of the layer at the side face over that at the middle plane.
        face: Plane of the field: the "side" face or the "middle" plane.
        sides: "free" side faces, or "held" ones, which cannot move along z: plane strain.
        linear_solver: "direct" (MUMPS), "iterative" (conjugate gradients with algebraic multigrid) or "auto",
            the former where memory allows it.
        max_step: Largest fraction of the load in one step, at finite strain.
        min_step: Fraction of the load below which the solver gives up.
        tolerance: Newton stops when the residual force is below this fraction of the internal forces.
        max_iterations: Newton iterations in one step.
    """

    layers: int = 4
    grading: float = 0.25
    face: Face = "side"
    sides: Literal["free", "held"] = "free"
    linear_solver: LinearSolver = "auto"
    max_step: float = 1.0
    min_step: float = 1e-2
    tolerance: float = 1e-8
    max_iterations: int = 20
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
        if self.face not in get_args(Face):
            raise UserError(f"fem-3d has the field of the faces side, middle, not {self.face!r}")
        if self.sides not in ("free", "held"):
            raise UserError(f"fem-3d has sides free or held, not {self.sides!r}")
        if self.linear_solver not in get_args(LinearSolver):
            known = ", ".join(get_args(LinearSolver))
            raise UserError(f"fem-3d has the linear solvers {known}, not {self.linear_solver!r}")
        if not 0 < self.min_step <= self.max_step <= 1:
            raise UserError("fem-3d needs 0 < min_step <= max_step <= 1")
        check_tolerance(self.name, self.tolerance)

    def solve(self, problem: Problem, progress: Progress = silent) -> Solution:
        """Solve the problem in three dimensions; see `Solver`. The depth is that of the problem's mesh.

        Raises:
            UserError: If the machine has too little memory.
        """
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
        guide = None
        if not linear:
            guide = PlaneGuide(
                problem, space, lambda done, text: progress(PLANE_SHARE * done, f"plane: {text}")
            )
        step = 1.0 if linear else self.max_step
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
        path.follow(lambda done, text: progress(PLANE_SHARE + (1 - PLANE_SHARE) * done, text))
        points, last = path.points, path.points[-1]
        unstable = 0 if linear else path.equilibrium.unstable
        energies = np.array([path.equilibrium.energy(point.nodal) for point in points])
        region = path.region(last)
        reactions = np.array([path.reaction(point) for point in points])
        abscissa = path.force_abscissa(last)
        ranks = path.equilibrium.distributed.comm.size
        path.close()
        return Solution(
            solver=self.name,
            problem=problem,
            field=FaceField(space, last.nodal, self.face),
            energy=float(energies[-1]),
            reaction=reactions[-1],
            status=self._status(path, cost, region, unstable),
            stats={
                "seconds": time.perf_counter() - started,
                "unknowns": last.nodal.size,
                "layers": self.layers,
                "depth_mm": problem.mesh.depth,
                "load_steps": len(points) - 1,
                "halved_steps": path.halved,
                "newton_iterations": path.iterations,
                **({} if unstable is None else {"unstable_directions": unstable}),
                "left_unstable": path.left,
                **path.equilibrium.factors.stats,
                **(region.stats() if region else {}),
                "estimated_memory_GB": cost.memory_gb,
                **({} if abscissa is None else {"force_abscissa_mm": abscissa}),
                "ranks": ranks,
            },
            history={
                "load_fraction": np.array([point.fraction for point in points]),
                "energy": energies,
                "reaction_x": reactions[:, 0],
                "reaction_y": reactions[:, 1],
            },
            states=[FaceField(space, point.nodal, self.face) for point in points],
            contact=contact_of(problem, abscissa, region),
        )

    def _status(
        self, path: LoadPath, cost: Cost, region: ContactRegion | None, unstable: int | None
    ) -> Status:
        """Success at the full load, or advice; `unstable` is None where multigrid cannot tell."""
        fraction = path.points[-1].fraction
        if fraction < 1:
            return Status(
                False,
                f"stopped at {fraction:.1%} of the load: Newton's method fails beyond ({path.reason}); "
                "take a finer mesh, a wider contact or a smaller stroke",
            )
        if region and region.at_end:
            return Status(False, CONTACT_AT_END)
        if unstable:
            return Status(False, f"all of the load applied, but {unstable_phrase(unstable)}")
        place = "side face" if self.face == "side" else "middle plane"
        how = (
            f"all of the load applied in {len(path.points) - 1} steps, {path.iterations} Newton iterations, "
            f"{'by multigrid' if cost.iterative else 'solved directly'}"
        )
        checked = "" if unstable is not None else " and its stability not checked"
        return Status(
            True,
            f"{how}; the field is that of the {place}; its discretisation error was not estimated{checked}",
        )
