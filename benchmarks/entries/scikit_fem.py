"""scikit-fem: linear and quadratic triangles on the shared mesh, as its example 11 (linear elasticity)."""

import time
from dataclasses import dataclass, replace

import numpy as np
import skfem
from skfem.models.elasticity import linear_elasticity

from benchmarks.entries.linear_system import interleaved, solved_directly
from pinnray.solvers.lagrange import LagrangeSpace
from pinnray.solvers.problem import Problem
from pinnray.solvers.solution import Solution, Status
from pinnray.solvers.solver import Progress, check_problem, silent


@dataclass(frozen=True)
class SkfemEntry:
    """Elements of a degree, solved by SuperLU in symmetric mode."""

    degree: int = 2
    laws = ("linear",)
    loads = ("mean", "point", "patch")

    @property
    def name(self) -> str:
        """With the degree."""
        return f"skfem-p{self.degree}"

    def settings(self) -> dict[str, object]:
        """Degree and version."""
        return {"degree": self.degree, "scikit-fem": skfem.__version__}

    def solve(self, problem: Problem, progress: Progress = silent) -> Solution:
        """Solve the linear problem."""
        check_problem(self, problem)
        started, mesh, lame = time.perf_counter(), problem.mesh, problem.material.lame
        element = skfem.ElementTriP1() if self.degree == 1 else skfem.ElementTriP2()
        triangles = skfem.MeshTri(mesh.points.T.copy(), mesh.triangles.T.copy())
        basis = skfem.Basis(triangles, skfem.ElementVector(element))
        stiffness = skfem.asm(linear_elasticity(lame.λ, lame.μ), basis).tocsc()
        nodes = basis.nodal_dofs
        if self.degree == 2:
            nodes = np.hstack([nodes, basis.facet_dofs])  # both number edges alike
        space = LagrangeSpace(mesh, self.degree)
        found = solved_directly(self.name, problem, space, interleaved(stiffness, nodes), started)
        too_stiff = "linear triangles are too stiff in bending, and their error is not estimated"
        return found if self.degree > 1 else replace(found, status=Status(False, too_stiff))
