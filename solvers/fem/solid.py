"""`fem-3d`: linear and finite-strain elasticity of the extruded finger with DOLFINx."""

import time
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal

import numpy as np

from pinnray.geometry.mesh.point_location import LocatedPoints
from pinnray.runtime.arrays import FloatArray
from pinnray.runtime.errors import UserError
from pinnray.solvers.contact.contact_region import contact_of
from pinnray.solvers.extrusion import ExtrudedSpace
from pinnray.solvers.fem.finite_strain.load_path import LoadPath, LoadSteps, check_stops
from pinnray.solvers.fem.finite_strain.nested_path import followed
from pinnray.solvers.fem.finite_strain.solver import FemNonlinearSolver, path_status
from pinnray.solvers.problem import Problem
from pinnray.solvers.solution import Solution
from pinnray.solvers.solver import Cost, FieldSettings, Progress, check_problem, silent

STEPS = LoadSteps(first_step=1.0, max_step=1.0, min_step=0.01, max_iterations=20)
RUBBING = replace(STEPS, first_step=0.05, max_step=0.2)
"""Steps with friction, which depends on the way."""
REMARK = "the field is that of the side face; its discretisation error was not estimated"


@dataclass(frozen=True, eq=False)
class FaceField:
    """The side face of a displacement in three dimensions; it is a `SolidField`."""

    space: ExtrudedSpace  # Quadratic elements on half of the body
    nodal: FloatArray  # Nodal displacements, shape (N, 3), mm

    @cached_property
    def values(self) -> FloatArray:
        """Displacements of the face's nodes, shape (P, 3), mm."""
        return self.space.at_level(self.nodal, -1)

    @cached_property
    def slopes(self) -> FloatArray:
        """Their derivatives along z, shape (P, 3), by a parabola through the three nodes of a layer."""
        own, half, whole = (self.space.at_level(self.nodal, level) for level in (-1, -2, -3))
        height = self.space.levels[-3] - self.space.levels[-1]
        return np.asarray((-3 * own + 4 * half - whole) / height)

    def displacement(self, location: LocatedPoints) -> FloatArray:
        """Displacement in the face, shape (n, 2), mm."""
        return np.asarray(self.space.section.shape_functions(location) @ self.values[:, :2])

    def gradient(self, location: LocatedPoints) -> FloatArray:
        """Displacement gradient du_i/dx_j in the face, shape (n, 2, 2)."""
        return self.solid_gradient(location)[:, :2, :2]

    def solid_gradient(self, location: LocatedPoints) -> FloatArray:
        """Displacement gradient du_i/dx_j, shape (n, 3, 3)."""
        dx, dy = self.space.section.shape_gradients(location)
        dz = self.space.section.shape_functions(location) @ self.slopes
        return np.stack([dx @ self.values, dy @ self.values, dz], axis=-1)


@dataclass(frozen=True)
class Fem3dSolver(FieldSettings):
    """Quadratic tetrahedra on the shared mesh, extruded through half of the depth; symmetry gives the rest.

    Its field is the side face, which a camera sees. Energy and reaction are means over the depth. Clamp and
    load do not depend on the depth; a `mean` load prescribes the mean over the depth, too. At finite strain
    without friction Newton's method starts from the solution of plane strain at the full load.
    """

    layers: int = 4  # Layers of elements in half of the depth
    grading: float = 0.25  # Thickness of the layer at the side face over that at the middle plane
    sides: Literal["free", "held"] = "free"  # Side faces that are "held" do not move along z: plane strain
    # Fractions of the load at which a step ends; with any, no step is that of the plane
    stops: tuple[float, ...] = ()
    name = "fem-3d"
    family = "finite elements"
    laws = ("linear", "neo-hookean", "st-venant-kirchhoff")
    loads = ("mean", "patch", "cylinder")
    friction = True
    cost = Cost(per_triangle=4300, kilobytes=550)

    def __post_init__(self) -> None:
        if self.layers < 1:
            raise UserError(f"fem-3d needs at least 1 layer in half of the depth, not {self.layers}")
        if not 0 < self.grading <= 1:
            raise UserError(
                f"fem-3d has layers that get thinner outwards: 0 < grading <= 1, not {self.grading:g}"
            )
        check_stops(self.name, self.stops)

    def solve(self, problem: Problem, progress: Progress = silent) -> Solution:
        """Solve the problem in three dimensions; see `Solver`."""
        check_problem(self, problem)
        started = time.perf_counter()
        space, linear = self.space(problem), problem.material.law == "linear"
        way = None
        if not (linear or problem.load.friction or self.stops):  # friction depends on the way
            way = FemNonlinearSolver().path(problem, space.section, rough=True)
        steps = RUBBING if problem.load.friction else STEPS
        path = LoadPath(problem, space, steps=replace(steps, stops=self.stops))
        whole = followed(path, way, progress)
        last, history, regions = path.points[-1], whole.history(), whole.regions()
        region = regions[-1]
        unstable = 0 if linear else path.equilibrium.unstable
        abscissa = path.force_abscissa(last)
        whole.close()
        return Solution(
            solver=self.name,
            problem=problem,
            field=FaceField(space, last.nodal),
            energy=float(history["energy"][-1]),
            reaction=np.array([history["reaction_x"][-1], history["reaction_y"][-1]]),
            status=path_status(path, whole.phrase, regions, unstable, REMARK),
            stats={
                "seconds": time.perf_counter() - started,
                "unknowns": last.nodal.size,
                "layers": self.layers,
                "depth_mm": problem.mesh.depth,
                **whole.stats,
                "unstable_directions": unstable,
                "left_unstable": path.left,
                **(region.stats() if region else {}),
                **({} if abscissa is None else {"force_abscissa_mm": abscissa}),
            },
            history=history,
            states=[FaceField(space, nodal) for nodal in whole.states()],
            contact=contact_of(problem, abscissa, region),
        )

    def space(self, problem: Problem) -> ExtrudedSpace:
        """The elements of a problem."""
        return ExtrudedSpace.of(problem.mesh, self.layers, self.grading, self.sides == "held")
