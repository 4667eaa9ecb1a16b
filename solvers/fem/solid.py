"""`fem-3d`: linear and finite-strain elasticity of the extruded finger with DOLFINx."""

import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Literal, get_args

import numpy as np

from pinnray.geometry.mesh.point_location import LocatedPoints
from pinnray.runtime.arrays import FloatArray
from pinnray.runtime.errors import UserError
from pinnray.runtime.machine import free_memory_gb
from pinnray.solvers.cylinder_contact import CONTACT_AT_END, ContactRegion, contact_of
from pinnray.solvers.extrusion import ExtrudedSpace
from pinnray.solvers.fem.equilibrium import LoadState
from pinnray.solvers.fem.finite_strain.load_path import LoadPath
from pinnray.solvers.fem.finite_strain.solver import FemNonlinearSolver
from pinnray.solvers.problem import Problem
from pinnray.solvers.solution import Solution, Status, unstable_phrase
from pinnray.solvers.solver import Cost, FieldSettings, Progress, check_problem, silent

Face = Literal["side", "middle"]


@dataclass(frozen=True, eq=False)
class FaceField:
    """A plane z = constant of a displacement in three dimensions; it is a `SolidField`."""

    space: ExtrudedSpace  # Quadratic elements on half of the body
    nodal: FloatArray  # Nodal displacements, shape (N, 3), mm
    face: Face  # The "side" face or the "middle" plane

    @cached_property
    def values(self) -> FloatArray:
        """Displacements of the plane's nodes, shape (P, 3), mm."""
        return self.space.at_level(self.nodal, -1 if self.face == "side" else 0)

    @cached_property
    def slopes(self) -> FloatArray:
        """Their derivatives along z, shape (P, 3), by a parabola through the three nodes of a layer.

        In the middle plane symmetry leaves only the derivative of u_z.
        """
        levels = [-1, -2, -3] if self.face == "side" else [0, 1, 2]
        own, half, whole = (self.space.at_level(self.nodal, level) for level in levels)
        height = self.space.levels[levels[2]] - self.space.levels[levels[0]]
        slopes = (-3 * own + 4 * half - whole) / height
        if self.face == "middle":
            slopes[:, :2] = 0.0
        return np.asarray(slopes)

    def displacement(self, location: LocatedPoints) -> FloatArray:
        """Displacement in the plane, shape (n, 2), mm."""
        return np.asarray(self.space.section.shape_functions(location) @ self.values[:, :2])

    def gradient(self, location: LocatedPoints) -> FloatArray:
        """Displacement gradient du_i/dx_j in the plane, shape (n, 2, 2)."""
        return self.solid_gradient(location)[:, :2, :2]

    def solid_gradient(self, location: LocatedPoints) -> FloatArray:
        """Displacement gradient du_i/dx_j, shape (n, 3, 3)."""
        dx, dy = self.space.section.shape_gradients(location)
        dz = self.space.section.shape_functions(location) @ self.slopes
        return np.stack([dx @ self.values, dy @ self.values, dz], axis=-1)


def affordable(unknowns: int, levels: int, free_gb: float) -> tuple[float, str]:
    """Memory that factors of nodes on so many levels need, GB, and the price in words.

    It was fitted to the default finger with 235,000 to 812,000 unknowns; other bodies may differ by a factor
    of two. A `UserError` says that the memory that is free does not suffice; a solution may take 70 % of it.
    """
    entries = unknowns * (100 + 33 * levels) * (unknowns / (3 * levels) / 8500) ** 0.25  # of the factors
    memory = 2.4e-6 * unknowns + 1e-8 * entries
    if memory > 0.7 * free_gb:
        raise UserError(
            f"fem-3d would need about {memory:.1f} GB for {unknowns:,} unknowns, and {free_gb:.1f} GB are "
            "free; take fewer layers or a coarser mesh"
        )
    seconds = 2e-5 * unknowns + 1.3e-10 * entries**2 / unknowns
    step = f"{max(1.0, seconds):.0f} s" if seconds < 100 else f"{seconds / 60:.0f} min"
    return memory, f"{unknowns:,} unknowns: about {memory:.1f} GB, {step} a Newton step"


