"""Boundary-value problems with body forces, tractions and Dirichlet conditions, below the level of `fem`.

A `Problem` has only a clamp and an indenter. Here DOLFINx assembles and MUMPS factorises as for `fem`; the
nodal forces come from quadrature rules of high degree in NumPy.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from skfem.quadrature import get_quadrature
from skfem.refdom import RefTri

from benchmarks.verification.hooke import PlaneLaw
from pinnray.geometry.mesh.point_location import LocatedPoints
from pinnray.geometry.mesh.quadrature import Quadrature, edge_quadrature
from pinnray.geometry.mesh.triangle_mesh import TriangleMesh
from pinnray.runtime.arrays import BoolArray, FloatArray
from pinnray.solvers.fem.equilibrium import DiscreteEquilibrium
from pinnray.solvers.lagrange import LagrangeField, LagrangeSpace
from pinnray.solvers.problem import Material, Problem
from pinnray.solvers.solution import State

Function = Callable[[FloatArray], FloatArray]
"""Takes points (n, 2), mm, to values at them."""


@dataclass(frozen=True)
class Exact:
    """A known solution.

    Attributes:
        displacement: To shape (n, 2), mm.
        stress: To shape (n, 2, 2), MPa.
        body_force: To shape (n, 2), N/mm³; None where there is none.
    """

    displacement: Function
    stress: Function
    body_force: Function | None = None


@dataclass(frozen=True, eq=False)
class BoundaryValue:
    """A boundary-value problem of linear elasticity.

    Attributes:
        mesh: The body.
        material: Of linear law.
        body_force: N/mm³.
        tractions: Stress field whose traction acts on a boundary, by name, MPa.
        given: Displacement prescribed on a boundary, by name, and the prescribed components.
    """

    mesh: TriangleMesh
    material: Material
    given: Mapping[str, tuple[Function, tuple[int, ...]]]
    tractions: Mapping[str, Function]
    body_force: Function | None = None

    def solve(self, degree: int) -> LagrangeField:
        """The finite-element solution."""
        space = LagrangeSpace(self.mesh, degree)
        held, nodal = self._given(space)
        equilibrium = DiscreteEquilibrium(Problem(self.mesh, self.material), space)
        factors = equilibrium.factorised(held)
        nodal = nodal + factors.solve(self._forces(space) - equilibrium.internal_force(nodal))
        factors.destroy()
        return LagrangeField(space, nodal)

    def state(self, field: LagrangeField, location: LocatedPoints) -> State:
        """Strain and stress, by the same code as for every solver."""
        return State.from_gradient(field.gradient(location), Problem(self.mesh, self.material))

    def errors(self, field: LagrangeField, exact: Exact) -> tuple[float, float]:
        """Relative errors of the displacement in L2 and of the stress in the energy norm."""
        rule, law = gauss_rule(self.mesh), PlaneLaw.of(self.material)
        points = rule.location.points
        u, σ = exact.displacement(points), exact.stress(points)

        def root(values: FloatArray) -> float:
            return float(np.sqrt(rule.weights @ values))

        return (
            root(((field.displacement(rule.location) - u) ** 2).sum(axis=1)) / root((u**2).sum(axis=1)),
            root(law.energy_density(self.state(field, rule.location).stress - σ))
            / root(law.energy_density(σ)),
        )

    def _given(self, space: LagrangeSpace) -> tuple[BoolArray, FloatArray]:
        held, nodal = np.zeros((len(space.nodes), 2), dtype=bool), np.zeros((len(space.nodes), 2))
        for name, (displacement, components) in self.given.items():
            where = np.ix_(space.boundary_nodes(name), np.array(components))
            held[where] = True
            nodal[where] = displacement(space.nodes)[where]
        return held, nodal

    def _forces(self, space: LagrangeSpace) -> FloatArray:
        forces = np.zeros((len(space.nodes), 2))
        if self.body_force:
            rule = gauss_rule(self.mesh)
            values = rule.weights[:, None] * self.body_force(rule.location.points)
            forces += space.shape_functions(rule.location).T @ values
        for name, stress in self.tractions.items():
            points, lengths = edge_quadrature(self.mesh, name)
            location = self.mesh.locate(points)
            start, end = (self.mesh.points[self.mesh.boundary(name)[:, k]] for k in range(2))
            along = np.repeat((end - start) / np.linalg.norm(end - start, axis=1)[:, None], 4, axis=0)
            normals = np.column_stack([along[:, 1], -along[:, 0]])
            inside = self.mesh.points[self.mesh.triangles[location.cells]].mean(axis=1) - points
            normals *= -np.sign((normals * inside).sum(axis=1))[:, None]
            traction = np.einsum("nij,nj->ni", stress(points), normals)
            forces += space.shape_functions(location).T @ (lengths[:, None] * traction)
        return forces


def gauss_rule(mesh: TriangleMesh) -> Quadrature:
    """scikit-fem's rule in every triangle, exact to degree 7."""
    (x, y), weights = get_quadrature(RefTri, 7)
    location = mesh.at_barycentric(np.column_stack([1 - x - y, x, y]))
    return Quadrature(location, np.outer(mesh.areas, weights / weights.sum()).ravel())


def at_rest(points: FloatArray) -> FloatArray:
    """No displacement, shape (n, 2), mm."""
    return np.zeros_like(points)
