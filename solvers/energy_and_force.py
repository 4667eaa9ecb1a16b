"""Energy and force of a displacement field, by quadrature in the elements."""

import numpy as np
from scipy.sparse import diags
from scipy.sparse.linalg import spsolve

from pinnray.geometry.mesh.boundary import mean_thickness
from pinnray.geometry.mesh.point_location import LocatedPoints
from pinnray.geometry.mesh.quadrature import body_quadrature
from pinnray.runtime.arrays import FloatArray
from pinnray.solvers.elasticity import piola_stress
from pinnray.solvers.lagrange import LagrangeSpace
from pinnray.solvers.problem import Problem, contact_ends, contact_nodes
from pinnray.solvers.solution import DisplacementField, State


def energy_and_force(problem: Problem, field: DisplacementField, degree: int = 2) -> tuple[float, FloatArray]:
    """Energy per depth, N mm/mm, and the indenter's force per depth, shape (2,), N/mm.

    The force is the work of the stress on a virtual displacement that grows from zero at the base to a unit
    translation at the contact: a mean over sections, each of which transmits the indenter's force in
    equilibrium. It is zero for a component that is free. `degree` is the quadrature's.
    """
    rule = body_quadrature(problem.mesh, degree)
    gradient = field.gradient(rule.location)
    state = State.from_gradient(gradient, problem)
    energy = float((rule.weights * state.energy_density).sum())
    stress = piola_stress(problem.material.law, gradient, state.stress)
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
    values = np.clip((values - 0.1) / 0.8, 0.0, 1.0)  # flat near base and contact, where stress is singular
    return np.column_stack([matrix @ values for matrix in space.shape_gradients(location)])