def _plane_guide(problem: Problem, space: ExtrudedSpace, progress: Progress) -> Callable[[float], LoadState]:
    """The load path in plane strain, as states of the extruded body at any fraction of the load."""
    path = FemNonlinearSolver().path(problem, space.section)
    path.follow(progress)
    path.close()
    places = [point.fraction for point in path.points]

    def guide(fraction: float) -> LoadState:
        """The state between two of the path; beyond its end the last one."""
        after = min(int(np.searchsorted(places, fraction)), len(places) - 1)
        last, first = path.points[after], path.points[max(after - 1, 0)]
        share = 1.0
        if last is not first:
            share = min(1.0, (fraction - first.fraction) / (last.fraction - first.fraction))
        nodal, forces, contact = (
            share * getattr(last, name) + (1 - share) * getattr(first, name)
            for name in ("nodal", "forces", "contact")
        )
        contact = np.outer(space.shares, contact).ravel()
        return LoadState(fraction, space.extruded(nodal), contact, forces)

    return guide


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
    name = "fem-3d"
    family = "finite elements"
    laws = ("linear", "neo-hookean", "st-venant-kirchhoff")
    loads = ("mean", "patch", "cylinder")
    friction = True
    cost = Cost(per_triangle=4300)

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
        ):
            if value not in known:
                raise UserError(f"fem-3d has {said} {', '.join(known)}, not {value!r}")

    def solve(self, problem: Problem, progress: Progress = silent) -> Solution:
        """Solve the problem in three dimensions; see `Solver`. A `UserError` says if memory is short."""
        check_problem(self, problem)
        return self._solve(problem, progress)

    def space(self, problem: Problem) -> ExtrudedSpace:
        """The elements of a problem."""
        return ExtrudedSpace.of(problem.mesh, self.layers, self.grading, self.sides == "held")

    def _solve(self, problem: Problem, progress: Progress) -> Solution:
        started = time.perf_counter()
        space, linear = self.space(problem), problem.material.law == "linear"
        memory, words = affordable(space.nodes.size, len(space.levels), free_memory_gb())
        progress(0.0, words)
        guide = None
        if not linear:
            guide = _plane_guide(problem, space, lambda done, text: progress(0.1 * done, f"plane: {text}"))
        path = LoadPath(
            problem,
            space,
            guide=guide,
            first_step=1.0,  # the guide is near, so that one step is often enough
            max_step=1.0,
            min_step=0.01,
            tolerance=1e-8,
            max_iterations=20,
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
            status=self._status(path, region, unstable),
            stats={
                "seconds": time.perf_counter() - started,
                "unknowns": last.nodal.size,
                "layers": self.layers,
                "depth_mm": problem.mesh.depth,
                **path.stats,
                "unstable_directions": unstable,
                "left_unstable": path.left,
                **(region.stats() if region else {}),
                "estimated_memory_GB": memory,
                **({} if abscissa is None else {"force_abscissa_mm": abscissa}),
            },
            history=history,
            states=[FaceField(space, point.nodal, self.face) for point in path.points],
            contact=contact_of(problem, abscissa, region),
        )

    def _status(self, path: LoadPath, region: ContactRegion | None, unstable: int) -> Status:
        """Success at the full load, or advice."""
        if path.points[-1].fraction < 1:
            return Status(False, f"{path.phrase}; take a finer mesh, a wider contact or a smaller stroke")
        if region and region.at_end:
            return Status(False, CONTACT_AT_END)
        if unstable:
            return Status(False, f"all of the load applied, but {unstable_phrase(unstable)}")
        place = "side face" if self.face == "side" else "middle plane"
        return Status(
            True,
            f"{path.phrase}, solved directly; the field is that of the {place}; its discretisation error was "
            "not estimated",
        )
