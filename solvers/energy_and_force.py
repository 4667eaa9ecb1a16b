"""Energy and force of a displacement field, by quadrature in the elements."""

import numpy as np
from scipy.sparse import diags
from scipy.sparse.linalg import spsolve

from geometry.arrays import FloatArray
from geometry.mesh.boundary import mean_thickness
from geometry.mesh.point_location import LocatedPoints
from geometry.mesh.quadrature import body_quadrature
from solvers.elasticity import deformation_jacobian
from solvers.lagrange import LagrangeSpace
from solvers.problem import Problem, contact_ends, contact_nodes
from solvers.solution import DisplacementField, State

PLATEAU = 0.1
"""Part of the harmonic function's range that is cut off at base and contact, where the stress is singular."""


def energy_and_force(problem: Problem, field: DisplacementField, degree: int = 2) -> tuple[float, FloatArray]:
    """Energy per depth, N mm/mm, and the indenter's force per depth, shape (2,), N/mm.

    The force is the mean of those on sections between base and contact, each of which transmits the indenter's in
    equilibrium: the work of the stress on a virtual displacement that grows from zero at the base to a unit
    translation at the contact. It is zero for a component that is free. `degree` is of the quadrature.
    """
    rule = body_quadrature(problem.mesh, degree)
    gradient = field.gradient(rule.location)
    state = State.from_gradient(gradient, problem)
    energy = float((rule.weights * state.energy_density).sum())
    stress = state.stress
    if problem.material.law != "linear":  # per undeformed area: P = J σ F⁻ᵀ
        deformation = np.eye(2) + gradient
        jacobian = deformation_jacobian(gradient)[:, None, None]
        stress = jacobian * stress @ np.linalg.inv(deformation).transpose(0, 2, 1)
    traction = np.einsum("nij,nj->ni", stress, section_slope(problem, rule.location))
    force = np.zeros(2)
    force[problem.load.prescribed] = (rule.weights @ traction)[problem.load.prescribed]
    return energy, force


def section_slope(problem: Problem, location: LocatedPoints) -> FloatArray:
    """Gradient of a function that is zero at the base and one at the contact, shape (n, 2), 1/mm.

    It grows linearly with x if base and contact are at least a wall's thickness apart, so that sections of
    constant x separate them. Elsewhere, as in a ring, it is harmonic.
    """
    start = float(problem.mesh.points[problem.mesh.boundary("base").ravel(), 0].max())
    end, _ = contact_ends(problem)
    if end - start < mean_thickness(problem.mesh):
        return harmonic_slope(problem, location)
    x = location.points[:, :1]
    return np.where((x > start) & (x < end), [1 / (end - start), 0.0], 0.0)


def harmonic_slope(problem: Problem, location: LocatedPoints) -> FloatArray:
    """Gradient of a harmonic function of linear elements, cut off near its ends, shape (n, 2), 1/mm."""
    mesh = problem.mesh
    space = LagrangeSpace(mesh, 1)
    along = space.shape_gradients(mesh.at_centroids())
    stiffness = sum(matrix.T @ diags(mesh.areas) @ matrix for matrix in along).tocsr()
    values = np.zeros(len(mesh.points))
    values[contact_nodes(problem)] = 1.0
    free = np.ones(len(values), dtype=bool)
    free[np.concatenate([contact_nodes(problem), mesh.boundary("base").ravel()])] = False
    values[free] = spsolve(stiffness[free][:, free].tocsc(), -stiffness[free] @ values)
    values = np.clip((values - PLATEAU) / (1 - 2 * PLATEAU), 0.0, 1.0)
    return np.column_stack([matrix @ values for matrix in space.shape_gradients(location)])
