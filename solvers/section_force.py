"""The indenter's force from the stress in sections of the finger."""

import numpy as np

from geometry.arrays import FloatArray
from geometry.mesh.quadrature import Quadrature
from solvers.elasticity import linear_stress
from solvers.problem import Problem, contact_ends


def section_force(problem: Problem, rule: Quadrature, gradient: FloatArray) -> FloatArray:
    """Mean force on the sections between base and contact, for the prescribed components.

    In equilibrium each of these sections transmits the indenter's force. The mean is the work of the stress
    on a displacement that grows linearly from the base to a unit translation at the contact.

    Args:
        problem: A problem of the linear law.
        rule: A quadrature over the body.
        gradient: Displacement gradient at its points, shape (q, 2, 2).

    Returns:
        Per depth, shape (2,), N/mm; zero for a component that is free.
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
