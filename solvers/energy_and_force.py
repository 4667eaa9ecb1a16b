"""Energy and force of a displacement field of the linear law, by quadrature in the elements."""

import numpy as np

from geometry.arrays import FloatArray
from geometry.mesh.quadrature import Quadrature, body_quadrature
from solvers.elasticity import linear_energy_density, linear_stress
from solvers.problem import Problem, contact_ends
from solvers.solution import DisplacementField


def energy_and_force(problem: Problem, field: DisplacementField, degree: int = 2) -> tuple[float, FloatArray]:
    """Energy per depth, N mm/mm, and the indenter's force per depth, shape (2,), N/mm.

    Args:
        problem: A problem of the linear law.
        field: The displacement.
        degree: Of the quadrature.
    """
    rule = body_quadrature(problem.mesh, degree)
    gradient = field.gradient(rule.location)
    energy = float((rule.weights * linear_energy_density(gradient, problem.material.lame)).sum())
    return energy, _section_force(problem, rule, gradient)


def _section_force(problem: Problem, rule: Quadrature, gradient: FloatArray) -> FloatArray:
    """Mean force on the sections between base and contact, for the prescribed components.

    In equilibrium each of these sections transmits the indenter's force. The mean is the work of the stress
    on a displacement that grows linearly from the base to a unit translation at the contact.
    It is zero for a component that is free.
    """
    x = rule.location.points[:, 0]
    start = float(problem.mesh.points[problem.mesh.boundary("base").ravel(), 0].max())
    end, _ = contact_ends(problem)
    between = (x > start) & (x < end)
    stress = linear_stress(gradient[between], problem.material.lame)
    force = np.zeros(2)
    for axis in problem.load.prescribed:
        force[axis] = (rule.weights[between] * (stress.xx, stress.xy)[axis]).sum() / (end - start)
    return force
