"""Energy and force of a displacement field of the linear law, by quadrature in the elements."""

import numpy as np

from geometry.arrays import FloatArray
from geometry.mesh.quadrature import body_quadrature
from solvers.elasticity import linear_energy_density, linear_stress
from solvers.problem import Problem, contact_ends
from solvers.solution import DisplacementField


def energy_and_force(problem: Problem, field: DisplacementField, degree: int = 2) -> tuple[float, FloatArray]:
    """Energy per depth, N mm/mm, and the indenter's force per depth, shape (2,), N/mm.

    The force is the mean of those on the sections between base and contact, each of which transmits the
    indenter's in equilibrium: the work of the stress on a displacement that grows linearly from the base to a
    unit translation at the contact. It is zero for a component that is free.

    Args:
        problem: A problem of the linear law.
        field: The displacement.
        degree: Of the quadrature.
    """
    rule = body_quadrature(problem.mesh, degree)
    gradient, lame = field.gradient(rule.location), problem.material.lame
    energy = float((rule.weights * linear_energy_density(gradient, lame)).sum())
    x = rule.location.points[:, 0]
    start = float(problem.mesh.points[problem.mesh.boundary("base").ravel(), 0].max())
    end, _ = contact_ends(problem)
    between = (x > start) & (x < end)
    stress = linear_stress(gradient[between], lame)
    force = np.zeros(2)
    for axis in problem.load.prescribed:
        force[axis] = (rule.weights[between] * (stress.xx, stress.xy)[axis]).sum() / (end - start)
    return energy, force
