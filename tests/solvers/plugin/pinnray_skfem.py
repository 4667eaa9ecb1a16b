"""A researcher's own solver: everything that pinn-ray asks of one, in a file of its own package."""

import time

import numpy as np
import skfem
from skfem.models.elasticity import linear_elasticity

from pinnray.solvers.lagrange import LagrangeField, LagrangeSpace
from pinnray.solvers.problem import contact_functional
from pinnray.solvers.solution import Solution, Status
from pinnray.solvers.solver import check_problem, silent


class SkfemSolver:
    """Quadratic triangles assembled by scikit-fem, the load by its two influence functions."""

    name = "skfem-p2"
    laws = ("linear",)
    loads = ("mean", "point")

    def settings(self):
        return {}

    def solve(self, problem, progress=silent):
        check_problem(self, problem)
        started = time.perf_counter()
        mesh, lame = problem.mesh, problem.material.lame
        element = skfem.ElementVector(skfem.ElementTriP2())
        basis = skfem.Basis(skfem.MeshTri(mesh.points.T.copy(), mesh.triangles.T.copy()), element)
        stiffness = skfem.asm(linear_elasticity(lame.λ, lame.μ), basis)
        dofs_of_nodes = np.hstack([basis.nodal_dofs, basis.facet_dofs])  # both number edges alike
        space = LagrangeSpace(mesh, 2)
        points, weights = contact_functional(problem)
        at_nodes = space.shape_functions(mesh.locate(points)).T @ weights
        loads = np.zeros((stiffness.shape[0], len(problem.load.prescribed)))
        for column, axis in enumerate(problem.load.prescribed):
            loads[dofs_of_nodes[axis], column] = at_nodes
        clamped = dofs_of_nodes[:, space.boundary_nodes("base")].ravel()
        influence = np.column_stack(
            [skfem.solve(*skfem.condense(stiffness, load, D=clamped)) for load in loads.T]
        )
        forces = np.linalg.solve(loads.T @ influence, problem.load.values)
        dofs = influence @ forces
        reaction = np.zeros(2)
        reaction[problem.load.prescribed] = forces
        return Solution(
            solver=self.name,
            problem=problem,
            field=LagrangeField(space, dofs[dofs_of_nodes].T),
            energy=0.5 * float(dofs @ (stiffness @ dofs)),
            reaction=reaction,
            status=Status(True, "solved directly"),
            stats={"seconds": time.perf_counter() - started, "unknowns": len(dofs)},
        )
