"""The indenter's force by the stress of a displacement field."""

import numpy as np

from geometry.arrays import FloatArray
from geometry.mesh.quadrature import Quadrature
from solvers.elasticity import linear_stress
from solvers.problem import Problem, contact_ends


def section_force(problem: Problem, rule: Quadrature, gradient: FloatArray) -> FloatArray:
    """Force on the sections between base and contact, on average, for the prescribed components.

    In equilibrium each of these sections transmits the indenter's force. This is the work of the stress on a
    displacement that grows linearly from the base to the contact, where it is a unit translation.

    Args:
        problem: Of the linear law.
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
