"""FElupe: quadratic triangles at small and finite strain, and contact with its rigid cylinder."""

import time
from dataclasses import dataclass

import felupe
import numpy as np

from benchmarks.entries.linear_system import solved_directly
from pinnray.solvers.contact.cylinder import touching_centre
from pinnray.solvers.energy_and_force import energy_and_force
from pinnray.solvers.lagrange import LagrangeField, LagrangeSpace
from pinnray.solvers.problem import Problem
from pinnray.solvers.solution import Solution, Status
from pinnray.solvers.solver import Progress, UnsupportedProblemError, check_problem, silent


class QuadraticTriangle(felupe.QuadraticTriangle):
    """FElupe's, with the derivative of its last shape function put right: 11.3 has 4 (t1 - t2) along s."""

    def gradient(self, rs):
        """Derivatives of the shape functions along (r, s), shape (6, 2)."""
        found, missing = super().gradient(rs), 4 * (rs[0] - rs[1])
        found[[5, 0, 2], 1] += [missing, -missing / 2, -missing / 2]
        return found


@dataclass(frozen=True)
class FelupeEntry:
    """Its linear-elastic and compressible neo-Hookean bodies in plane strain.

    Attributes:
        steps: Equal load steps.
        multiplier: Stiffness of the contact over the mean stiffness of the body's nodes.
        iterations: Most iterations of Newton's method in a step.
    """

    steps: int = 10
    multiplier: float = 1.0
    iterations: int = 40
    name = "felupe"
    family = "finite elements"
    laws = ("linear", "neo-hookean")
    loads = ("mean", "point", "patch", "cylinder")
    friction = True

    def settings(self) -> dict[str, object]:
        """All fields, and the version."""
        return {**vars(self), "felupe": felupe.__version__}

    def solve(self, problem: Problem, progress: Progress = silent) -> Solution:
        """Solve the problem."""
        check_problem(self, problem)
        started, load, lame = time.perf_counter(), problem.load, problem.material.lame
        space = LagrangeSpace(problem.mesh, 2)
        points, centre = space.nodes, len(space.nodes)
        if load.kind == "cylinder":
            points = np.concatenate([points, touching_centre(problem)[None]])
        mesh = felupe.Mesh(points, space.cell_nodes, "triangle6")
        region = felupe.Region(mesh, QuadraticTriangle(), felupe.TriangleQuadrature(order=2))
        field = felupe.FieldContainer([felupe.FieldPlaneStrain(region, dim=2)])
        if problem.material.law == "linear":
            umat = felupe.LinearElastic(E=problem.material.young, nu=problem.material.poisson)
            stiffness = felupe.SolidBody(umat, field).assemble.matrix().tocsc()
            return solved_directly(self.name, problem, space, stiffness, started)
        if load.kind in ("mean", "point"):
            raise UnsupportedProblemError(f"{self.name} takes a mean displacement by the linear law only")
        solid = felupe.SolidBody(felupe.NeoHookeCompressible(mu=lame.μ, lmbda=lame.λ), field)
        items, moved = [solid], space.boundary_nodes("contact")
        if load.kind == "cylinder":
            front, moved = space.boundary_nodes("front"), np.array([centre])
            items.append(
                felupe.ContactRigidCylinder(
                    field, front, centre, load.radius, friction=load.friction, multiplier=self.multiplier,
                    items=[solid],
                )
            )  # fmt: skip
        base = space.boundary_nodes("base")
        iterations = self._follow(field, items, base, moved, load.displacement, progress)
        found = LagrangeField(space, field[0].values[:centre].copy())
        energy, reaction = energy_and_force(problem, found)
        status = Status(True, f"{self.steps} steps, {iterations} iterations of Newton's method")
        stats = {"seconds": time.perf_counter() - started, "steps": self.steps}
        return Solution(self.name, problem, found, energy, reaction, status, stats)

    def _follow(self, field, items, held, moved, displacement, progress) -> int:
        """Apply the load in steps; returns the iterations of all."""
        masks = [np.isin(np.arange(len(field[0].values)), nodes) for nodes in (held, moved)]
        boundaries = {"base": felupe.Boundary(field[0], mask=masks[0])}
        ramp = {}
        for axis, value in enumerate(displacement):
            skip = tuple(int(other != axis) for other in (0, 1))
            name = f"moved {axis}"
            boundaries[name] = felupe.Boundary(field[0], mask=masks[1], skip=skip)
            ramp[boundaries[name]] = value * np.arange(1, self.steps + 1) / self.steps
        iterations = 0
        for number, found in enumerate(
            felupe.Step(items, ramp, boundaries).generate(x0=field, verbose=0, maxiter=self.iterations)
        ):
            iterations += found.iterations
            progress(number / self.steps, "")
        return iterations
