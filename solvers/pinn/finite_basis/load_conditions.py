"""The load as linear functionals of a network's displacement."""

import numpy as np

from pinnray.runtime.arrays import FloatArray
from pinnray.solvers.problem import Problem, contact_functional, contact_nodes, front_points

MOMENTS = 12
"""Moments of the displacement that a rigid patch prescribes for each component."""


def load_conditions(problem: Problem) -> tuple[FloatArray, FloatArray, FloatArray]:
    """The functionals of a load; none of a cylinder, which presses only where it touches.

    For `patch` they are moments against the tractions T_k(s) / sqrt(1 - s^2) with Chebyshev polynomials T_k,
    which have the singularity of a rigid punch at both ends: the first is that of the punch on a half-plane
    (K. L. Johnson, Contact Mechanics, Cambridge University Press, 1985, section 2.8). Gauss-Chebyshev
    quadrature makes them sums over its points s = cos(angle), where T_k is cos(k angle); s runs along x.

    Returns:
        Points (q, 2), mm; weights (k, q) of the displacement there, of which the first ones sum to one, so
        that their multiplier is the force; and the sums' values (a, k), mm, for each prescribed component.
    """
    values = problem.load.values[:, None]
    if problem.load.kind == "cylinder":
        return problem.mesh.points[:1], np.zeros((0, 1)), np.zeros((2, 0))  # a point that windows reach
    if problem.load.kind != "patch":
        points, weights = contact_functional(problem)
        return points, weights[None], values
    angles = np.pi * (np.arange(2 * MOMENTS) + 0.5) / (2 * MOMENTS)
    left, right = contact_end_points(problem)[:, 0]
    points = front_points(problem.mesh, left + 0.5 * (1 + np.cos(angles)) * (right - left))
    weights = np.cos(np.outer(np.arange(MOMENTS), angles)) / len(angles)
    return points, weights, np.pad(values, ((0, 0), (0, MOMENTS - 1)))


def contact_end_points(problem: Problem) -> FloatArray:
    """The first and the last node of the contact, shape (2, 2), mm."""
    nodes = problem.mesh.points[contact_nodes(problem)]
    return nodes[[nodes[:, 0].argmin(), nodes[:, 0].argmax()]]
